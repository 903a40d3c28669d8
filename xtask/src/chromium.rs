//! The browser that the browser tests need: found, or installed where that is possible.

use crate::apt;
use crate::shell::in_path;
use anyhow::Result;

/// Chromium without the windows around its pages, which needs a sixth less time than all of Chromium.
const SHELL: &str = "chromium-headless-shell";
/// Names under which the browser may be started; `JOSTLE_CHROMIUM` outranks them.
const PROGRAMS: [&str; 5] =
    [SHELL, "chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
/// Debian's names; the libraries draw WebGL without a graphics card.
const PACKAGES: [&str; 5] = [SHELL, "libegl1", "libegl-mesa0", "libgl1-mesa-dri", "libgles2"];

/// Makes sure that the browser can be started.
pub fn provide() -> Result<()> {
    let browser =
        std::env::var_os("JOSTLE_CHROMIUM").is_some() || PROGRAMS.into_iter().any(in_path);
    let lacks = |package: &&str| match *package {
        SHELL => !browser,
        library => !apt::has(library),
    };
    let missing: Vec<&str> = PACKAGES.into_iter().filter(lacks).collect();
    apt::provide("the browser tests (Chromium, Mesa's EGL and OpenGL ES 2)", &missing)
}
