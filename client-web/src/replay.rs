//! Watching a replay, which is simulated again, checked against its recorded hashes, and drawn like a live game.

pub mod chapters;
pub mod checks;
mod display;
pub mod error;
pub mod player;
mod seek;
