//! `cargo xtask latency`: from a key press to the frame that shows it, in a real browser.

use crate::shell::{build_server, cargo_of_bench, root, run, say, target_dir};
use crate::{chromium, web};
use anyhow::{Context, Result};
use std::path::Path;
use std::process::Command;

/// Builds page, server and measurement, presses keys, prints a table; the same goes to a file as JSON.
pub fn latency(presses: u32, json: Option<&Path>) -> Result<()> {
    chromium::provide()?;
    web::build(web::Profile::Small)?;
    say("latency", "build the server, which draws nothing here");
    build_server(&["--bin", "jostle"])?;
    run(&mut cargo_of_bench(&["build", "--package", "jostle-latency"]))?;
    say("latency", &format!("press a key {presses} times in each of four cases"));
    let server = target_dir().join(format!("release/jostle{}", std::env::consts::EXE_SUFFIX));
    let mut measure = Command::new(target_dir().join("debug/jostle-latency"));
    measure.arg(server).arg(presses.to_string()).current_dir(root());
    if let Some(json) = json {
        measure.arg(std::path::absolute(json).context("no such path")?);
    }
    run(&mut measure)
}
