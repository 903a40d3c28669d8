//! Fires any number of random shots: `--count 1000000 --seed 1`.

use clap::Parser;
use jostle_report::trials::{Arguments, conclude, run, shots};
use std::process::ExitCode;

fn main() -> ExitCode {
    let tallies = run("shots", &Arguments::parse(), shots::trial);
    if conclude(&tallies) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
