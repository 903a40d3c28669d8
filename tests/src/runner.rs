//! Runs several browser cases concurrently in one browser, each with a separate server and visitors, and prints their
//! names as they finish. A failed case leaves pictures of its pages in `target/browser`.

use crate::browser::{Browser, Visitor};
use crate::scripts::FEW_FRAMES;
use crate::server::{LONG, Server, patient};
use crate::tab::{Screen, Tab};
use anyhow::{Context, Result, anyhow, bail};
use futures_util::future::BoxFuture;
use futures_util::{StreamExt, stream};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::task::JoinError;

/// Time limit for a case that hangs, generous enough for one that takes a hundred times as long as usual.
const CASE_WITHIN: Duration = Duration::from_secs(4 * LONG.as_secs());

/// Number of concurrent cases, unless `--test-threads` is given. More would only compete for processors.
const LANES: usize = 2;
/// Number of slow cases to list at the end.
const SLOWEST: usize = 5;

pub struct Case {
    /// Name of the case, which is the statement that it tests.
    name: String,
    /// Whether no other case may run at the same time.
    alone: bool,
    run: Box<dyn Fn(Arc<Stage>) -> Running>,
}

type Running = BoxFuture<'static, Result<()>>;

impl Case {
    /// Creates a case that tests the statement `name`.
    pub fn new<R>(name: impl Into<String>, run: impl Fn(Arc<Stage>) -> R + 'static) -> Case
    where
        R: Future<Output = Result<()>> + Send + 'static,
    {
        Case { name: name.into(), alone: false, run: Box::new(move |stage| Box::pin(run(stage))) }
    }

    /// Makes the case run alone, for cases that compare times.
    pub fn alone(self) -> Case {
        Case { alone: true, ..self }
    }
}

/// How a case ended.
struct Report<'a> {
    name: &'a str,
    took: Duration,
    outcome: Result<()>,
    notes: Vec<String>,
}

/// The server, the browser and the pages of one case.
pub struct Stage {
    /// The server under test.
    pub server: Server,
    browser: Arc<Browser>,
    visitors: Mutex<Vec<Visitor>>,
    tabs: Mutex<Vec<Tab>>,
    notes: Mutex<Vec<String>>,
}

impl Stage {
    async fn new(browser: Arc<Browser>) -> Result<Stage> {
        let server = Server::start(patient()).await?;
        let (visitors, tabs, notes) = Default::default();
        Ok(Stage { server, browser, visitors, tabs, notes })
    }

    /// Adds a line to the notes printed below the case's name.
    pub fn note(&self, line: impl Into<String>) {
        lock(&self.notes).push(line.into());
    }

    /// Opens a new visitor's page at a path on the server.
    pub async fn visit(&self, path: &str, screen: Screen) -> Result<Tab> {
        self.visit_link(&self.server.link(path), screen).await
    }

    /// Opens a new visitor's page at a URL.
    pub async fn visit_link(&self, link: &str, screen: Screen) -> Result<Tab> {
        let visitor = self.browser.visitor().await?;
        lock(&self.visitors).push(visitor.clone());
        let tab = self.open(&visitor, screen).await?;
        tab.go(link).await?;
        Ok(tab)
    }

    /// Opens another page of an existing visitor.
    pub async fn visit_as(&self, visitor: &Visitor, path: &str, screen: Screen) -> Result<Tab> {
        let tab = self.open(visitor, screen).await?;
        tab.go(&self.server.link(path)).await?;
        Ok(tab)
    }

    /// Opens a new visitor's page at `path`, after a script has modified the browser's environment.
    pub async fn visit_changed(&self, script: &str, path: &str) -> Result<Tab> {
        self.visit_link_changed(script, &self.server.link(path), Screen::SMALL).await
    }

    /// Opens a new visitor's page at a URL, after a script has modified the browser's environment.
    pub async fn visit_link_changed(
        &self,
        script: &str,
        link: &str,
        screen: Screen,
    ) -> Result<Tab> {
        let visitor = self.browser.visitor().await?;
        lock(&self.visitors).push(visitor.clone());
        let tab = self.open(&visitor, screen).await?;
        tab.before_load(script).await?;
        tab.go(link).await?;
        Ok(tab)
    }

