//! Runs browser cases one after another, each with a server and visitors of its own, and prints
//! their names. A case that fails leaves pictures of its pages in `target/browser`.

use crate::browser::{Browser, Visitor};
use crate::server::{LONG, Server, patient};
use crate::tab::{Screen, Tab};
use anyhow::{Context, Result, bail};
use futures_util::future::BoxFuture;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Ends a case that hangs. Long enough for one that takes a hundred times as long as usual.
const CASE_WITHIN: Duration = Duration::from_secs(4 * LONG.as_secs());

/// A named test.
pub struct Case {
    /// The statement that it tests.
    name: String,
    /// Starts it.
    run: Box<dyn Fn(Arc<Stage>) -> Running>,
}

/// A running case.
type Running = BoxFuture<'static, Result<()>>;

impl Case {
    /// A test of the statement `name`.
    pub fn new<R>(name: impl Into<String>, run: impl Fn(Arc<Stage>) -> R + 'static) -> Case
    where
        R: Future<Output = Result<()>> + Send + 'static,
    {
        Case { name: name.into(), run: Box::new(move |stage| Box::pin(run(stage))) }
    }
}

/// The server, the browser and the pages of one case.
pub struct Stage {
    /// The server under test.
    pub server: Server,
    browser: Arc<Browser>,
    visitors: Mutex<Vec<Visitor>>,
    tabs: Mutex<Vec<Tab>>,
}

impl Stage {
    async fn new(browser: Arc<Browser>) -> Result<Stage> {
        let server = Server::start(patient()).await?;
        Ok(Stage { server, browser, visitors: Mutex::default(), tabs: Mutex::default() })
    }

    /// Opens a new visitor's page at `path` of the server.
    pub async fn visit(&self, path: &str, screen: Screen) -> Result<Tab> {
        self.visit_link(&self.server.link(path), screen).await
    }

    /// Opens a new visitor's page at an address.
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

    /// Opens a new visitor's page at `path`, after a script has changed the browser.
    pub async fn visit_changed(&self, script: &str, path: &str) -> Result<Tab> {
        let visitor = self.browser.visitor().await?;
        lock(&self.visitors).push(visitor.clone());
        let tab = self.open(&visitor, Screen::SMALL).await?;
        tab.before_load(script).await?;
        tab.go(&self.server.link(path)).await?;
        Ok(tab)
    }

    async fn open(&self, visitor: &Visitor, screen: Screen) -> Result<Tab> {
        let tab = self.browser.open(visitor, screen).await?;
        lock(&self.tabs).push(tab.clone());
        Ok(tab)
    }

    /// The newest visitor.
    pub fn last_visitor(&self) -> Option<Visitor> {
        lock(&self.visitors).last().cloned()
    }

    /// Opens a new visitor's page in a room, with the hero on the screen.
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

    /// Saves pictures of all pages, for the analysis of a failure.
    async fn save_pictures(&self, name: &str) {
        let tabs = lock(&self.tabs).clone();
        for (index, tab) in tabs.iter().enumerate() {
            let path = artifacts().join(format!("{name}-{index}.png"));
            match tab.picture().await.and_then(|picture| picture.save(&path)) {
                Ok(()) => println!("    see {}", path.display()),
                Err(error) => println!("    no picture of page {index}: {error:#}"),
            }
        }
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

/// Directory for the pictures of failures.
pub fn artifacts() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().unwrap_or(tests).join("target/browser")
}

/// Runs the cases whose names contain one of the arguments, or all. Arguments that begin with a
/// dash are ignored; they are meant for other harnesses.
pub fn main(cases: Result<Vec<Case>>) -> ExitCode {
    let cases = match cases {
        Ok(cases) => cases,
        Err(error) => {
            println!("browser tests: {error:#}");
            return ExitCode::FAILURE;
        }
    };
    let wanted: Vec<String> =
        std::env::args().skip(1).filter(|arg| !arg.starts_with('-')).collect();
    let chosen: Vec<&Case> = cases
        .iter()
        .filter(|case| wanted.is_empty() || wanted.iter().any(|part| case.name.contains(part)))
        .collect();
    if std::env::args().any(|arg| arg == "--list") {
        chosen.iter().for_each(|case| println!("{}: test", case.name));
        return ExitCode::SUCCESS;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let outcome = runtime.context("no runtime").and_then(|runtime| runtime.block_on(run(&chosen)));
    match outcome {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            println!("browser tests: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the cases and returns how many failed.
async fn run(cases: &[&Case]) -> Result<usize> {
    let begin = Instant::now();
    let browser = Arc::new(Browser::launch().await?);
    println!("\nrunning {} tests in {}", cases.len(), browser.version().await?);
    let mut failed = Vec::new();
    for case in cases {
        let begin = Instant::now();
        let outcome = run_one(case, &browser).await;
        let took = begin.elapsed().as_secs_f32();
        match outcome {
            Ok(()) => println!("test {} ... ok ({took:.1} s)", case.name),
            Err(error) => {
                println!("test {} ... FAILED ({took:.1} s)\n    {error:#}", case.name);
                failed.push(&case.name);
            }
        }
    }
    if let Some(browser) = Arc::into_inner(browser) {
        browser.close().await?;
    }
    let verdict = if failed.is_empty() { "ok" } else { "FAILED" };
    println!(
        "\ntest result: {verdict}. {} passed; {} failed; finished in {:.1} s",
        cases.len() - failed.len(),
        failed.len(),
        begin.elapsed().as_secs_f32()
    );
    failed.iter().for_each(|name| println!("failed: {name}"));
    Ok(failed.len())
}

async fn run_one(case: &Case, browser: &Arc<Browser>) -> Result<()> {
    let stage = Arc::new(Stage::new(Arc::clone(browser)).await?);
    let mut task = tokio::spawn((case.run)(Arc::clone(&stage)));
    let outcome = match tokio::time::timeout(CASE_WITHIN, &mut task).await {
        Ok(Ok(outcome)) => outcome.and_then(|()| stage.check_consoles()),
        // An assertion failed; its message was printed above.
        Ok(Err(panic)) => Err(panic.into()),
        Err(_late) => {
            task.abort();
            bail_late()
        }
    };
    if outcome.is_err() {
        for error in lock(&stage.tabs).iter().flat_map(Tab::errors) {
            println!("    console: {error}");
        }
        stage.save_pictures(&case.name).await;
    }
    let cleared = stage.clear().await;
    let outcome = outcome.and(cleared);
    match Arc::into_inner(stage) {
        Some(stage) => outcome.and(stage.server.stop().await),
        None => outcome,
    }
}

fn bail_late() -> Result<()> {
    bail!("not finished after {} s", CASE_WITHIN.as_secs())
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
