//! The web client: a thin client for rooms on a server, a replay player, and rooms that run inside the page.
//!
//! Everything that does not need a browser (time, snapshots, camera, input, texts, and every change to the page's
//! state) is plain Rust with tests. Only the modules that call browser APIs are limited to wasm. Other programs use the
//! drawing, the replays and the in-page rooms.

#[cfg(target_arch = "wasm32")]
mod browser;
pub mod editor;
#[cfg(any(target_arch = "wasm32", test))]
mod input;
pub mod language;
pub mod net;
#[cfg(any(target_arch = "wasm32", test))]
#[cfg_attr(not(target_arch = "wasm32"), expect(dead_code, reason = "the browser uses the rest"))]
mod page;
pub mod replay;
pub mod sound;
pub mod view;
pub mod world;
