//! NATS servers for the fleet tests. The tests find the program, or build it with Go: found, or installed where that is
//! possible.

use crate::apt;
use crate::shell::in_path;
use anyhow::Result;

/// Makes sure that the tests can start NATS servers, or build them.
pub fn provide() -> Result<()> {
    let named = std::env::var_os("JOSTLE_NATS_SERVER").is_some();
    let found = named || in_path("nats-server") || in_path("go");
    let missing: &[&str] = if found { &[] } else { &["golang-go"] };
    apt::provide("the fleet tests (nats-server, or Go 1.21 or newer to build it)", missing)
}
