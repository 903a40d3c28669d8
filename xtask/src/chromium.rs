//! The browser that the browser tests need: found, or installed where that is possible.

use crate::shell::{in_path, output_of, run, say};
use anyhow::{Result, bail};
use std::process::{Command, Stdio};

/// Names under which the browser may be started; `JOSTLE_CHROMIUM` outranks them.
const PROGRAMS: [&str; 4] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
/// Debian's names; the libraries draw WebGL without a graphics card.
const PACKAGES: [&str; 5] = ["chromium", "libegl1", "libegl-mesa0", "libgl1-mesa-dri", "libgles2"];

/// Makes sure that the browser can be started.
pub fn provide() -> Result<()> {
    let missing = missing_packages();
    if missing.is_empty() {
        return Ok(());
    }
    let install = format!("apt-get install --no-install-recommends {}", missing.join(" "));
    if !in_path("apt-get") {
        bail!(
            "the browser tests need Chromium, and Mesa's EGL and OpenGL ES 2 libraries; install \
             them, or name the program in JOSTLE_CHROMIUM"
        );
    }
    if !is_root()? {
        bail!("the browser tests need packages that are not installed; run: sudo {install}");
    }
    say("chromium", &install);
    run(apt().arg("update"))?;
    run(apt().args(["install", "--yes", "--no-install-recommends"]).args(&missing))
}

fn apt() -> Command {
    let mut command = Command::new("apt-get");
    command.arg("--quiet").env("DEBIAN_FRONTEND", "noninteractive");
    command
}

/// Where Debian's packages are unknown, the browser alone is looked for.
fn missing_packages() -> Vec<&'static str> {
    let browser =
        std::env::var_os("JOSTLE_CHROMIUM").is_some() || PROGRAMS.into_iter().any(in_path);
    let lacks = |package: &str| match package {
        "chromium" => !browser,
        library => in_path("dpkg-query") && !installed(library),
    };
    PACKAGES.into_iter().filter(|package| lacks(package)).collect()
}

fn installed(package: &str) -> bool {
    let query = Command::new("dpkg-query")
        .args(["--show", "--showformat=${db:Status-Status}", package])
        .stderr(Stdio::null())
        .output();
    query.is_ok_and(|output| output.stdout == b"installed")
}

fn is_root() -> Result<bool> {
    Ok(output_of(Command::new("id").arg("-u"))?.trim() == "0")
}
