//! The replay format. A game is stored as its scene, its seed and its players' inputs, with a state hash for every tick
//! to verify it, and with keyframes for seeking. `docs/replay.md` is the reference.
//!
//! A file consists of a header and records, each with its length and a checksum. Files are append-only, so a file that
//! has lost its tail is a shorter replay.

mod block;
mod pack;
mod players;
mod read;
mod reader;
mod record;

pub use block::{Block, Change, FULL_HASH_TICKS, Tick, keeps_full_hash};
pub use players::PlayerCount;
pub use read::{Ending, Problem, Replay, ReplayError, START_BYTES_MAX, Sizes};
pub use reader::ReplayReader;
pub use record::{END_BYTES_MAX, FORMAT, Keyframe, MAGIC, Record, Start, frame, header};

#[cfg(test)]
mod tests;
