//! The report without peers; `cargo xtask report` starts it.

use clap::Parser;
use jostle_report::{Arguments, run};

fn main() -> anyhow::Result<()> {
    run(&Arguments::parse(), &[])
}
