//! `cargo xtask test`: what continuous integration runs, step by step, each named and timed.
//!
//! Three lanes run side by side, since most steps wait for one core, for a clock or for each other: one compiles and
//! tests natively, one builds the page and drives it in a browser, one tests servers. Each step runs in
//! a separate process, whose output is printed when it has ended. A failed step does not stop the next: one run shows everything that is wrong.

mod binaries;
mod changes;
mod lanes;
mod steps;

use anyhow::Result;
use changes::TreeChange;
pub use steps::TestExtent;

/// Runs the steps and prints a table; whether all of them passed. With `since`, only those that a change since that
/// revision can affect, in the crates that it can affect.
pub fn test(extent: TestExtent, since: Option<&str>) -> Result<bool> {
    let change = since.map(TreeChange::since).transpose()?;
    let steps = steps::chosen(extent, change.as_ref());
    steps::say_needs(&steps);
    let how = lanes::How { packages: change.map(|change| change.packages), extent };
    Ok(lanes::run(&steps, &how))
}

/// Runs one step in this process; its exit status.
pub fn step(name: &str, packages: &[String]) -> i32 {
    let packages = Some(packages).filter(|packages| !packages.is_empty());
    lanes::status_of(steps::run_step(name, packages))
}
