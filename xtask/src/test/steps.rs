//! The table of all steps, and their implementations.

use super::binaries::{self, Binary};
use super::changes::TreeChange;
use crate::shell::{cargo, cargo_of_bench, run};
use crate::workspace::USUAL_CRATES;
use crate::{goldens, hashes, packages, tidy, web};
use anyhow::{Result, bail};
use std::thread;

const BROWSER_TEST: &str = "browser";
const SOCKET_TEST: &str = "sockets";
/// Path of the fleet tests, which are part of the socket test program.
const FLEET_TESTS: &str = "fleet::";
/// Number of threads for the socket tests; more than there are processors, because these tests mostly wait.
const SOCKET_TEST_THREADS: &str = "6";
/// Number of threads for the socket tests with `--since`, when little else runs at the same time.
const CUT_SOCKET_TEST_THREADS: &str = "16";
/// Path of the soak tests, which take a minute to run.
const SOAK_TESTS: &str = "soak::";
/// Number of threads for the fleet tests, each of which starts up to three NATS servers.
const FLEET_TEST_THREADS: &str = "2";

const COMPILE: &str = "tests, compiled";
const HASHES: &str = "golden hashes";
const BROWSER: &str = "browser, found or installed";
const WEB: &str = "web client";

/// How much to test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TestExtent {
    /// Steps that need neither a browser nor drawing.
    Quick,
    /// The steps of continuous integration.
    Usual,
    /// The steps for a release, which also cover other builds of the simulation, native drawing and the measuring
    /// programs.
    All,
}

/// A lane, whose steps run one after another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestLane {
    /// Native compilation and tests.
    Native,
    /// The page, from compilation to tests in the browser.
    Page,
    /// Tests of servers, which mostly wait for clocks and each other, and of replays.
    Servers,
}

pub const LANES: [TestLane; 3] = [TestLane::Native, TestLane::Page, TestLane::Servers];

/// A part of the test run, executed in a separate process.
pub struct TestStep {
    pub name: &'static str,
    pub lane: TestLane,
    /// Names of steps that have to pass first.
    pub needs: &'static [&'static str],
    /// The smallest extent that includes the step.
    from: TestExtent,
    /// Whether the step runs at a lower priority, because the other lanes wait for servers and pages, which respond
    /// late on a busy machine.
    pub yields: bool,
    /// External programs that the step needs, to be shown to the user.
    programs: &'static str,
    /// Whether a change makes the step necessary.
    concerns: fn(&TreeChange) -> bool,
    /// Runs the step, restricted to the given crates if possible.
    run: fn(Option<&[String]>) -> Result<()>,
}

const STEP: TestStep = TestStep {
    name: "",
    lane: TestLane::Native,
    needs: &[],
    yields: false,
    from: TestExtent::Quick,
    programs: "",
    concerns: |_| true,
    run: |_| Ok(()),
};

/// Crates that determine how a game plays out.
const SIMULATION: [&str; 4] = ["jostle-sim", "jostle-game", "jostle-protocol", "jostle-room"];
const PAGE_PATHS: [&str; 7] = [
    "client-web/",
    "shaders/",
    "assets/",
    "xtask/web/",
    "tests/goldens/",
    "tests/src/",
    "tests/tests/browser/",
];
const FLEET_PATHS: [&str; 3] = ["server/src/fleet/", "tests/tests/fleet/", "tests/src/"];

