//! Measures the cost of a client in each scene of `traffic`, played by Jostle's conjugate solver.
//!
//! Usage, in `bench`: `cargo run --release --bin traffic -- help`

use clap::Parser;
use jostle_report::traffic::measure::JostleCrowd;
use jostle_report::traffic::program::{Arguments, run};

fn main() -> anyhow::Result<()> {
    run(&Arguments::parse(), "jostle", |script| Box::new(JostleCrowd::new(script)))
}
