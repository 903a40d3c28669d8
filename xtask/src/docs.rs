//! `cargo xtask docs`: writes the tables of fields in `docs/scenes.md`, the schema of scene files, the classes for
//! Tiled and the words of the editor's form. A test in `game` generates them, since only tests have access to the
//! sentences; it fails when the files are out of date.

use crate::shell::{cargo, run};
use anyhow::Result;

/// Writes all of these files.
pub fn docs() -> Result<()> {
    let test = "what_is_written_from_the_fields_is_up_to_date";
    let args = ["test", "--quiet", "--package", "jostle-game", "--lib", "--", test];
    run(cargo(&args).env("JOSTLE_WRITE_DOCS", "1"))
}
