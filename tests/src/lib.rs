//! Code shared by the workspace's tests: a server in this process, a real browser, pages driven by real keys and
//! pointers, comparable pictures, mutated replays, and real NATS servers.
//!
//! The tests themselves are in `tests/`, one file or directory per subject.

pub mod browser;
pub mod devtools;
pub mod files;
pub mod guest_scenes;
pub mod http_proxy;
pub mod nats;
pub mod picture;
pub mod program;
pub mod runner;
pub mod runs;
pub mod scenes;
pub mod scripts;
pub mod server;
pub mod state;
pub mod tab;
mod tab_events;
