//! `cargo xtask load`: builds the server and what measures it under load, and starts the latter.

use crate::shell::{build_server, cargo_of_bench, run, say, target_dir};
use anyhow::Result;
use std::env::consts::EXE_SUFFIX;
use std::process::Command;

/// Measures, with options of `jostle-load`; allocations are counted by a server that is built for that.
pub fn load(options: &[String], allocations: bool) -> Result<()> {
    say("load", "build the server and the bots, optimised");
    build_server(&["--bin", "jostle"])?;
    run(&mut cargo_of_bench(&["build", "--release", "--package", "jostle-load"]))?;
    let built = |name: &str| target_dir().join("release").join(format!("{name}{EXE_SUFFIX}"));
    let mut measure = Command::new(built("jostle-load"));
    measure.arg("--server").arg(built(if allocations { "counted" } else { "jostle" }));
    measure.args(allocations.then_some("--steady")).args(options);
    run(&mut measure)
}
