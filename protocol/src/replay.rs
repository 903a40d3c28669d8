//! The replay format: a game as its scene, its seed and what its players did, with a hash of every
//! tick to check it by and keyframes to seek with. `docs/replay.md` is its reference.
//!
//! A file is a header and records, each with its length and a checksum. It is only ever appended
//! to, so what is left of a file that lost its tail is a shorter replay.

mod block;
mod read;
mod record;

pub use block::{Block, Change, Tick};
pub use read::{Ending, Problem, Replay, ReplayError, START_BYTES_MAX, Sizes};
pub use record::{Keyframe, Record, Start, frame, header};

/// First bytes of every replay.
pub const MAGIC: [u8; 8] = *b"jostle\x1a\n";
/// Version of the format.
pub const FORMAT: u16 = 1;
/// All 64 bits of the hash are kept for ticks that are a multiple of this, 16 bits for the others.
pub const FULL_HASH_TICKS: u32 = 60;

/// Whether all 64 bits of the hash of this tick are kept.
pub fn keeps_full_hash(tick: u32) -> bool {
    tick.is_multiple_of(FULL_HASH_TICKS)
}

#[cfg(test)]
mod tests;
