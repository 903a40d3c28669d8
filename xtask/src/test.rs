//! `cargo xtask test`: what continuous integration runs, step by step, each named and timed.
//!
//! A failed step does not stop the next: one run shows everything that is wrong. All steps select
//! the whole workspace and filter afterwards, since another selection of crates means other
//! features of shared dependencies, and compiling those again.

use crate::shell::{cargo, output_of, root, run, say, target_dir};
use crate::workspace::{Package, packages};
use crate::{chromium, tidy, web};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

const TESTS_CRATE: &str = "jostle-tests";
const BROWSER_TEST: &str = "browser";
/// The scenes of which debug and release builds must give the same trace, and for how many ticks.
const TRACED: [(&str, u32); 5] =
    [("impulse", 600), ("bounds", 120), ("particles", 120), ("emitters", 300), ("arena", 300)];

struct Step {
    name: &'static str,
    needs_browser: bool,
    run: fn() -> Result<()>,
}

const STEPS: [Step; 11] = [
    Step { name: "tidy", needs_browser: false, run: tidy::tidy },
    Step { name: "format", needs_browser: false, run: format },
    Step { name: "web client", needs_browser: false, run: web_client },
    Step { name: "clippy, native", needs_browser: false, run: clippy_native },
    Step { name: "clippy, wasm", needs_browser: false, run: clippy_wasm },
    Step { name: "documentation", needs_browser: false, run: documentation },
    Step { name: "unit tests", needs_browser: false, run: unit_tests },
    Step { name: "documentation tests", needs_browser: false, run: documentation_tests },
    Step { name: "socket tests", needs_browser: false, run: socket_tests },
    Step { name: "traces, debug = release", needs_browser: false, run: traces },
    Step { name: "browser tests", needs_browser: true, run: browser_tests },
];

struct Outcome {
    name: &'static str,
    error: Option<String>,
    took: Duration,
}

/// Runs the steps and prints a table; whether all of them passed.
pub fn test(quick: bool) -> bool {
    let steps: Vec<&Step> = STEPS.iter().filter(|step| !(quick && step.needs_browser)).collect();
    let mut outcomes = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        println!("\n=== {} of {}: {}", index + 1, steps.len(), step.name);
        outcomes.push(timed(step));
    }
    summarise(&outcomes, quick)
}

fn timed(step: &Step) -> Outcome {
    let begin = Instant::now();
    let error = (step.run)().err().map(|error| format!("{error:#}"));
    if let Some(error) = &error {
        println!("{}: FAILED: {error}", step.name);
    }
    Outcome { name: step.name, error, took: begin.elapsed() }
}

fn summarise(outcomes: &[Outcome], quick: bool) -> bool {
    println!("\n=== summary");
    for outcome in outcomes {
        let verdict = outcome.error.as_deref().map_or("passed".into(), |e| format!("FAILED: {e}"));
        println!("{:26}{:>8.1} s  {verdict}", outcome.name, outcome.took.as_secs_f32());
    }
    if quick {
        println!("{:26}{:>8}    left out (--quick)", "browser tests", "-");
    }
    let total: Duration = outcomes.iter().map(|outcome| outcome.took).sum();
    println!("{:26}{:>8.1} s", "all", total.as_secs_f32());
    let failed = outcomes.iter().filter(|outcome| outcome.error.is_some()).count();
    println!("{} passed, {failed} failed", outcomes.len() - failed);
    failed == 0
}

fn format() -> Result<()> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

fn web_client() -> Result<()> {
    web::build(web::Profile::Small)
}

fn clippy_native() -> Result<()> {
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "--deny", "warnings"]))
}

fn clippy_wasm() -> Result<()> {
    let mut command = cargo(&["clippy", "--lib", "--target", "wasm32-unknown-unknown"]);
    for package in ["jostle-sim", "jostle-protocol", "jostle-room", "jostle-client-web"] {
        command.args(["--package", package]);
    }
    run(command.args(["--", "--deny", "warnings"]))
}

fn documentation() -> Result<()> {
    let mut command = cargo(&["doc", "--workspace", "--no-deps", "--document-private-items"]);
    run(command.env("RUSTDOCFLAGS", "--deny warnings"))
}

/// Everything inside the crates, and what lies in their own `tests` directories.
fn unit_tests() -> Result<()> {
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast", "--lib", "--bins"]);
    for package in packages()?.iter().filter(|package| package.name != TESTS_CRATE) {
        for name in package.test_names() {
            command.args(["--test", name]);
        }
    }
    run(&mut command)
}

fn documentation_tests() -> Result<()> {
    run(&mut cargo(&["test", "--workspace", "--no-fail-fast", "--doc"]))
}

/// The workspace's tests, all but those in the browser.
fn socket_tests() -> Result<()> {
    let packages = packages()?;
    let tests = packages.iter().find(|package| package.name == TESTS_CRATE);
    let names: Vec<&str> = tests
        .into_iter()
        .flat_map(Package::test_names)
        .filter(|name| *name != BROWSER_TEST)
        .collect();
    if names.is_empty() {
        bail!("{TESTS_CRATE} has no tests besides {BROWSER_TEST}");
    }
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    for name in names {
        command.args(["--test", name]);
    }
    run(&mut command)
}

/// One scene, one seed: one trace, however the program was built and however often it runs.
fn traces() -> Result<()> {
    run(&mut cargo(&["build", "--workspace", "--bin", "jostle"]))?;
    run(&mut cargo(&["build", "--release", "--package", "jostle-server", "--bin", "jostle"]))?;
    let dir = target_dir().join("traces");
    fs::create_dir_all(&dir).with_context(|| format!("cannot make {}", dir.display()))?;
    for (scene, ticks) in TRACED {
        let first = trace("debug", scene, ticks, &dir.join(format!("{scene}-debug.jsonl")))?;
        let again = trace("debug", scene, ticks, &dir.join(format!("{scene}-again.jsonl")))?;
        let release = trace("release", scene, ticks, &dir.join(format!("{scene}-release.jsonl")))?;
        compare(scene, "two debug runs", &first, &again)?;
        compare(scene, "debug and release", &first, &release)?;
        say("traces", &format!("{scene}: {ticks} ticks, the same three times"));
    }
    Ok(())
}

fn trace(build: &str, scene: &str, ticks: u32, file: &Path) -> Result<String> {
    let mut command = Command::new(target_dir().join(build).join("jostle"));
    command.args(["run", scene, "--ticks", &ticks.to_string(), "--seed", "7", "--trace"]).arg(file);
    output_of(command.current_dir(root()))?;
    let text = fs::read_to_string(file).with_context(|| format!("no trace {}", file.display()))?;
    if text.lines().count() < ticks as usize {
        bail!("{scene}: {} lines for {ticks} ticks in {}", text.lines().count(), file.display());
    }
    Ok(text)
}

fn compare(scene: &str, what: &str, left: &str, right: &str) -> Result<()> {
    let differing = left.lines().zip(right.lines()).find(|(left, right)| left != right);
    if let Some((left, right)) = differing {
        bail!("{scene}: {what} differ:\n  {left}\n  {right}");
    }
    if left.len() != right.len() {
        bail!("{scene}: {what} differ in length: {} and {} bytes", left.len(), right.len());
    }
    Ok(())
}

fn browser_tests() -> Result<()> {
    chromium::provide()?;
    run(&mut cargo(&["test", "--workspace", "--test", BROWSER_TEST]))
}
