//! Runs steps in lanes. The steps of a lane run in order; a step waits for the steps in other lanes that it needs.

use super::steps::{LANES, TestExtent, TestStep};
use crate::shell::{Skipped, in_path, target_dir};
use anyhow::{Context, Result};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Condvar, Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

/// Exit status of a step that cannot run on this machine, following automake.
const SKIPPED_STATUS: i32 = 77;

/// The command that starts a program at a lower priority.
const NICE: &str = "nice";
/// Less than the niceness of guest room threads, since niceness can only be raised, and well below the maximum of 19,
/// because otherwise the test that raises it would see no change.
const NICENESS: &str = "9";

/// Environment variable read by tests that do more before a release.
const LONG: &str = "JOSTLE_LONG";

/// Options for all steps.
pub struct How {
    /// The crates that steps are restricted to where possible.
    pub packages: Option<Vec<String>>,
    pub extent: TestExtent,
}

/// How a step ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StepOutcome {
    Passed,
    Skipped(String),
    Failed(String),
}

/// A step that has ended.
pub struct Ended {
    name: &'static str,
    took: Duration,
    outcome: StepOutcome,
}

/// State shared by the lanes.
struct Board {
    ended: Mutex<Vec<Ended>>,
    changed: Condvar,
}

/// Runs all steps and prints their output and a table. Returns whether none failed.
pub fn run(steps: &[&TestStep], how: &How) -> bool {
    let began = Instant::now();
    let board = Board { ended: Mutex::new(Vec::new()), changed: Condvar::new() };
    thread::scope(|scope| {
        for lane in LANES {
            let board = &board;
            scope.spawn(move || {
                for step in steps.iter().filter(|step| step.lane == lane) {
                    run_step(step, steps, board, how);
                }
            });
        }
    });
    let ended = board.ended.into_inner().expect("no lane panicked");
    println!("\n=== summary");
    for step in &ended {
        let text = match &step.outcome {
            StepOutcome::Passed => "passed".to_owned(),
            StepOutcome::Skipped(reason) => format!("SKIPPED: {reason}"),
            StepOutcome::Failed(reason) => format!("FAILED: {reason}"),
        };
        println!("{:32}{:>8.1} s  {text}", step.name, step.took.as_secs_f32());
    }
    println!("{:32}{:>8.1} s", "all, in three lanes", began.elapsed().as_secs_f32());
    println!("{}", counts(&ended));
    !ended.iter().any(|step| matches!(step.outcome, StepOutcome::Failed(_)))
}

fn counts(ended: &[Ended]) -> String {
    let count =
        |is: fn(&StepOutcome) -> bool| ended.iter().filter(|step| is(&step.outcome)).count();
    let passed = count(|outcome| *outcome == StepOutcome::Passed);
    let skipped = count(|outcome| matches!(outcome, StepOutcome::Skipped(_)));
    let failed = count(|outcome| matches!(outcome, StepOutcome::Failed(_)));
    format!("{passed} passed, {failed} failed, {skipped} skipped")
}

fn run_step(step: &TestStep, steps: &[&TestStep], board: &Board, how: &How) {
    let needed = |name: &&str| steps.iter().any(|step| step.name == *name);
    let needs: Vec<&str> = step.needs.iter().copied().filter(needed).collect();
    let unmet = board.wait_for(&needs);
    let begin = Instant::now();
    let outcome = match unmet {
        Some(name) => StepOutcome::Failed(format!("{name:?}, which it needs, did not pass")),
        None => {
            println!("--- {} begins", step.name);
            process(step, how).unwrap_or_else(|error| StepOutcome::Failed(format!("{error:#}")))
        }
    };
    let ended = Ended { name: step.name, took: begin.elapsed(), outcome };
    board.ended.lock().expect("no lane panicked").push(ended);
    board.changed.notify_all();
}