    async fn open(&self, visitor: &Visitor, screen: Screen) -> Result<Tab> {
        let tab = self.browser.open(visitor, screen).await?;
        tab.before_load(FEW_FRAMES).await?;
        lock(&self.tabs).push(tab.clone());
        Ok(tab)
    }

    /// The most recent visitor.
    pub fn last_visitor(&self) -> Option<Visitor> {
        lock(&self.visitors).last().cloned()
    }

    /// Opens a new visitor's page in a room and waits for the hero to be on the screen.
    pub async fn play(&self, room: &str, screen: Screen) -> Result<Tab> {
        let tab = self.visit(&format!("/{room}"), screen).await?;
        tab.until("a hero of one's own", |state| state.plays()).await?;
        Ok(tab)
    }

    /// Fails if a page's console shows an error.
    fn check_consoles(&self) -> Result<()> {
        let errors: Vec<String> = lock(&self.tabs).iter().flat_map(Tab::errors).collect();
        if !errors.is_empty() {
            bail!("errors on the console:\n{}", errors.join("\n"));
        }
        Ok(())
    }

    /// Saves pictures of all pages, to help analyse a failure.
    async fn save_pictures(&self, name: &str) {
        let tabs = lock(&self.tabs).clone();
        for (index, tab) in tabs.iter().enumerate() {
            let path = artifacts().join(format!("{name}-{index}.png"));
            match tab.picture().await.and_then(|picture| picture.save(&path)) {
                Ok(()) => self.note(format!("see {}", path.display())),
                Err(error) => self.note(format!("no picture of page {index}: {error:#}")),
            }
        }
    }

    /// Closes a page, which would otherwise keep drawing; fails if its console shows an error.
    pub async fn close(&self, tab: Tab) -> Result<()> {
        self.check_consoles()?;
        lock(&self.tabs).retain(|open| !open.is(&tab));
        tab.close().await
    }

    /// Closes all pages; fails if any of their consoles shows an error.
    pub async fn clear(&self) -> Result<()> {
        let clean = self.check_consoles();
        lock(&self.tabs).clear();
        let visitors = std::mem::take(&mut *lock(&self.visitors));
        for visitor in visitors {
            self.browser.forget(visitor).await.context("a page did not close")?;
        }
        clean
    }
}

/// Whether `JOSTLE_LONG` requests the tests that only run before a release.
pub fn is_long() -> bool {
    std::env::var_os("JOSTLE_LONG").is_some_and(|value| value == "1")
}

/// Directory for pictures of failures.
pub fn artifacts() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().unwrap_or(tests).join("target/browser")
}

/// Command-line arguments, compatible with other test harnesses.
struct Options {
    /// Substrings of the names of the cases to run; all cases run if there are none.
    wanted: Vec<String>,
    lanes: usize,
    list: bool,
}

impl Options {
    fn read() -> Result<Options> {
        let mut options = Options { wanted: Vec::new(), lanes: LANES, list: false };
        let mut given = std::env::args().skip(1);
        while let Some(argument) = given.next() {
            match argument.as_str() {
                "--list" => options.list = true,
                "--test-threads" => {
                    let number = given.next().and_then(|number| number.parse().ok());
                    options.lanes = number.context("--test-threads takes a number from 1 on")?;
                }
                // Options of other test harnesses are ignored.
                dashed if dashed.starts_with('-') => {}
                _ => options.wanted.push(argument),
            }
        }
        Ok(options)
    }

    fn wants(&self, name: &str) -> bool {
        self.wanted.is_empty() || self.wanted.iter().any(|part| name.contains(part))
    }
}

