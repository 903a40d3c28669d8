//! `cargo xtask report`: error against run time, and stability, measured on this machine.

use crate::shell::{cargo_of_bench, output_of, root, run, say, target_dir};
use anyhow::{Context, Result};
use std::env::consts::EXE_SUFFIX;
use std::path::{Path, PathBuf};
use std::process::Command;
use time::OffsetDateTime;

/// Measures, with the peers if wanted, and writes the page into `out`.
pub fn report(quick: bool, peers: bool, out: &Path) -> Result<()> {
    let out = std::path::absolute(out).context("where the report goes")?;
    let (package, profile) = if peers { ("peers", "peers") } else { ("report", "release") };
    say("report", &format!("build jostle-{package}, optimised"));
    let mut command = cargo_of_bench(&["run", "--quiet", "--profile", profile, "--"]);
    // The peers' directory has settings for their C compiler.
    command.current_dir(root().join("bench").join(package));
    if quick {
        command.arg("--quick");
    }
    command.arg("--costs").arg(steps()?);
    command.arg("--out").arg(&out);
    command.args(["--commit", &commit()?, "--date", &today(), "--compiler", &compiler()?]);
    run(&mut command)
}

/// The program whose instructions are counted; the ordinary build, whatever the report is built with.
fn steps() -> Result<PathBuf> {
    let mut build = cargo_of_bench(&["build", "--quiet", "--release"]);
    run(build.args(["--package", "jostle-report", "--bin", "steps"]))?;
    Ok(target_dir().join("release").join(format!("steps{EXE_SUFFIX}")))
}

/// Short hash, marked if the tree differs from it.
fn commit() -> Result<String> {
    let mut git = Command::new("git");
    git.args(["describe", "--always", "--dirty", "--exclude", "*"]).current_dir(root());
    Ok(output_of(&mut git)?.trim().to_owned())
}

fn compiler() -> Result<String> {
    let mut rustc = Command::new("rustc");
    Ok(output_of(rustc.arg("--version").current_dir(root()))?.trim().to_owned())
}

/// Of the system clock, in Greenwich.
fn today() -> String {
    let now = OffsetDateTime::now_utc();
    format!("{}-{:02}-{:02}", now.year(), u8::from(now.month()), now.day())
}