impl Board {
    /// Waits until all of the named steps have ended; returns one that did not pass, if any.
    fn wait_for<'a>(&self, names: &[&'a str]) -> Option<&'a str> {
        let mut ended = self.ended.lock().expect("no lane panicked");
        let open =
            |ended: &[Ended]| names.iter().any(|name| !ended.iter().any(|step| step.name == *name));
        while open(&ended) {
            ended = self.changed.wait(ended).expect("no lane panicked");
        }
        let passed = |name: &&&str| {
            ended.iter().any(|step| step.name == **name && step.outcome == StepOutcome::Passed)
        };
        names.iter().find(|name| !passed(name)).copied()
    }
}

/// Runs a step as a process and prints its output once it has ended.
fn process(step: &TestStep, how: &How) -> Result<StepOutcome> {
    let dir = target_dir().join("test");
    fs::create_dir_all(&dir).with_context(|| format!("cannot make {}", dir.display()))?;
    let path = dir.join(format!("{}.log", step.name.replace([' ', ','], "-")));
    let log = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    let own = own_program()?;
    let mut command = Command::new(own);
    if step.yields && in_path(NICE) {
        command = Command::new(NICE);
        command.args(["-n", NICENESS]).arg(own);
    }
    command.args(["test-step", step.name]);
    if let Some(packages) = &how.packages {
        command.args(["--packages", &packages.join(",")]);
    }
    if how.extent == TestExtent::All {
        command.env(LONG, "1");
    }
    let begin = Instant::now();
    let status = command.stdout(log.try_clone()?).stderr(log).status()?;
    let text = String::from_utf8_lossy(&fs::read(&path)?).into_owned();
    println!("\n=== {}, {:.1} s\n{}", step.name, begin.elapsed().as_secs_f32(), text.trim_end());
    let last = text.lines().last().unwrap_or_default().to_owned();
    Ok(match status.code() {
        Some(0) => StepOutcome::Passed,
        Some(SKIPPED_STATUS) => StepOutcome::Skipped(last),
        _ => StepOutcome::Failed(last),
    })
}

/// A copy of this program, since cargo may replace the original in the meantime.
fn own_program() -> Result<&'static Path> {
    static COPY: OnceLock<Option<PathBuf>> = OnceLock::new();
    let copy = || {
        let copy = target_dir().join("test/xtask");
        fs::copy(std::env::current_exe().ok()?, &copy).ok()?;
        Some(copy)
    };
    COPY.get_or_init(copy).as_deref().context("cannot copy xtask into target/test")
}

/// Returns the exit status that a step's process reports its result with. Prints the reason if it is not 0.
pub fn status_of(result: Result<()>) -> i32 {
    let Err(error) = result else { return 0 };
    println!("{error:#}");
    if error.is::<Skipped>() { SKIPPED_STATUS } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::{Board, Ended, StepOutcome, counts};
    use std::sync::{Condvar, Mutex};
    use std::time::Duration;

    fn ended(name: &'static str, outcome: StepOutcome) -> Ended {
        Ended { name, took: Duration::ZERO, outcome }
    }

    #[test]
    fn the_closing_line_counts_outcomes() {
        let steps = [
            ended("a", StepOutcome::Passed),
            ended("b", StepOutcome::Skipped("no Arm".into())),
            ended("c", StepOutcome::Failed("?".into())),
            ended("d", StepOutcome::Passed),
        ];
        assert_eq!(counts(&steps), "2 passed, 1 failed, 1 skipped");
    }

    #[test]
    fn a_step_waits_for_what_it_needs_and_reports_what_is_unmet() {
        let board = Board { ended: Mutex::new(Vec::new()), changed: Condvar::new() };
        let push = |name, outcome| {
            board.ended.lock().expect("not poisoned").push(ended(name, outcome));
            board.changed.notify_all();
        };
        let (unmet, met) = std::thread::scope(|scope| {
            let unmet = scope.spawn(|| board.wait_for(&["page", "compile"]));
            let met = scope.spawn(|| board.wait_for(&["compile"]));
            push("compile", StepOutcome::Passed);
            push("page", StepOutcome::Failed("too large".into()));
            (unmet.join().expect("it ends"), met.join().expect("it ends"))
        });
        assert_eq!((unmet, met), (Some("page"), None));
    }
}
