//! `cargo xtask test`: what continuous integration runs, step by step, each named and timed.
//!
//! A failed step does not stop the next: one run shows everything that is wrong. All steps select
//! the whole workspace and filter afterwards, since another selection of crates means other
//! features of shared dependencies, and compiling those again.

use crate::shell::{Skipped, cargo, cargo_of_bench, run};
use crate::workspace::{Package, packages};
use crate::{chromium, goldens, nats, python, tidy, traces, web};
use anyhow::{Result, bail};
use std::collections::BTreeMap;
use std::process::Command;
use std::time::Instant;

const TESTS_CRATE: &str = "jostle-tests";
const BROWSER_TEST: &str = "browser";
const FLEET_TEST: &str = "fleet";
/// They wait most of the time, so that more of them fit than there are processors.
const SOCKET_TEST_THREADS: &str = "4";
/// Each has up to three NATS servers of its own.
const FLEET_TEST_THREADS: &str = "2";
/// Read by the drawing tests: without an adapter they fail instead of being skipped.
const NEEDS_GPU: &str = "JOSTLE_NEEDS_GPU";

struct Step {
    name: &'static str,
    when: When,
    run: fn() -> Result<()>,
}

/// In which runs a step takes part.
#[derive(Clone, Copy, PartialEq)]
enum When {
    Always,
    /// Only with `--quick`.
    Quick,
    /// Only without.
    Full,
}

/// The browser comes early: it brings the libraries with which the unit tests draw.
const STEPS: [Step; 18] = [
    Step { name: "tidy", when: When::Always, run: tidy::tidy },
    Step { name: "format", when: When::Always, run: format },
    Step { name: "browser, found or installed", when: When::Full, run: chromium::provide },
    Step { name: "web client", when: When::Always, run: web_client },
    Step { name: "clippy, native", when: When::Always, run: clippy_native },
    Step { name: "clippy, wasm", when: When::Always, run: clippy_wasm },
    Step { name: "documentation", when: When::Always, run: documentation },
    Step { name: "unit tests", when: When::Full, run: unit_tests_that_draw },
    Step { name: "unit tests, drawing optional", when: When::Quick, run: unit_tests },
    Step { name: "documentation tests", when: When::Always, run: documentation_tests },
    Step { name: "socket tests", when: When::Always, run: socket_tests },
    Step { name: "fleet tests", when: When::Always, run: fleet_tests },
    Step { name: "traces, each played twice", when: When::Always, run: traces::check },
    Step { name: "golden replays", when: When::Always, run: goldens::check },
    Step { name: "golden replays, 64-bit Arm", when: When::Full, run: goldens::check_aarch64 },
    Step { name: "browser tests", when: When::Full, run: browser_tests },
    Step { name: "clippy, bench", when: When::Always, run: clippy_bench },
    Step { name: "unit tests, bench", when: When::Always, run: bench_tests },
];

/// Runs the steps and prints a table; whether all of them passed.
pub fn test(quick: bool) -> bool {
    let left_out = if quick { When::Full } else { When::Quick };
    let steps: Vec<&Step> = STEPS.iter().filter(|step| step.when != left_out).collect();
    let (mut lines, mut counts) = (Vec::new(), BTreeMap::new());
    let began = Instant::now();
    for (index, step) in steps.iter().enumerate() {
        println!("\n=== {} of {}: {}", index + 1, steps.len(), step.name);
        let begin = Instant::now();
        let (verdict, text) = match (step.run)() {
            Ok(()) => ("passed", "passed".to_owned()),
            Err(error) if error.is::<Skipped>() => ("skipped", format!("SKIPPED: {error:#}")),
            Err(error) => {
                println!("{}: FAILED: {error:#}", step.name);
                ("failed", format!("FAILED: {error:#}"))
            }
        };
        *counts.entry(verdict).or_default() += 1;
        lines.push(format!("{:30}{:>8.1} s  {text}", step.name, begin.elapsed().as_secs_f32()));
    }
    println!("\n=== summary\n{}", lines.join("\n"));
    if quick {
        println!("{:30}{:>8}    left out (--quick)", "browser tests", "-");
    }
    println!("{:30}{:>8.1} s", "all", began.elapsed().as_secs_f32());
    let [passed, skipped, failed]: [u32; 3] =
        ["passed", "skipped", "failed"].map(|verdict| counts.get(verdict).copied().unwrap_or(0));
    println!("{passed} passed, {skipped} skipped, {failed} failed");
    failed == 0
}

