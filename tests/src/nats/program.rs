//! Finds the program `nats-server`, or builds it with Go and keeps it in the target directory.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use tokio::process::Command;
use tokio::sync::OnceCell;

/// Environment variable with the program's path, which takes precedence.
const VARIABLE: &str = "JOSTLE_NATS_SERVER";
const NAME: &str = "nats-server";
/// The oldest usable version, as major and minor. Older ones cannot expire individual messages, which leases need.
const OLDEST: (u32, u32) = (2, 11);
/// The Go module and its version to build.
const MODULE: &str = "github.com/nats-io/nats-server/v2";
const VERSION: &str = "v2.15.2";

/// Returns the program's path. The program is located, and built if necessary, once per process.
pub async fn find() -> Result<&'static Path> {
    static FOUND: OnceCell<PathBuf> = OnceCell::const_new();
    FOUND.get_or_try_init(find_or_build).await.map(PathBuf::as_path)
}

async fn find_or_build() -> Result<PathBuf> {
    if let Some(named) = std::env::var_os(VARIABLE) {
        return Ok(named.into());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let in_path =
        |name: &str| std::env::split_paths(&path).map(|dir| dir.join(name)).find(|p| p.is_file());
    if let Some(program) = in_path(NAME)
        && version_of(&program).await? >= OLDEST
    {
        return Ok(program);
    }
    let built = target_dir().join("nats").join(format!("{NAME}-{VERSION}"));
    if !built.is_file() {
        if in_path("go").is_none() {
            let (major, minor) = OLDEST;
            bail!(
                "no {NAME} of version {major}.{minor} or newer, and no Go to build it: install Go from \
                 https://go.dev/dl, or name the program in {VARIABLE}"
            );
        }
        build(&built).await?;
    }
    Ok(built)
}

/// Returns the major and minor version from output such as `nats-server: v2.11.3`.
async fn version_of(program: &Path) -> Result<(u32, u32)> {
    let output = Command::new(program).arg("--version").output().await;
    let output = output.with_context(|| format!("cannot start {}", program.display()))?;
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    let version = || {
        let mut parts = text.rsplit_once('v')?.1.split('.').map(str::parse);
        Some((parts.next()?.ok()?, parts.next()?.ok()?))
    };
    version().with_context(|| format!("{} says of its version: {text}", program.display()))
}

/// Builds the program in a temporary directory and moves it into place, so that no process sees it half written.
async fn build(program: &Path) -> Result<()> {
    let dir = program.with_extension(std::process::id().to_string());
    let module = format!("{MODULE}@{VERSION}");
    eprintln!("building {module}, once");
    let mut go = Command::new("go");
    go.args(["install", &module]).env("GOBIN", &dir).stdin(Stdio::null());
    let status = go.status().await.context("cannot start go")?;
    if !status.success() {
        bail!(
            "`go install {module}` failed ({status}): it needs Go 1.21 or newer and the network; or \
             name the program in {VARIABLE}"
        );
    }
    std::fs::rename(dir.join(NAME), program).context("cannot keep what Go built")?;
    std::fs::remove_dir(&dir).context("Go built more than one program")
}

fn target_dir() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let usual = || tests.parent().unwrap_or(tests).join("target");
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(usual, PathBuf::from)
}
