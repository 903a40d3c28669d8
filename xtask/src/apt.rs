//! Debian's packages: installed where that is possible, else named with the command that does.

use crate::shell::{in_path, output_of, run, say, target_dir};
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::process::{Command, Stdio};

/// Installs packages. `what` needs them, for the person who has to do it.
pub fn provide(what: &str, packages: &[&str]) -> Result<()> {
    if packages.is_empty() {
        return Ok(());
    }
    let install = format!("apt-get install --no-install-recommends {}", packages.join(" "));
    if !in_path("apt-get") {
        bail!("{what} need Debian's packages {}, or what they hold", packages.join(" "));
    }
    if !is_root()? {
        bail!("{what} need packages that are not installed; run: sudo {install}");
    }
    // Steps of the tests that run side by side may all lack something; the second would find the package lists locked.
    let lock = File::create(target_dir().join("apt.lock")).context("target/apt.lock")?;
    lock.lock().context("target/apt.lock")?;
    say("packages", &install);
    run(apt().arg("update"))?;
    run(apt().args(["install", "--yes", "--no-install-recommends"]).args(packages))
}

/// Whether a package is installed; true where Debian's packages are unknown.
pub fn has(package: &str) -> bool {
    if !in_path("dpkg-query") {
        return true;
    }
    let query = Command::new("dpkg-query")
        .args(["--show", "--showformat=${db:Status-Status}", package])
        .stderr(Stdio::null())
        .output();
    query.is_ok_and(|output| output.stdout == b"installed")
}

fn apt() -> Command {
    let mut command = Command::new("apt-get");
    command.arg("--quiet").env("DEBIAN_FRONTEND", "noninteractive");
    command
}

fn is_root() -> Result<bool> {
    Ok(output_of(Command::new("id").arg("-u"))?.trim() == "0")
}
