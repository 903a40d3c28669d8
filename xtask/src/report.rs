//! `cargo xtask report`: error against run time, and stability, measured on this machine.

use crate::shell::{cargo, output_of, root, run, say};
use anyhow::{Context, Result};
use std::env::consts::EXE_SUFFIX;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// Measures, with the peers if wanted, and writes the page into `out`.
pub fn report(quick: bool, peers: bool, out: &Path) -> Result<()> {
    let out = std::path::absolute(out).context("where the report goes")?;
    let mut command = if peers {
        say("report", "build Jostle and its peers, optimised");
        let mut command = cargo(&["run", "--quiet", "--release", "--"]);
        command.current_dir(root().join("tests/peers"));
        command
    } else {
        say("report", "build Jostle, optimised");
        cargo(&["run", "--quiet", "--release", "--package", "jostle-report", "--"])
    };
    if quick {
        command.arg("--quick");
    }
    command.arg("--costs").arg(costs()?);
    command.arg("--out").arg(&out);
    command.args(["--commit", &commit()?, "--date", &today()?, "--compiler", &compiler()?]);
    run(&mut command)
}

/// What `sim/examples/steps.rs` is built without, beside the shipped build.
const LEFT_OUT: [&str; 10] = [
    "friction",
    "restitution",
    "circles",
    "boxes",
    "particles",
    "forces",
    "sleeping",
    "kinematic",
    "continuous",
    "touches",
];

/// Builds of the program that is counted, in a directory of their own: each build without a
/// feature would have everything else in the ordinary one compiled anew.
fn costs() -> Result<PathBuf> {
    let (target, programs) = (root().join("target/costs"), root().join("target/costs/programs"));
    fs::create_dir_all(&programs).context("a directory for the programs to be counted")?;
    say("report", "build what is counted, with and without each feature");
    let build = |package: &str, example: &str, left_out: Option<&str>, name: &str| -> Result<()> {
        let mut build = cargo(&["build", "--quiet", "--release", "--package", package]);
        build.args(["--example", example, "--target-dir"]).arg(&target);
        match left_out {
            Some(left_out) => build.env("JOSTLE_LEAVE_OUT", left_out),
            None => build.env_remove("JOSTLE_LEAVE_OUT"),
        };
        run(&mut build)?;
        let built = target.join("release/examples").join(format!("{example}{EXE_SUFFIX}"));
        fs::copy(&built, programs.join(name)).context("the program to be counted")?;
        Ok(())
    };
    for name in LEFT_OUT {
        build("jostle-sim", "steps", Some(name), name)?;
    }
    build("jostle-sim", "steps", None, "shipped")?;
    build("jostle-room", "bytes", None, "bytes")?;
    Ok(programs)
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