/// All steps, in the order of each lane. The slowest come first unless dependencies prevent it.
pub const STEPS: [TestStep; 19] = [
    TestStep { name: "tidy", lane: TestLane::Servers, run: |_| tidy::tidy(), ..STEP },
    TestStep { name: "format", lane: TestLane::Servers, run: |_| format(), ..STEP },
    TestStep { name: COMPILE, run: |_| binaries::compile(), concerns: compiles, ..STEP },
    TestStep {
        name: "unit tests",
        needs: &[COMPILE],
        yields: true,
        run: unit_tests,
        concerns: compiles,
        ..STEP
    },
    TestStep {
        name: "clippy, native",
        needs: &[COMPILE],
        run: |_| binaries::check_warnings(),
        concerns: compiles,
        ..STEP
    },
    TestStep {
        name: "documentation",
        yields: true,
        run: |_| documentation(),
        concerns: is_whole,
        ..STEP
    },
    TestStep {
        name: "documentation tests",
        yields: true,
        run: |_| doc_tests(),
        concerns: is_whole,
        ..STEP
    },
    TestStep {
        name: "clippy, wasm",
        // Both steps lock the page's target directory.
        needs: &[WEB],
        concerns: |change| change.affects(&["jostle-client-web"]),
        run: |_| clippy_wasm(),
        ..STEP
    },
    TestStep {
        name: BROWSER,
        lane: TestLane::Page,
        from: TestExtent::Usual,
        concerns: is_of_page,
        run: |_| packages::provide_browser(),
        ..STEP
    },
    TestStep {
        name: WEB,
        lane: TestLane::Page,
        concerns: is_of_page,
        run: |_| web::build_static(web::Profile::Small),
        ..STEP
    },
    TestStep {
        name: "fleet tests",
        lane: TestLane::Servers,
        needs: &[COMPILE],
        programs: "nats-server, or Go to build it",
        concerns: |change| change.touches(&FLEET_PATHS),
        run: |_| fleet_tests(),
        ..STEP
    },
    TestStep {
        name: "socket tests",
        lane: TestLane::Servers,
        needs: &[COMPILE, WEB],
        programs: "Python 3",
        concerns: |change| change.affects(&["jostle-server", "jostle-tests"]),
        run: socket_tests,
        ..STEP
    },
    TestStep {
        name: HASHES,
        lane: TestLane::Servers,
        needs: &[COMPILE],
        concerns: plays,
        run: |_| hashes::check(),
        ..STEP
    },
    TestStep {
        name: "golden replays",
        lane: TestLane::Servers,
        needs: &[COMPILE, HASHES],
        run: |_| goldens::check(),
        concerns: plays,
        ..STEP
    },
    TestStep {
        name: "browser tests",
        lane: TestLane::Page,
        needs: &[COMPILE, BROWSER, WEB],
        from: TestExtent::Usual,
        programs: "Chromium and Mesa, and what fleet tests need",
        concerns: is_of_page,
        run: |_| browser_tests(),
        ..STEP
    },
    TestStep {
        name: "drawing and packing tests",
        from: TestExtent::All,
        programs: "Mesa's drivers",
        concerns: |change| change.touches(&["picture/"]),
        run: |_| drawing_tests(),
        ..STEP
    },
    TestStep {
        name: "golden replays, other builds",
        from: TestExtent::All,
        needs: &[HASHES],
        concerns: is_whole,
        run: |_| goldens::check_builds(),
        ..STEP
    },
    TestStep {
        name: "golden replays, 64-bit Arm",
        from: TestExtent::All,
        needs: &[HASHES],
        concerns: is_whole,
        programs: "an emulator of 64-bit Arm (qemu-aarch64)",
        run: |_| goldens::check_aarch64(),
        ..STEP
    },
    TestStep {
        name: "bench, clippy and tests",
        from: TestExtent::All,
        concerns: is_whole,
        run: |_| bench_tests(),
        ..STEP
    },
];

/// The steps of the given extent that a change makes necessary, or all of them if there is no change.
pub fn chosen(extent: TestExtent, change: Option<&TreeChange>) -> Vec<&'static TestStep> {
    let asked = |step: &&TestStep| change.is_none_or(|change| (step.concerns)(change));
    STEPS.iter().filter(|step| step.from <= extent).filter(asked).collect()
}

/// Lists the external programs that the steps need, before the first step runs.
pub fn say_needs(steps: &[&TestStep]) {
    for step in steps.iter().filter(|step| !step.programs.is_empty()) {
        println!("{} need {}; as root they are installed", step.name, step.programs);
    }
}

/// Runs a step in this process.
pub fn run_step(name: &str, packages: Option<&[String]>) -> Result<()> {
    match STEPS.iter().find(|step| step.name == name) {
        Some(step) => (step.run)(packages),
        None => {
            let names: Vec<&str> = STEPS.iter().map(|step| step.name).collect();
            bail!("no step {name:?}; allowed: {}", names.join("; "))
        }
    }
}

fn is_whole(_: &TreeChange) -> bool {
    false
}

fn compiles(change: &TreeChange) -> bool {
    !change.packages.is_empty()
}

fn plays(change: &TreeChange) -> bool {
    change.affects(&SIMULATION) || change.touches(&["tests/"])
}

/// Whether a change affects the page. Compiling the page takes minutes, so with `--since` only changes to its own files
/// count.
fn is_of_page(change: &TreeChange) -> bool {
    change.touches(&PAGE_PATHS)
}

fn format() -> Result<()> {
    run(&mut cargo(&["fmt", "--all", "--check"]))?;
    run(&mut cargo_of_bench(&["fmt", "--check"]))
}

/// Runs clippy on the page, with its profile, so that build-time dependencies are compiled only once.
fn clippy_wasm() -> Result<()> {
    let mut command = web::cargo_for_page("clippy", web::Profile::Small);
    for package in SIMULATION.iter().chain(&["jostle-client-web"]) {
        command.args(["--package", package]);
    }
    run(command.args(["--", "--deny", "warnings"]))
}

fn documentation() -> Result<()> {
    let mut command = cargo(&["doc", "--no-deps"]);
    // Module overviews may link to private items.
    let flags = "--deny warnings --allow rustdoc::private-intra-doc-links";
    run(command.args(USUAL_CRATES).env("RUSTDOCFLAGS", flags))
}

