//! The static programs of a release: built for musl and linked by Rust's own linker. A C compiler is needed only for
//! ring. Its C code needs the headers of a C library but calls none of its functions, so any compiler for the processor
//! will do.

use crate::packages;
use crate::shell::{cargo, output_of, root, run, say, target_dir};
use anyhow::{Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A target system of a release.
pub struct ReleaseTarget {
    /// Rust's name for the target.
    pub name: &'static str,
    /// Prefix of the names of the C compiler and the archiver.
    tools: &'static str,
    /// Debian packages that contain these tools and the headers of a C library.
    packages: [&'static str; 2],
    /// The emulator and its Debian package, if this processor cannot run the target's programs.
    pub emulator: Option<[&'static str; 2]>,
}

/// Linux on 64-bit x86 and Arm, in any distribution.
pub const TARGETS: [ReleaseTarget; 2] = [
    ReleaseTarget {
        name: "x86_64-unknown-linux-musl",
        tools: "",
        packages: ["gcc", "libc6-dev"],
        emulator: None,
    },
    ReleaseTarget {
        name: "aarch64-unknown-linux-musl",
        tools: "aarch64-linux-gnu-",
        packages: ["gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross"],
        emulator: Some(["qemu-aarch64", "qemu-user"]),
    },
];

/// Builds the program for a target and returns its path. It serves and plays but cannot draw replays, since a static
/// program cannot load graphics drivers.
pub fn build(target: &ReleaseTarget) -> Result<PathBuf> {
    let name = target.name;
    say("dist", &format!("build jostle for {name}"));
    let missing: Vec<&str> =
        target.packages.into_iter().filter(|package| !packages::has(package)).collect();
    packages::provide(&format!("programs for {name}"), &missing)?;
    run(Command::new("rustup").args(["target", "add", name]).current_dir(root()))?;
    let variable = name.replace('-', "_");
    let mut build = cargo(&["build", "--locked", "--release", "--target", name]);
    build.args(["--package", "jostle-cli", "--bin", "jostle"]);
    build.args(["--no-default-features", "--features", "nats"]);
    // Keep function names in panic backtraces.
    build.args(["--config", "profile.release.strip=\"debuginfo\""]);
    build.env(format!("CARGO_TARGET_{}_LINKER", variable.to_uppercase()), "rust-lld");
    build.env(format!("CC_{variable}"), format!("{}gcc", target.tools));
    build.env(format!("AR_{variable}"), format!("{}ar", target.tools));
    run(&mut build)?;
    let program = target_dir().join(name).join("release/jostle");
    check_static(&program)?;
    Ok(program)
}

/// Checks that a program needs neither shared libraries nor a loader.
fn check_static(program: &Path) -> Result<()> {
    let mut readelf = Command::new("readelf");
    let headers = output_of(readelf.args(["--program-headers", "--dynamic"]).arg(program))?;
    for needed in ["(NEEDED)", "INTERP"] {
        ensure!(!headers.contains(needed), "{} is not static: {needed}", program.display());
    }
    Ok(())
}
