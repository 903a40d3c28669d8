//! Runs random trials by the million. Each is determined by (seed, number) alone, so any trial can be replayed on its
//! own, and a stopped run can be continued.

pub mod scenes;
pub mod shots;

use clap::Parser;
use std::collections::BTreeMap;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Maximum number of failures that are printed; the rest are only counted.
const PRINTED_MAX: u64 = 50;
/// Interval between progress lines.
const PROGRESS: Duration = Duration::from_secs(5);

/// Which trials to run.
#[derive(Clone, Debug, Parser)]
pub struct Arguments {
    /// Seed of the sequence of trials
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Number of the first trial; to resume an interrupted run, pass the last number shown
    #[arg(long, default_value_t = 0)]
    pub from: u64,
    /// Number of trials
    #[arg(long, default_value_t = 10_000)]
    pub count: u64,
}

/// Result of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The kind of trial.
    pub kind: &'static str,
    /// The failure with its figures, if any.
    pub failure: Option<Failure>,
    /// How far a body was pressed into a wall beyond the allowed depth, in half-sizes; 0 if none was.
    pub pressed: f64,
}

/// How a trial failed.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// The type of failure, for the table.
    pub sort: &'static str,
    /// Details of the failure.
    pub detail: String,
}

/// Number of trials and failures of one kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Number of trials.
    pub trials: u64,
    /// Number of failures of each sort.
    pub failures: BTreeMap<&'static str, u64>,
    /// Number of trials in which a body was pressed into a wall, which does not count as a failure.
    pub pressed: u64,
    /// The deepest such penetration, in half-sizes.
    pub deepest: f64,
}

/// One tally per kind of trial.
pub type Tallies = BTreeMap<&'static str, Tally>;

/// Runs trials one after another, prints progress, and prints every failure with the command that replays it. Returns
/// the tallies by kind.
pub fn run(name: &str, arguments: &Arguments, trial: fn(u64, u64) -> Verdict) -> Tallies {
    let Arguments { seed, from, count } = *arguments;
    let mut tallies = Tallies::new();
    let (began, mut shown, mut failed) = (Instant::now(), Instant::now(), 0);
    for number in from..from.saturating_add(count) {
        let verdict = trial(seed, number);
        let tally = tallies.entry(verdict.kind).or_default();
        tally.trials += 1;
        tally.pressed += u64::from(verdict.pressed > 0.0);
        tally.deepest = tally.deepest.max(verdict.pressed);
        if let Some(Failure { sort, detail }) = verdict.failure {
            *tally.failures.entry(sort).or_default() += 1;
            failed += 1;
            if failed <= PRINTED_MAX {
                let again = format!("--seed {seed} --from {number} --count 1");
                println!("{}: {sort}: {detail}; again: {name} {again}", verdict.kind);
            }
        }
        if shown.elapsed() >= PROGRESS {
            shown = Instant::now();
            let done = number + 1 - from;
            show(&format!(
                "{name}: {done} of {count}, {failed} failed, {} s; go on with --from {}",
                began.elapsed().as_secs(),
                number + 1
            ));
        }
    }
    tallies
}

/// Prints a progress line. Errors are ignored: a run need not stop because its progress cannot be shown.
fn show(line: &str) {
    let mut out = std::io::stderr().lock();
    let _ =
        if out.is_terminal() { write!(out, "\r\x1b[2K{line}") } else { writeln!(out, "{line}") };
    let _ = out.flush();
}

/// Prints the table and returns whether there were no failures.
pub fn conclude(tallies: &Tallies) -> bool {
    let mut good = true;
    for (kind, tally) in tallies {
        let failures: Vec<String> =
            tally.failures.iter().map(|(sort, count)| format!("{count} {sort}")).collect();
        good &= failures.is_empty();
        let failures = if failures.is_empty() { "none failed".into() } else { failures.join(", ") };
        let pressed = match tally.pressed {
            0 => String::new(),
            some => format!(
                "; pressed into a wall in {some}, at most by {:.3} half-sizes",
                tally.deepest
            ),
        };
        println!("{kind}: {} tried, {failures}{pressed}", tally.trials);
    }
    good
}
