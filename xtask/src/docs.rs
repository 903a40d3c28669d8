//! What is written from the code: the tables of fields in `docs/scenes.md`, the schema of scene files and the classes for Tiled.
//! A test of `game` makes them, since only tests know the sentences; it fails when they are out of date.

use crate::shell::{cargo, run};
use anyhow::Result;

/// Writes them.
pub fn docs() -> Result<()> {
    let test = "what_is_written_from_the_fields_is_up_to_date";
    let args = ["test", "--quiet", "--package", "jostle-game", "--lib", "--", test];
    run(cargo(&args).env("JOSTLE_WRITE_DOCS", "1"))
}
