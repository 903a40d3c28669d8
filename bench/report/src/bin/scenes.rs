//! Plays any number of random scenes with extreme values: `--count 100000 --seed 1`.

use clap::Parser;
use jostle_report::trials::{Arguments, conclude, run, scenes};
use std::process::ExitCode;

fn main() -> ExitCode {
    let tallies = run("scenes", &Arguments::parse(), scenes::trial);
    if conclude(&tallies) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
