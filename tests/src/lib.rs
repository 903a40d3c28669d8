//! What the workspace's tests share: a server in this process, a real browser, a page driven by
//! real keys and pointers, pictures that can be compared, and replays with changed bytes.
//!
//! The tests themselves are in `tests/`: one file or directory a subject.

pub mod browser;
pub mod picture;
pub mod runner;
pub mod scenes;
pub mod server;
pub mod state;
pub mod streams;
pub mod tab;
