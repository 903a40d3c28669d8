//! Builds the web client: compiles it to wasm and runs the program `xtask-web`, which turns it into `client-web/dist`.

use crate::shell::{self, cargo, root, run, say};
use anyhow::{Context, Result};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Rust's name for the page's target.
pub const TARGET: &str = "wasm32-unknown-unknown";
/// All maintained browsers with WebGL2 support these instructions.
const FEATURES: &str = "-Ctarget-feature=+simd128";
/// Disables automatic unrolling and vectorisation, which are done by hand where they are worth the bytes, and inlines
/// less than usual. This saves 8 kB in the simulation, which is compiled for speed.
const SMALL: [&str; 4] = [
    "-Cno-vectorize-loops",
    "-Cllvm-args=-unroll-allow-partial=false",
    "-Cllvm-args=-unroll-runtime=false",
    "-Cllvm-args=-inlinedefault-threshold=55",
];
/// Maximum compressed size of a build for users; a phone with 2 Mbit/s takes four seconds to download it.
const PROGRAM_BYTES_MAX: u64 = 998_000;

/// How the client is compiled.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// For users; a small download.
    Small,
    /// Like `Small`, with the best compression.
    Release,
    /// For development; quick to compile.
    Dev,
}

impl Profile {
    /// Cargo's names for the profile and for its output directory.
    fn names(self) -> [&'static str; 2] {
        match self {
            Profile::Small | Profile::Release => ["wasm", "wasm"],
            Profile::Dev => ["dev", "debug"],
        }
    }

    /// How much effort to put into compressing the files.
    fn effort(self) -> &'static str {
        match self {
            Profile::Small => "good",
            Profile::Release => "release",
            Profile::Dev => "hurried",
        }
    }
}

/// Builds everything into `client-web/dist`.
pub fn build(profile: Profile) -> Result<()> {
    build_with(profile, &[])
}

/// Builds everything and also writes the page without a server into `target/static`.
pub fn build_static(profile: Profile) -> Result<()> {
    let out = shell::target_dir().join("static");
    build_with(profile, &["--static-page".as_ref(), out.as_os_str()])
}

fn build_with(profile: Profile, more: &[&OsStr]) -> Result<()> {
    add_target()?;
    say("web", &format!("compile the client to wasm (profile {})", profile.names()[0]));
    let wasm = compile(profile)?;
    let mut make = maker("run");
    make.args(["--quiet", "--"]).arg("--root").arg(root()).arg("--wasm").arg(wasm);
    make.arg("--bound").arg(target_dir().join("bound")).args(["--effort", profile.effort()]);
    if profile != Profile::Dev {
        make.args(["--program-bytes-max", &PROGRAM_BYTES_MAX.to_string()]);
    }
    run(make.args(more))
}

/// A cargo command for the program that builds the page, using the page's target directory.
pub fn maker(command: &str) -> Command {
    let mut cargo = cargo(&[command, "--package", "xtask-web", "--target-dir"]);
    cargo.arg(target_dir());
    cargo
}

/// Adds the wasm target if the toolchain does not have it.
fn add_target() -> Result<()> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let libdir = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", TARGET])
        .current_dir(root())
        .output()
        .context("cannot start rustc")?;
    let libdir = String::from_utf8_lossy(&libdir.stdout).trim().to_owned();
    if Path::new(&libdir).is_dir() {
        return Ok(());
    }
    say("web", &format!("add the target {TARGET}"));
    run(Command::new("rustup").args(["target", "add", TARGET]).current_dir(root()))
}

/// Compiles the client; returns its path.
fn compile(profile: Profile) -> Result<PathBuf> {
    run(cargo_for_page("build", profile).args(["--package", "jostle-client-web"]))?;
    Ok(target_dir().join(TARGET).join(profile.names()[1]).join("jostle_client_web.wasm"))
}

/// A cargo command for the page's libraries. It uses a separate target directory, so that other cargo commands can run
/// at the same time.
pub fn cargo_for_page(command: &str, profile: Profile) -> Command {
    let mut cargo = cargo(&[command, "--lib", "--target", TARGET, "--config"]);
    cargo.arg(format!("target.{TARGET}.rustflags={:?}", flags()));
    cargo.args(["--profile", profile.names()[0], "--target-dir"]).arg(target_dir());
    cargo
}

/// Compiler flags. Panic messages name files of other crates without their local directory, so that the program is
/// smaller and the same on every machine.
fn flags() -> Vec<String> {
    let home = std::env::home_dir().unwrap_or_default();
    let home = std::env::var_os("CARGO_HOME").map_or(home.join(".cargo"), PathBuf::from);
    let sources = std::fs::read_dir(home.join("registry/src")).into_iter().flatten().flatten();
    let short = sources.map(|entry| format!("--remap-path-prefix={}=", entry.path().display()));
    std::iter::once(FEATURES).chain(SMALL).map(str::to_owned).chain(short).collect()
}

fn target_dir() -> PathBuf {
    root().join("target/web")
}