fn format() -> Result<()> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

fn web_client() -> Result<()> {
    web::build_static(web::Profile::Small)
}

fn clippy_native() -> Result<()> {
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "--deny", "warnings"]))
}

/// With the page's profile, so that the programs that take part in its build are compiled once.
fn clippy_wasm() -> Result<()> {
    let mut command = web::cargo_for_page("clippy", web::Profile::Small);
    for package in
        ["jostle-sim", "jostle-game", "jostle-protocol", "jostle-room", "jostle-client-web"]
    {
        command.args(["--package", package]);
    }
    run(command.args(["--", "--deny", "warnings"]))
}

fn documentation() -> Result<()> {
    let mut command = cargo(&["doc", "--workspace", "--no-deps"]);
    // The map at the top of a module may name what is private in it.
    let flags = "--deny warnings --allow rustdoc::private-intra-doc-links";
    run(command.env("RUSTDOCFLAGS", flags))
}

/// Everything inside the crates, and what lies in their own `tests` directories.
fn unit_tests() -> Result<()> {
    run(&mut unit_test_command()?)
}

fn unit_tests_that_draw() -> Result<()> {
    run(unit_test_command()?.env(NEEDS_GPU, "1"))
}

fn unit_test_command() -> Result<Command> {
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast", "--lib", "--bins"]);
    for package in packages()?.iter().filter(|package| package.name != TESTS_CRATE) {
        for name in package.test_names() {
            command.args(["--test", name]);
        }
    }
    Ok(command)
}

fn documentation_tests() -> Result<()> {
    run(&mut cargo(&["test", "--workspace", "--no-fail-fast", "--doc"]))
}

/// The workspace's tests, all but those in the browser and those of fleets.
fn socket_tests() -> Result<()> {
    python::provide()?;
    let packages = packages()?;
    let tests = packages.iter().find(|package| package.name == TESTS_CRATE);
    let names: Vec<&str> = tests
        .into_iter()
        .flat_map(Package::test_names)
        .filter(|name| ![BROWSER_TEST, FLEET_TEST].contains(name))
        .collect();
    if names.is_empty() {
        bail!("{TESTS_CRATE} has no tests besides {BROWSER_TEST} and {FLEET_TEST}");
    }
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    for name in names {
        command.args(["--test", name]);
    }
    run(command.args(["--", "--test-threads", SOCKET_TEST_THREADS]))
}

/// With NATS servers.
fn fleet_tests() -> Result<()> {
    nats::provide()?;
    let test = ["test", "--workspace", "--no-fail-fast", "--test", FLEET_TEST];
    run(cargo(&test).args(["--", "--test-threads", FLEET_TEST_THREADS]))
}

fn clippy_bench() -> Result<()> {
    run(&mut cargo_of_bench(&["clippy", "--all-targets", "--", "--deny", "warnings"]))
}

/// The bench workspace without the peers; its tests include the sizes of recorded traffic.
fn bench_tests() -> Result<()> {
    run(&mut cargo_of_bench(&["fmt", "--check"]))?;
    run(&mut cargo_of_bench(&["test", "--no-fail-fast"]))
}

fn browser_tests() -> Result<()> {
    run(&mut cargo(&["test", "--workspace", "--test", BROWSER_TEST]))
}
