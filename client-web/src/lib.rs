//! The web client: a thin client of a room, replays, and rooms inside the page.
//!
//! Everything that needs no browser (time, snapshots, camera, input, texts, and every change of the
//! page's state) is plain Rust with tests; only the modules that touch the browser are for wasm alone.
//! Other programs use what draws, replays and rooms in the page.

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
