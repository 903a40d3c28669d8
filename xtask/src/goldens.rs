//! Golden replays: games in every shipped scene and those in `tests/scenes`, recorded with the hash of each tick, and
//! the replays behind the golden hashes. Every build of the simulation must reproduce them bit for bit; a divergence is
//! reported with its tick, phase, body and field.

use crate::hashes;
use crate::packages;
use crate::shell::{Skipped, cargo, in_path, output_of, root, run, say, target_dir};
use crate::workspace::USUAL_CRATES;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

const REPLAYS: &str = "tests/goldens/replays";
const SCENES: &str = "tests/scenes";
const PROGRAM: &str = "jostle-goldens";
/// A target that Rust's own linker can link, so that no C compiler is needed.
const AARCH64: &str = "aarch64-unknown-linux-musl";
const AARCH64_LINKER: &str = "CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER";
const EMULATOR: &str = "qemu-aarch64";

/// Verifies with the debug build, as compiled by the preceding tests.
pub fn check() -> Result<()> {
    verify_with("debug", "debug", &[])
}

/// Verifies with two release builds, one for any processor and one that uses all features of this one.
pub fn check_builds() -> Result<()> {
    let release = ["--package", PROGRAM, "--release"];
    verify("release", &mut program(&release), "release", &[])?;
    let mut native = program(&release);
    native.env("RUSTFLAGS", "-Ctarget-cpu=native").arg("--target-dir");
    native.arg(target_dir().join("native"));
    verify("release for this processor", &mut native, "native/release", &[])
}

/// Verifies with a build for 64-bit Arm in an emulator; skipped if no emulator is available.
pub fn check_aarch64() -> Result<()> {
    if cfg!(not(target_os = "linux")) {
        bail!(Skipped("the emulator runs programs of Linux".into()));
    }
    if !in_path(EMULATOR) {
        packages::provide("the tests for 64-bit Arm", &["qemu-user"])
            .map_err(|error| Skipped(format!("no {EMULATOR}: {error}")))?;
    }
    let mut target = Command::new("rustup");
    target.args(["target", "add", AARCH64]).current_dir(root());
    run(&mut target).map_err(|error| Skipped(format!("no Rust for {AARCH64}: {error}")))?;
    let mut build = program(&["--package", PROGRAM, "--target", AARCH64]);
    build.env(AARCH64_LINKER, "rust-lld");
    verify("64-bit Arm", &mut build, &format!("{AARCH64}/debug"), &[EMULATOR])
}

/// Records all golden replays again.
pub fn update() -> Result<()> {
    run(&mut program(&USUAL_CRATES))?;
    let mut record = Command::new(target_dir().join("debug").join(PROGRAM));
    record.args(["record", REPLAYS]).args(files(SCENES, "toml")?).current_dir(root());
    run(&mut record)?;
    say("goldens", &format!("wrote {REPLAYS}"));
    Ok(())
}

fn program(selection: &[&str]) -> Command {
    let mut build = cargo(&["build", "--bin", PROGRAM]);
    build.args(selection);
    build
}

fn verify(name: &str, build: &mut Command, place: &str, runner: &[&str]) -> Result<()> {
    run(build)?;
    verify_with(name, place, runner)
}

fn verify_with(name: &str, place: &str, runner: &[&str]) -> Result<()> {
    let program = target_dir().join(place).join(PROGRAM);
    let mut line = runner.iter().map(PathBuf::from).chain([program]);
    let mut command = Command::new(line.next().expect("the program at least"));
    command.args(line);
    let mut replays = files(REPLAYS, "jostle")?;
    if replays.is_empty() {
        bail!("no replays in {REPLAYS}; `cargo xtask test --update-hashes` records them");
    }
    replays.extend(hashes::replays()?);
    output_of(command.arg("verify").args(&replays).current_dir(root())).with_context(|| {
        format!(
            "{name}: a golden replay differs (if this is a wanted change, \
             run `cargo xtask test --update-hashes`)"
        )
    })?;
    say("goldens", &format!("{name}: {} replays, every tick equal", replays.len()));
    Ok(())
}

/// Lists the files in a directory that have a given extension, relative to the root and sorted by name.
fn files(dir: &str, ending: &str) -> Result<Vec<String>> {
    let entries = fs::read_dir(root().join(dir)).with_context(|| format!("no {dir}"))?;
    let mut names = Vec::new();
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.ends_with(&format!(".{ending}")) {
            names.push(format!("{dir}/{name}"));
        }
    }
    names.sort();
    Ok(names)
}
