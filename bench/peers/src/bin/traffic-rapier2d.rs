//! Measures the cost of a client in each scene of `traffic`, played by rapier2d.
//!
//! Usage, in this directory: `cargo run --release --bin traffic-rapier2d -- help`

use clap::Parser;
use jostle_peers::traffic::RapierCrowd;
use jostle_report::traffic::program::{Arguments, run};

fn main() -> anyhow::Result<()> {
    run(&Arguments::parse(), "rapier2d", |script| Box::new(RapierCrowd::new(script)))
}
