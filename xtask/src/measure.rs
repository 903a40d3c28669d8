//! `cargo xtask report`, `load`, `latency`, `bots` and `fleet`: build a measuring program in `bench` and the programs that it
//! measures, then start it.

use crate::shell::{build_server, cargo, cargo_of_bench, output_of, root, run, say, target_dir};
use crate::{packages, web};
use anyhow::{Context, Result};
use std::env::consts::EXE_SUFFIX;
use std::path::{Path, PathBuf};
use std::process::Command;
use time::OffsetDateTime;

/// Measures error against run time, and stability, optionally with the peers; writes a page into `out`.
pub fn report(quick: bool, peers: bool, out: &Path) -> Result<()> {
    let out = std::path::absolute(out).context("where the report goes")?;
    let (package, profile) = if peers { ("peers", "peers") } else { ("report", "release") };
    say("report", &format!("build jostle-{package}, optimised"));
    let mut command = cargo_of_bench(&["run", "--quiet", "--profile", profile, "--"]);
    // The peers' directory has compiler settings for their C code.
    command.current_dir(root().join("bench").join(package));
    if quick {
        command.arg("--quick");
    }
    command.arg("--costs").arg(steps()?);
    command.arg("--out").arg(&out);
    command.args(["--commit", &commit()?, "--date", &today(), "--compiler", &compiler()?]);
    run(&mut command)
}

/// Builds the program whose instructions are counted, always with the ordinary settings, regardless of how the report
/// is built.
fn steps() -> Result<PathBuf> {
    let mut build = cargo_of_bench(&["build", "--quiet", "--release"]);
    run(build.args(["--package", "jostle-report", "--bin", "steps"]))?;
    Ok(optimised("steps"))
}

/// The short hash of the commit, with a mark if the working tree differs from it.
fn commit() -> Result<String> {
    let mut git = Command::new("git");
    git.args(["describe", "--always", "--dirty", "--exclude", "*"]).current_dir(root());
    Ok(output_of(&mut git)?.trim().to_owned())
}

fn compiler() -> Result<String> {
    let mut rustc = Command::new("rustc");
    Ok(output_of(rustc.arg("--version").current_dir(root()))?.trim().to_owned())
}

/// The current date in UTC according to the system clock.
fn today() -> String {
    let now = OffsetDateTime::now_utc();
    format!("{}-{:02}-{:02}", now.year(), u8::from(now.month()), now.day())
}

/// Measures a server under load. Takes the options of `jostle-load`. Counting allocations requires a special build of
/// the server.
pub fn load(options: &[String], allocations: bool) -> Result<()> {
    say("load", "build the server and the bots, optimised");
    build_server(&["--bin", "jostle"])?;
    run(&mut cargo_of_bench(&["build", "--release", "--package", "jostle-load"]))?;
    let mut measure = Command::new(optimised("jostle-load"));
    measure.arg("--server").arg(optimised(if allocations { "counted" } else { "jostle" }));
    measure.args(allocations.then_some("--steady")).args(options);
    run(&mut measure)
}

/// Measures the time from a key press to the frame that shows it, in a real browser. Prints a table and optionally
/// writes the figures to a file as JSON.
pub fn latency(presses: u32, json: Option<&Path>) -> Result<()> {
    packages::provide_browser()?;
    web::build(web::Profile::Small)?;
    say("latency", "build the server, which draws nothing here");
    build_server(&["--bin", "jostle"])?;
    run(&mut cargo_of_bench(&["build", "--package", "jostle-latency"]))?;
    say("latency", &format!("press a key {presses} times in each of four cases"));
    let mut measure = Command::new(target_dir().join("debug/jostle-latency"));
    measure.arg(optimised("jostle")).arg(presses.to_string()).current_dir(root());
    if let Some(json) = json {
        measure.arg(std::path::absolute(json).context("no such path")?);
    }
    run(&mut measure)
}

/// Plays matches of one person against bots, and prints tables for docs/development.md.
pub fn bots(seed: u64) -> Result<()> {
    say("bots", "build the room, optimised");
    let mut matches = cargo(&["test", "--release", "--package", "jostle-room", "--test", "room"]);
    matches.env("JOSTLE_FIRST_SEED", seed.to_string());
    run(matches.args(["matches", "--", "--nocapture"]))
}

/// Simulates the directory of fleets with thousands of nodes. Takes the options of `jostle-fleet`.
pub fn fleet(options: &[String]) -> Result<()> {
    say("fleet", "build the simulation, optimised");
    run(&mut cargo_of_bench(&["build", "--release", "--package", "jostle-fleet"]))?;
    run(Command::new(optimised("jostle-fleet")).args(options))
}

fn optimised(program: &str) -> PathBuf {
    target_dir().join("release").join(format!("{program}{EXE_SUFFIX}"))
}
