//! `cargo xtask fleet`: the directory of a fleet with thousands of simulated nodes.

use crate::shell::{cargo_of_bench, run, say, target_dir};
use anyhow::Result;
use std::env::consts::EXE_SUFFIX;
use std::process::Command;

/// Builds the simulation, and runs it with options of `jostle-fleet`.
pub fn fleet(options: &[String]) -> Result<()> {
    say("fleet", "build the simulation, optimised");
    run(&mut cargo_of_bench(&["build", "--release", "--package", "jostle-fleet"]))?;
    let program = target_dir().join("release").join(format!("jostle-fleet{EXE_SUFFIX}"));
    run(Command::new(program).args(options))
}
