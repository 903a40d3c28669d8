//! The sections of a coded snapshot. Each has a bit in the first byte.

use crate::error::DecodeError;
use crate::snapshot::{SNAPSHOT, Snapshot};
use crate::wire::Reader;

/// Indices of the bodies that died.
pub const DEATHS: u8 = 1 << 0;
/// Moves of bodies and pointers.
pub const MOVES: u8 = 1 << 1;
pub const BIRTHS: u8 = 1 << 2;
/// Changes to players, except their input numbers.
pub const PLAYERS: u8 = 1 << 3;
/// Flags for the input numbers that grew by the number of ticks since the baseline.
pub const INPUTS: u8 = 1 << 4;
/// Live particles in a keyframe, which has no input flags.
pub const PARTICLES: u8 = INPUTS;
/// Events since the baseline.
pub const EVENTS: u8 = 1 << 5;
/// Not a section; means that the snapshot needs no baseline.
pub const KEYFRAME: u8 = 1 << 6;
/// Bits allowed in a keyframe, which has no deaths or moves.
pub const IN_KEYFRAME: u8 = KEYFRAME | BIRTHS | PLAYERS | PARTICLES | EVENTS;

/// Names of the bits, lowest first.
const NAMES: [&str; 7] = ["deaths", "moves", "births", "players", "inputs", "events", "keyframe"];

/// `bit` if it is set, otherwise 0.
pub fn bit(is_set: bool, bit: u8) -> u8 {
    if is_set { bit } else { 0 }
}

/// Returns true if the bodies are the same after a message as before it, apart from their positions.
pub fn keeps_bodies(message: &[u8]) -> bool {
    message.first().is_some_and(|sections| sections & (DEATHS | BIRTHS | KEYFRAME) == 0)
}

impl Snapshot {
    /// Names of the sections of a coded snapshot, read from its first byte.
    pub fn section_names(bytes: &[u8]) -> Result<Vec<&'static str>, DecodeError> {
        let sections = Reader::new(bytes).byte("sections")? & !SNAPSHOT;
        let mut names = NAMES;
        if sections & KEYFRAME != 0 {
            names[PARTICLES.trailing_zeros() as usize] = "particles";
        }
        let present = |(bit, _): &(usize, &'static str)| sections >> bit & 1 == 1;
        Ok(names.into_iter().enumerate().filter(present).map(|(_, name)| name).collect())
    }
}