/// Runs the cases selected by the arguments, or all cases.
pub fn main(cases: &[Case]) -> ExitCode {
    match start(cases) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            println!("browser tests: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Runs or lists the selected cases and returns how many failed.
fn start(cases: &[Case]) -> Result<usize> {
    let options = Options::read()?;
    let chosen: Vec<&Case> = cases.iter().filter(|case| options.wants(&case.name)).collect();
    if options.list {
        chosen.iter().for_each(|case| println!("{}: test", case.name));
        return Ok(0);
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    runtime.context("no runtime")?.block_on(run(chosen, options.lanes))
}

/// Runs the cases, starting those that must run alone at the end, and returns how many failed.
async fn run(cases: Vec<&Case>, lanes: usize) -> Result<usize> {
    let begin = Instant::now();
    let browser = Arc::new(Browser::launch().await?);
    println!("\nrunning {} tests in {}, {lanes} at a time", cases.len(), browser.version().await?);
    let (alone, others): (Vec<&Case>, Vec<&Case>) = cases.into_iter().partition(|case| case.alone);
    let mut reports = Vec::new();
    for (cases, lanes) in [(others, lanes), (alone, 1)] {
        let running = cases.into_iter().map(|case| run_one(case, &browser));
        let mut running = stream::iter(running).buffer_unordered(lanes.max(1));
        while let Some(report) = running.next().await {
            print(&report);
            reports.push(report);
        }
    }
    if let Some(browser) = Arc::into_inner(browser) {
        browser.close().await?;
    }
    Ok(summarize(reports, begin.elapsed()))
}

/// Prints a case's name and, if it failed, the reason.
fn print(report: &Report) {
    let Report { name, took, outcome, notes } = report;
    let verdict = if outcome.is_ok() { "ok" } else { "FAILED" };
    println!("test {name} ... {verdict} ({:.1} s)", took.as_secs_f32());
    if let Err(error) = outcome {
        println!("    {error:#}");
    }
    notes.iter().for_each(|note| println!("    {note}"));
}

/// Prints the slowest and the failed cases; returns how many failed.
fn summarize(mut reports: Vec<Report>, took: Duration) -> usize {
    reports.sort_by_key(|report| std::cmp::Reverse(report.took));
    println!("\nthe slowest:");
    for Report { name, took, .. } in reports.iter().take(SLOWEST) {
        println!("{:8.1} s  {name}", took.as_secs_f32());
    }
    let failed: Vec<&Report> = reports.iter().filter(|report| report.outcome.is_err()).collect();
    let verdict = if failed.is_empty() { "ok" } else { "FAILED" };
    println!(
        "\ntest result: {verdict}. {} passed; {} failed; finished in {:.1} s",
        reports.len() - failed.len(),
        failed.len(),
        took.as_secs_f32()
    );
    failed.iter().for_each(|report| println!("failed: {}", report.name));
    failed.len()
}

async fn run_one<'a>(case: &'a Case, browser: &Arc<Browser>) -> Report<'a> {
    let begin = Instant::now();
    let (outcome, notes) = match Stage::new(Arc::clone(browser)).await {
        Ok(stage) => play(case, Arc::new(stage)).await,
        Err(error) => (Err(error), Vec::new()),
    };
    Report { name: &case.name, took: begin.elapsed(), outcome, notes }
}

/// Runs a case on its stage and returns its result and notes.
async fn play(case: &Case, stage: Arc<Stage>) -> (Result<()>, Vec<String>) {
    let mut task = tokio::spawn((case.run)(Arc::clone(&stage)));
    let outcome = match tokio::time::timeout(CASE_WITHIN, &mut task).await {
        Ok(Ok(outcome)) => outcome.and_then(|()| stage.check_consoles()),
        Ok(Err(panic)) => Err(anyhow!(assertion(panic))),
        Err(_late) => {
            task.abort();
            bail_late()
        }
    };
    if outcome.is_err() {
        for error in lock(&stage.tabs).iter().flat_map(Tab::errors) {
            stage.note(format!("console: {error}"));
        }
        stage.save_pictures(&case.name).await;
    }
    let outcome = outcome.and(stage.clear().await);
    let notes = std::mem::take(&mut *lock(&stage.notes));
    match Arc::into_inner(stage) {
        Some(stage) => (outcome.and(stage.server.stop().await), notes),
        None => (outcome, notes),
    }
}

/// Returns the message of a failed assertion, whose location has already been printed.
fn assertion(error: JoinError) -> String {
    let Ok(panic) = error.try_into_panic() else { return "the case was cancelled".to_owned() };
    match panic.downcast::<String>() {
        Ok(text) => *text,
        Err(panic) => panic.downcast_ref().map_or("a panic", |text: &&str| text).to_owned(),
    }
}

fn bail_late() -> Result<()> {
    bail!("not finished after {} s", CASE_WITHIN.as_secs())
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
