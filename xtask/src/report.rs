//! `cargo xtask report`: error against run time, and stability, measured on this machine.

use crate::shell::{cargo_of_bench, output_of, root, run, say, target_dir};
use anyhow::{Context, Result};
use std::env::consts::EXE_SUFFIX;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

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
    command.args(["--commit", &commit()?, "--date", &today()?, "--compiler", &compiler()?]);
    run(&mut command)
}

const PACKAGE: &str = "jostle-report";

/// The program whose instructions are counted; the ordinary build, whatever the report is built with.
fn steps() -> Result<PathBuf> {
    run(&mut cargo_of_bench(&[
        "build",
        "--quiet",
        "--release",
        "--package",
        PACKAGE,
        "--bin",
        "steps",
    ]))?;
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
fn today() -> Result<String> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).context("the clock is before 1970")?;
    let (year, month, day) = date_of(since.as_secs() / 86_400);
    Ok(format!("{year}-{month:02}-{day:02}"))
}

/// Year, month and day of a count of days since 1970-01-01.
fn date_of(mut days: u64) -> (u64, usize, u64) {
    let mut year = 1970;
    let leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    while days >= 365 + u64::from(leap(year)) {
        days -= 365 + u64::from(leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= lengths[month] {
        days -= lengths[month];
        month += 1;
    }
    (year, month + 1, days + 1)
}

#[cfg(test)]
mod tests {
    use super::date_of;

    #[test]
    fn days_become_dates() {
        assert_eq!(date_of(0), (1970, 1, 1));
        assert_eq!(date_of(59), (1970, 3, 1));
        assert_eq!(date_of(11_016), (2000, 2, 29));
        assert_eq!(date_of(19_722), (2023, 12, 31));
    }
}