fn doc_tests() -> Result<()> {
    run(cargo(&["test", "--no-fail-fast", "--doc"]).args(USUAL_CRATES))
}

/// Runs the tests inside the crates and in their `tests` directories.
fn unit_tests(packages: Option<&[String]>) -> Result<()> {
    let all = binaries::all()?;
    let is_one = |binary: &&Binary| {
        let is_step = [BROWSER_TEST, SOCKET_TEST].contains(&binary.name.as_str());
        !is_step && packages.is_none_or(|packages| packages.contains(&binary.package))
    };
    let chosen: Vec<&Binary> = all.iter().filter(is_one).collect();
    // Some crates, such as the one with the socket tests, have no unit tests.
    if chosen.is_empty() && packages.is_some() {
        return Ok(());
    }
    // Two programs run concurrently, so this avoids having more threads than processors.
    let threads = thread::available_parallelism().map_or(1, |all| all.get() / 2).max(1);
    binaries::run_all(&chosen, &["--test-threads", &threads.to_string()])
}

fn integration(name: &str, args: &[&str]) -> Result<()> {
    let all = binaries::all()?;
    let is_it = |binary: &&Binary| binary.is_integration && binary.name == name;
    binaries::run_all(&all.iter().filter(is_it).collect::<Vec<_>>(), args)
}

/// Runs all socket tests or, with `--since`, all except the soak tests.
fn socket_tests(packages: Option<&[String]>) -> Result<()> {
    packages::provide_python()?;
    let mut args = vec!["--skip", FLEET_TESTS, "--test-threads"];
    match packages {
        Some(_) => args.extend([CUT_SOCKET_TEST_THREADS, "--skip", SOAK_TESTS]),
        None => args.push(SOCKET_TEST_THREADS),
    }
    integration(SOCKET_TEST, &args)
}

fn fleet_tests() -> Result<()> {
    packages::provide_nats()?;
    integration(SOCKET_TEST, &[FLEET_TESTS, "--test-threads", FLEET_TEST_THREADS])
}

/// Runs the browser tests. One of them follows a room to another server in a fleet and therefore needs NATS.
fn browser_tests() -> Result<()> {
    packages::provide_nats()?;
    integration(BROWSER_TEST, &[])
}

/// Tests native drawing, the program that draws replays with it, and the page builder.
fn drawing_tests() -> Result<()> {
    packages::provide_browser()?;
    let selection = ["--package", "jostle-picture", "--package", "jostle-cli"];
    let features = ["--features", "jostle-cli/render", "--all-targets"];
    run(cargo(&["clippy"]).args(selection).args(features).args(["--", "--deny", "warnings"]))?;
    run(&mut cargo(&["test", "--package", "jostle-picture"]))?;
    run(&mut web::maker("test"))?;
    run(web::maker("clippy").args(["--all-targets", "--", "--deny", "warnings"]))
}

/// Tests the bench workspace without the peers, including the sizes of recorded traffic.
fn bench_tests() -> Result<()> {
    run(&mut cargo_of_bench(&["clippy", "--all-targets", "--", "--deny", "warnings"]))?;
    run(&mut cargo_of_bench(&["test", "--no-fail-fast"]))
}

#[cfg(test)]
mod tests {
    use super::{STEPS, TestExtent, chosen};
    use crate::test::changes::TreeChange;

    fn names(extent: TestExtent, paths: &[&str], packages: &[&str]) -> Vec<&'static str> {
        let own = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect();
        let change = TreeChange { paths: own(paths), packages: own(packages) };
        chosen(extent, Some(&change)).iter().map(|step| step.name).collect()
    }

    #[test]
    fn what_a_step_needs_is_a_step_of_another_lane_or_an_earlier_one() {
        for (at, step) in STEPS.iter().enumerate() {
            for need in step.needs {
                let found = STEPS.iter().position(|other| other.name == *need);
                let found = found.unwrap_or_else(|| panic!("{}: no {need}", step.name));
                assert!(STEPS[found].lane != step.lane || found < at, "{}: {need}", step.name);
            }
        }
    }

    #[test]
    fn a_change_runs_what_it_can_break() {
        let documents = names(TestExtent::Usual, &["docs/hosting.md"], &[]);
        assert_eq!(documents, ["tidy", "format"]);
        let room = ["jostle-room", "jostle-server", "jostle-tests"];
        let room = names(TestExtent::Usual, &["room/src/room.rs"], &room);
        assert!(room.contains(&"socket tests") && room.contains(&"golden replays"), "{room:?}");
        assert!(!room.contains(&"browser tests"), "{room:?}");
        let page = names(TestExtent::Usual, &["client-web/src/lib.rs"], &["jostle-client-web"]);
        assert!(page.contains(&"browser tests"), "{page:?}");
        assert!(
            !names(TestExtent::Quick, &["client-web/src/lib.rs"], &["jostle-client-web"])
                .contains(&"browser tests")
        );
    }
}
