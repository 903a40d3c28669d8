//! Sound without recordings. The copy of the room reports [`cue::Cue`]s, the [`mixer::Mixer`] decides which of
//! them become voices, and the player makes these of tones and noise, as [`patch`] says. Mixer and patches are
//! plain data and functions of events and time; only the player needs a browser.

pub mod cue;
pub mod mixer;
pub mod patch;
#[cfg(target_arch = "wasm32")]
pub mod player;
pub mod task;
pub mod witness;
