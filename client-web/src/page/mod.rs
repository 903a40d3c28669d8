//! The page: [`app::App`] is its state and [`event`] its vocabulary, both plain Rust; `dom` draws the
//! state into the document, and `shell` moves events and effects between the two. Only the
//! latter exist on wasm alone.

pub mod app;
pub mod context;
pub mod dialogs;
#[cfg(target_arch = "wasm32")]
mod dom;
pub mod event;
pub mod game;
#[cfg(target_arch = "wasm32")]
mod hooks;
mod keyboard;
pub mod layers;
pub mod lobby;
pub mod name;
pub mod news_log;
pub mod plot;
mod pointing;
#[cfg(target_arch = "wasm32")]
mod queue;
pub mod replay_screen;
mod replays;
#[cfg(target_arch = "wasm32")]
mod shell;
pub mod shown;
pub mod strings;
pub mod tools;
