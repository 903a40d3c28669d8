//! `cargo xtask pictures`: the screenshot of the README, from a game that is really played.

use crate::shell::{cargo, run, say};
use crate::{chromium, web};
use anyhow::Result;

/// Builds the page, plays in a real browser, writes `docs/screenshot.png`.
pub fn take() -> Result<()> {
    chromium::provide()?;
    web::build(web::Profile::Small)?;
    say("pictures", "play the arena with three players");
    run(&mut cargo(&["run", "--package", "jostle-tests", "--example", "screenshot"]))
}
