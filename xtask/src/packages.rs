//! Programs that the tests need besides Rust. Missing ones are installed as Debian packages if possible; otherwise the
//! command to install them is shown.

use crate::shell::{in_path, output_of, run, say, target_dir};
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::process::{Command, Stdio};

/// Chromium without a user interface, which is a sixth faster than the full program.
const SHELL: &str = "chromium-headless-shell";
/// Names that the browser may be installed under; `JOSTLE_CHROMIUM` takes precedence.
const BROWSERS: [&str; 5] =
    [SHELL, "chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
/// Debian packages for the browser tests; the libraries provide WebGL without a graphics card.
const BROWSER_PACKAGES: [&str; 5] =
    [SHELL, "libegl1", "libegl-mesa0", "libgl1-mesa-dri", "libgles2"];

/// Makes sure that the browser is available.
pub fn provide_browser() -> Result<()> {
    let browser =
        std::env::var_os("JOSTLE_CHROMIUM").is_some() || BROWSERS.into_iter().any(in_path);
    let lacks = |package: &&str| match *package {
        SHELL => !browser,
        library => !has(library),
    };
    let missing: Vec<&str> = BROWSER_PACKAGES.into_iter().filter(lacks).collect();
    provide("the browser tests (Chromium, Mesa's EGL and OpenGL ES 2)", &missing)
}

/// Makes sure that the tests can start NATS servers, or build them with Go.
pub fn provide_nats() -> Result<()> {
    let named = std::env::var_os("JOSTLE_NATS_SERVER").is_some();
    let found = named || in_path("nats-server") || in_path("go");
    let missing: &[&str] = if found { &[] } else { &["golang-go"] };
    provide("the fleet tests (nats-server, or Go 1.21 or newer to build it)", missing)
}

/// Makes sure that Python is available.
pub fn provide_python() -> Result<()> {
    let missing: &[&str] = if in_path("python3") { &[] } else { &["python3"] };
    provide("the tests of the clients in docs/examples", missing)
}

/// Installs packages. `what` describes what needs them, in case the user has to install them.
pub fn provide(what: &str, packages: &[&str]) -> Result<()> {
    if packages.is_empty() {
        return Ok(());
    }
    let install = format!("apt-get install --no-install-recommends {}", packages.join(" "));
    if !in_path("apt-get") {
        bail!("{what} need Debian's packages {}, or what they hold", packages.join(" "));
    }
    if !is_root()? {
        bail!("{what} need packages that are not installed; run: sudo {install}");
    }
    // Several concurrent test steps may need packages; without this lock, the second one would find apt's lists locked.
    let lock = File::create(target_dir().join("apt.lock")).context("target/apt.lock")?;
    lock.lock().context("target/apt.lock")?;
    say("packages", &install);
    run(apt().arg("update"))?;
    run(apt().args(["install", "--yes", "--no-install-recommends"]).args(packages))
}

/// Whether a package is installed; always true on systems without Debian packages.
pub fn has(package: &str) -> bool {
    if !in_path("dpkg-query") {
        return true;
    }
    let query = Command::new("dpkg-query")
        .args(["--show", "--showformat=${db:Status-Status}", package])
        .stderr(Stdio::null())
        .output();
    query.is_ok_and(|output| output.stdout == b"installed")
}

fn apt() -> Command {
    let mut command = Command::new("apt-get");
    command.arg("--quiet").env("DEBIAN_FRONTEND", "noninteractive");
    command
}

fn is_root() -> Result<bool> {
    Ok(output_of(Command::new("id").arg("-u"))?.trim() == "0")
}
