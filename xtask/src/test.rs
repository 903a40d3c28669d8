//! `cargo xtask test`: runs the steps of continuous integration, each named and timed.
//!
//! Three lanes run in parallel, since most steps wait for one core, for a clock or for each other: one compiles and
//! tests natively, one builds the page and drives it in a browser, and one tests servers. Each step runs in a separate
//! process, whose output is printed when it has ended. A failed step does not stop later ones, so that one run shows
//! everything that is wrong.

mod binaries;
mod changes;
mod lanes;
mod steps;

use anyhow::Result;
use changes::TreeChange;
pub use steps::TestExtent;

/// Runs the steps and prints a table; returns whether all passed. With `since`, runs only the steps that can be
/// affected by changes since that revision, in the affected crates.
pub fn test(extent: TestExtent, since: Option<&str>) -> Result<bool> {
    let change = since.map(TreeChange::since).transpose()?;
    let steps = steps::chosen(extent, change.as_ref());
    steps::say_needs(&steps);
    let how = lanes::How { packages: change.map(|change| change.packages), extent };
    Ok(lanes::run(&steps, &how))
}

/// Runs one step in this process; returns its exit status.
pub fn step(name: &str, packages: &[String]) -> i32 {
    let packages = Some(packages).filter(|packages| !packages.is_empty());
    lanes::status_of(steps::run_step(name, packages))
}
