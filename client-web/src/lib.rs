//! The web client: a thin client of a room, and the offline demo.
//!
//! What can be decided without a page (time, snapshots, camera, input, words, what is drawn) is
//! plain Rust with tests; `page` holds everything that touches the browser and exists on wasm only.

pub mod api;
pub mod camera;
pub mod clock;
pub mod demo;
pub mod draw;
pub mod film;
pub mod fingers;
pub mod frame;
pub mod input;
pub mod lag;
pub mod layers;
pub mod meter;
pub mod name;
pub mod overlap;
pub mod palette;
pub mod plot;
pub mod predict;
pub mod quality;
pub mod reconnect;
pub mod render;
pub mod replica;
pub mod stick;
pub mod timeline;
pub mod witness;
pub mod words;

#[cfg(target_arch = "wasm32")]
mod page;
