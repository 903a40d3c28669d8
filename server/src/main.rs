//! Jostle, the host.
fn main() {}
