//! `cargo xtask pictures`: takes the README's screenshot from a real game.

use crate::shell::{cargo, root, run, say, target_dir};
use crate::{packages, web};
use anyhow::Result;
use std::process::Command;

/// Builds the page, plays in a real browser, and writes `docs/screenshot.png`.
pub fn take() -> Result<()> {
    packages::provide_browser()?;
    web::build(web::Profile::Small)?;
    say("pictures", "play the arena with three players");
    run(&mut cargo(&["build", "--workspace", "--example", "screenshot"]))?;
    run(Command::new(target_dir().join("debug/examples/screenshot")).current_dir(root()))
}
