//! A headless Chromium with a profile of its own, which is removed afterwards.

use crate::tab::{Screen, Tab};
use anyhow::{Context, Result, anyhow, bail};
use chromiumoxide::browser::{Browser as Process, BrowserConfig};
use chromiumoxide::cdp::browser_protocol::browser::BrowserContextId;
use chromiumoxide::cdp::browser_protocol::target::{
    CreateBrowserContextParams, CreateTargetParams,
};
use futures_util::StreamExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::task::JoinHandle;

/// Names of the program; `JOSTLE_CHROMIUM` takes precedence.
const PROGRAMS: [&str; 4] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
/// WebGL by Mesa's software renderer, the same on every machine, and no connections to other hosts.
const FLAGS: [&str; 7] = [
    "use-angle=gl-egl",
    "ignore-gpu-blocklist",
    "disable-background-networking",
    "no-first-run",
    "disable-component-update",
    "disable-sync",
    "disable-quic",
];
const LAUNCH_WITHIN: Duration = Duration::from_secs(60);
const CLOSE_WITHIN: Duration = Duration::from_secs(10);

/// A running browser.
pub struct Browser {
    process: Process,
    events: JoinHandle<()>,
    profile: PathBuf,
}

/// Cookies and storage of one person; the pages of two visitors share nothing.
#[derive(Clone, Debug)]
pub struct Visitor(BrowserContextId);

impl Browser {
    /// Starts the browser.
    pub async fn launch() -> Result<Browser> {
        let program = find()?;
        let profile = std::env::temp_dir().join(format!("jostle-browser-{}", std::process::id()));
        std::fs::create_dir_all(&profile).context("cannot make the browser's profile")?;
        let config = BrowserConfig::builder()
            .chrome_executable(&program)
            .user_data_dir(&profile)
            .new_headless_mode()
            .no_sandbox()
            .viewport(None)
            .launch_timeout(LAUNCH_WITHIN)
            .args(FLAGS)
            .build()
            .map_err(|error| anyhow!(error))?;
        let launched = Process::launch(config).await;
        let (process, mut handler) =
            launched.with_context(|| format!("cannot start {}", program.display()))?;
        let events = tokio::spawn(async move { while handler.next().await.is_some() {} });
        Ok(Browser { process, events, profile })
    }

    /// Name and version.
    pub async fn version(&self) -> Result<String> {
        Ok(self.process.version().await?.product)
    }

    /// A new visitor.
    pub async fn visitor(&self) -> Result<Visitor> {
        let context = CreateBrowserContextParams::default();
        Ok(Visitor(self.process.create_browser_context(context).await?))
    }

    /// Opens an empty page in a window of its own: pages hidden behind others are not drawn.
    pub async fn open(&self, visitor: &Visitor, screen: Screen) -> Result<Tab> {
        let target = CreateTargetParams::builder()
            .url("about:blank")
            .browser_context_id(visitor.0.clone())
            .new_window(true)
            .width(i64::from(screen.width))
            .height(i64::from(screen.height))
            .build()
            .map_err(|error| anyhow!(error))?;
        Tab::new(self.process.new_page(target).await?, screen).await
    }

    /// Closes all pages of a visitor and deletes their storage.
    pub async fn forget(&self, visitor: Visitor) -> Result<()> {
        self.process.dispose_browser_context(visitor.0).await?;
        Ok(())
    }

    /// Closes the browser and removes its profile.
    pub async fn close(mut self) -> Result<()> {
        let closed = tokio::time::timeout(CLOSE_WITHIN, async {
            self.process.close().await?;
            self.process.wait().await?;
            Ok::<_, anyhow::Error>(())
        });
        if !matches!(closed.await, Ok(Ok(()))) {
            self.process.kill().await;
        }
        self.events.abort();
        std::fs::remove_dir_all(&self.profile).context("cannot remove the browser's profile")
    }
}

fn find() -> Result<PathBuf> {
    if let Some(named) = std::env::var_os("JOSTLE_CHROMIUM") {
        return Ok(named.into());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let dirs: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let candidates = PROGRAMS.iter().flat_map(|name| dirs.iter().map(move |dir| dir.join(name)));
    match candidates.into_iter().find(|candidate| Path::is_file(candidate)) {
        Some(program) => Ok(program),
        None => bail!(
            "no Chromium: run `apt-get install chromium libegl1 libegl-mesa0 libgl1-mesa-dri \
             libgles2`, or name the program in JOSTLE_CHROMIUM"
        ),
    }
}
