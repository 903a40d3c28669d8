//! Runs other programs and locates directories.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The reason a step cannot run on this machine: an error, but not a failure.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Skipped(pub String);

/// The workspace's root directory.
pub fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("xtask lies inside the workspace").to_path_buf()
}

pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The cargo that runs this task, with the workspace's root as its working directory.
pub fn cargo(args: &[&str]) -> Command {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(args).current_dir(root());
    // Cargo sets these variables for this task. Some build scripts depend on them, and would cause the same crates to
    // be compiled again if the values differed.
    for (name, _) in std::env::vars_os() {
        let name = name.to_string_lossy();
        if name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") {
            command.env_remove(&*name);
        }
    }
    command
}

/// The same for the `bench` workspace, which shares the target directory.
pub fn cargo_of_bench(args: &[&str]) -> Command {
    let mut command = cargo(args);
    command.current_dir(root().join("bench")).env("CARGO_TARGET_DIR", target_dir());
    command
}

/// Builds targets of the crate `cli`, optimised and without the replay renderer, which would take most of the time.
pub fn build_server(targets: &[&str]) -> Result<()> {
    let selection = ["build", "--release", "--package", "jostle-cli", "--no-default-features"];
    run(cargo(&selection).args(targets))
}

/// Prints one line of progress.
pub fn say(task: &str, what: &str) {
    println!("{task}: {what}");
}

/// Runs a command to completion with its output on the terminal. A failure status is an error.
pub fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot start {}", line_of(command)))?;
    if !status.success() {
        bail!("`{}` failed ({status})", line_of(command));
    }
    Ok(())
}

/// Runs a command to completion and returns its output; stderr still goes to the terminal.
pub fn output_of(command: &mut Command) -> Result<String> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("cannot start {}", line_of(command)))?;
    if !output.status.success() {
        bail!("`{}` failed ({})", line_of(command), output.status);
    }
    String::from_utf8(output.stdout)
        .with_context(|| format!("{} printed no UTF-8", line_of(command)))
}

/// The command line as a user would type it.
pub fn line_of(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_name().unwrap_or(program.as_os_str()).to_string_lossy().into_owned();
    let args = command.get_args().map(|arg| arg.to_string_lossy().into_owned());
    std::iter::once(name).chain(args).collect::<Vec<_>>().join(" ")
}

/// Whether a program with the given name is in the search path.
pub fn in_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|dir| dir.join(program).is_file())
}
