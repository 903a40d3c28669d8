//! The licences of all crates in a release, and a list of these crates (SBOM). The programs that write them are
//! installed into the target directory if they are missing.

use crate::shell::{cargo, root, run, say, target_dir};
use crate::workspace::packages;
use anyhow::{Context, Result};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names and versions of the programs, and the features to build them with.
const LICENCES: [&str; 3] = ["cargo-about", "0.9.3", "cli"];
const CRATES: [&str; 3] = ["cargo-cyclonedx", "0.5.9", ""];
/// File name of the list, which does not occur in any crate.
const LIST: &str = "jostle-list-of-crates";

/// Writes the licences of all crates in the program and the page, and returns the file's path. about.toml, next to this
/// file, lists the accepted licences.
pub fn licences() -> Result<PathBuf> {
    say("dist", "gather the licences of all crates");
    let file = target_dir().join("licences.txt");
    let beside = root().join("xtask/src/dist");
    let mut about = Command::new(provide(LICENCES)?);
    // Use only files from the crates themselves, so that the same commit gives the same text.
    run(&mut cargo(&["fetch", "--locked"]))?;
    about.args([
        "generate",
        "--offline",
        "--locked",
        "--fail",
        "--manifest-path",
        "cli/Cargo.toml",
    ]);
    about.arg("--config").arg(beside.join("about.toml")).arg("--output-file").arg(&file);
    run(about.arg(beside.join("licences.hbs")).current_dir(root()))?;
    Ok(file)
}

/// Writes a list, in CycloneDX format, of the crates that one of our crates depends on for a target. `dir` is the
/// crate's directory.
pub fn crates(dir: &str, target: &str, out: &Path) -> Result<()> {
    say("dist", &format!("list the crates of {dir} for {target}"));
    let mut list = Command::new(provide(CRATES)?);
    list.args(["cyclonedx", "--manifest-path"]).arg(root().join(dir).join("Cargo.toml"));
    list.args(["--format", "json", "--spec-version", "1.5", "--quiet", "--no-build-deps"]);
    list.args(["--no-default-features", "--target", target, "--override-filename", LIST]);
    if dir == "cli" {
        list.args(["--features", "nats"]);
    }
    run(list.current_dir(root()))?;
    // The tool writes a list next to each manifest in the workspace.
    for package in packages()? {
        let written = package.manifest_path.with_file_name(format!("{LIST}.json"));
        if package.manifest_path == root().join(dir).join("Cargo.toml") {
            let text = fs::read_to_string(&written);
            let text = text.with_context(|| format!("no {}", written.display()))?;
            // Our own crates are identified by their paths on this machine.
            let here = format!("file://{}/", root().display());
            fs::write(out, text.replace(&here, "file:///jostle/"))?;
        }
        fs::remove_file(&written).with_context(|| format!("no {}", written.display()))?;
    }
    Ok(())
}

/// Installs a program if its version is missing, and returns its path.
fn provide([name, version, features]: [&str; 3]) -> Result<PathBuf> {
    let dir = target_dir().join("tools").join(format!("{name}-{version}"));
    let program = dir.join("bin").join(name);
    if !program.is_file() {
        let mut install =
            cargo(&["install", name, "--version", version, "--locked", "--features", features]);
        // The tools run only for seconds, so minutes of optimisation would not pay off.
        install.env("CARGO_PROFILE_RELEASE_LTO", "off");
        run(install.arg("--root").arg(dir))?;
    }
    Ok(program)
}
