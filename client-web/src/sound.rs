//! Sound without recordings. The room's replica reports [`cue::Cue`]s, the [`mixer::Mixer`] decides which of them
//! become voices, and the player synthesises these from tones and noise as defined in [`patch`]. The mixer and the
//! patches are plain data and functions of events and time; only the player needs a browser.

pub mod cue;
pub mod mixer;
pub mod patch;
#[cfg(target_arch = "wasm32")]
pub mod player;
pub mod task;
pub mod witness;
