//! The report with the peers included; `cargo xtask report --peers` starts it. With `--search` it compares Jostle with
//! Box2D in random scenes instead.

use anyhow::{Context, Result};
use clap::Parser;
use jostle_peers::PEERS;
use jostle_report::methods::{METHODS, SOLVERS};
use jostle_report::motion::search::{Finding, csv, search, summary};
use jostle_report::{Arguments, run};
use std::fs;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    report: Arguments,
    /// Play this many random scenes in Jostle and Box2D instead of writing the report, and list the slowest
    #[arg(long, value_name = "COUNT")]
    search: Option<u64>,
    /// Seed of the random scenes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of the first random scene
    #[arg(long, default_value_t = 0)]
    from: u64,
}

fn main() -> Result<()> {
    let command = Command::parse();
    match command.search {
        Some(count) => search_all(&command, count),
        None => run(&command.report, &PEERS),
    }
}

fn search_all(command: &Command, count: u64) -> Result<()> {
    let ours = METHODS.iter().find(|method| method.name == SOLVERS[1]).context("no solver")?;
    let numbers = command.from..command.from.saturating_add(count);
    let watch = |finding: &Finding| {
        if finding.number.is_multiple_of(50) {
            eprintln!("scene {}: {:.2}", finding.number, finding.worst_ratio());
        }
    };
    let findings = search(command.seed, numbers, [ours, &PEERS[0]], watch)
        .map_err(|why| anyhow::anyhow!("a scene cannot be built: {why}"))?;
    let out = &command.report.out;
    fs::create_dir_all(out).with_context(|| format!("cannot create {}", out.display()))?;
    let path = out.join("search.csv");
    fs::write(&path, csv(&findings)).with_context(|| format!("cannot write {}", path.display()))?;
    print!("{}", summary(&findings));
    Ok(())
}
