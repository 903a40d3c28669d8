//! A headless Chromium with a temporary profile.

use crate::devtools::{Session, text};
use crate::server::LONG;
use crate::tab::{Screen, Tab};
use anyhow::{Context, Result, bail};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};
use tokio::time::timeout;

/// Possible names of the program, fastest first; `JOSTLE_CHROMIUM` takes precedence.
const PROGRAMS: [&str; 5] = [
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];
const FLAGS: [&str; 23] = [
    "--headless=new",
    "--remote-debugging-port=0",
    "--no-sandbox",
    // Use Mesa's software renderer for WebGL, which gives the same result on every machine.
    "--use-angle=gl-egl",
    "--ignore-gpu-blocklist",
    // Composite pages without the GPU, which saves a fifth of the browser's time.
    "--disable-gpu-compositing",
    // Each window of the full Chromium loads two hidden pages for address bar suggestions, which take more time than a
    // simple page of the game.
    "--disable-features=WebUIOmniboxPopup,WebUIOmniboxAimPopup",
    "--force-color-profile=srgb",
    "--hide-scrollbars",
    "--lang=en_US",
    "--mute-audio",
    // Make no connections to other hosts and show no dialogs.
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-quic",
    "--no-first-run",
    "--password-store=basic",
    // Keep pages running while another one is in front.
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    // Containers have little shared memory.
    "--disable-dev-shm-usage",
];
/// Start of the line with the address that the browser listens on.
const LISTENING: &str = "DevTools listening on ";
const CLOSE_WITHIN: Duration = Duration::from_secs(10);

pub struct Browser {
    process: Child,
    session: Session,
    profile: PathBuf,
}

/// A browser context with separate cookies and storage, so that visitors share nothing.
#[derive(Clone, Debug)]
pub struct Visitor {
    context_id: String,
}

impl Browser {
    pub async fn launch() -> Result<Browser> {
        let program = find()?;
        let profile = std::env::temp_dir().join(format!("jostle-browser-{}", std::process::id()));
        std::fs::create_dir_all(&profile).context("cannot make the browser's profile")?;
        let mut command = Command::new(&program);
        command.args(FLAGS).arg(format!("--user-data-dir={}", profile.display()));
        command.arg("about:blank").stderr(Stdio::piped()).kill_on_drop(true);
        let started = command.spawn();
        let mut process = started.with_context(|| format!("cannot start {}", program.display()))?;
        let address = timeout(LONG, address_of(&mut process)).await;
        let address = address.with_context(|| format!("{} says nothing", program.display()))??;
        Ok(Browser { process, session: Session::connect(&address).await?, profile })
    }

    pub async fn version(&self) -> Result<String> {
        text(&self.session.call("Browser.getVersion", json!({})).await?, "product")
    }

    pub async fn visitor(&self) -> Result<Visitor> {
        let context = self.session.call("Target.createBrowserContext", json!({})).await?;
        Ok(Visitor { context_id: text(&context, "browserContextId")? })
    }

    /// Opens an empty page in a new window, since pages hidden behind others are not drawn.
    pub async fn open(&self, visitor: &Visitor, screen: Screen) -> Result<Tab> {
        let target = json!({
            "url": "about:blank", "browserContextId": visitor.context_id, "newWindow": true,
            "width": screen.width, "height": screen.height,
        });
        let target = text(&self.session.call("Target.createTarget", target).await?, "targetId")?;
        let (session, events) = self.session.attach(&target).await?;
        Tab::new(session, events, screen).await
    }

    /// Closes all pages of a visitor and deletes their storage.
    pub async fn forget(&self, visitor: Visitor) -> Result<()> {
        let context = json!({"browserContextId": visitor.context_id});
        self.session.call("Target.disposeBrowserContext", context).await.map(drop)
    }

    /// Closes the browser and removes its profile.
    pub async fn close(mut self) -> Result<()> {
        let closed = timeout(CLOSE_WITHIN, async {
            self.session.call("Browser.close", json!({})).await?;
            self.process.wait().await?;
            Ok::<_, anyhow::Error>(())
        });
        if !matches!(closed.await, Ok(Ok(()))) {
            self.process.kill().await?;
        }
        std::fs::remove_dir_all(&self.profile).context("cannot remove the browser's profile")
    }
}

/// Reads the address that the browser listens on from its output. The rest of the output is discarded, so that the
/// browser never blocks on it.
async fn address_of(process: &mut Child) -> Result<String> {
    let printed = process.stderr.take().context("the browser's errors are not read")?;
    let mut lines = BufReader::new(printed).lines();
    let mut before = String::new();
    while let Some(line) = lines.next_line().await? {
        if let Some(address) = line.strip_prefix(LISTENING) {
            tokio::spawn(async move { while let Ok(Some(_)) = lines.next_line().await {} });
            return Ok(address.trim().to_owned());
        }
        before = before + &line + "\n";
    }
    bail!("the browser ended:\n{before}")
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
            "no Chromium: run `apt-get install chromium-headless-shell libegl1 libegl-mesa0 \
             libgl1-mesa-dri libgles2`, or name the program in JOSTLE_CHROMIUM"
        ),
    }
}
