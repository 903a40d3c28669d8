//! The Python that the clients in `docs/examples` need: found, or installed where that is possible.

use crate::apt;
use crate::shell::in_path;
use anyhow::Result;

/// Makes sure that Python can be started.
pub fn provide() -> Result<()> {
    let missing: &[&str] = if in_path("python3") { &[] } else { &["python3"] };
    apt::provide("the tests of the clients in docs/examples", missing)
}
