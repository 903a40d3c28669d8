//! The report with the peers in it; `cargo xtask report --peers` starts it.

use clap::Parser;
use jostle_report::{Arguments, run};

fn main() -> anyhow::Result<()> {
    run(&Arguments::parse(), &jostle_peers::PEERS)
}
