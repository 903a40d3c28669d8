//! A replay that has been read. Each record's checksum and outline have been checked once, and the records before the
//! first damaged one are kept. Their contents are decoded when they are played.

use super::block::{Block, keeps_full_hash};
use super::players::PlayerCount;
use super::record::{FORMAT, FRAME_BYTES, Keyframe, MAGIC, Record, Start, checksum};
use crate::error::DecodeError;
use crate::limits::{REPLAY_BYTES_MAX, REPLAY_RECORD_BYTES_MAX, SCENE_BYTES_MAX};

/// Length of the magic number and the version, bytes.
pub(super) const HEADER_BYTES: usize = MAGIC.len() + 2;
/// Length of the header and the longest start record, with a scene that cannot be compressed at all, bytes.
pub const START_BYTES_MAX: usize = HEADER_BYTES + FRAME_BYTES + SCENE_BYTES_MAX + 1024;

/// The reason why a file is not a replay or ends too early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("byte {offset}: {problem}")]
pub struct ReplayError {
    /// Offset of the problem, in bytes from the start.
    pub offset: usize,
    /// The kind of problem.
    pub problem: Problem,
}

/// A problem with a replay's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// The file does not start with the magic number.
    #[error("this is not a replay")]
    NotAReplay,
    /// The file has a different format version.
    #[error("replay format {found}; this program reads format {FORMAT}")]
    Format {
        /// The version in the file.
        found: u16,
    },
    /// The file is longer than [`REPLAY_BYTES_MAX`].
    #[error("{bytes} bytes; a replay has at most {REPLAY_BYTES_MAX}")]
    TooLong {
        /// Length of the whole replay, in bytes.
        bytes: usize,
    },
    /// The file ends within a record.
    #[error("the file ends within a record")]
    CutOff,
    /// A record claims to be longer than allowed.
    #[error("a record of {bytes} bytes; at most {REPLAY_RECORD_BYTES_MAX} are allowed")]
    LongRecord {
        /// Length stated in the record.
        bytes: usize,
    },
    /// The record was changed after it had been written.
    #[error("the record is damaged: its checksum differs")]
    Checksum,
    /// The record cannot be decoded.
    #[error("the record cannot be read: {0}")]
    Record(DecodeError),
    /// The record is not allowed at this point.
    #[error("{0}")]
    Order(&'static str),
    /// The file ends between two records and has no end record.
    #[error("the file ends without an end record")]
    NoEnd,
}

/// How a replay ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The replay was recorded to the end.
    Whole,
    /// The end is missing: nothing readable follows.
    Cut(ReplayError),
    /// A record is damaged, or records follow where none are allowed. The rest is not read.
    Damaged(ReplayError),
}

impl Ending {
    /// The reason why the replay ends before its end record, if it does.
    pub fn error(self) -> Option<ReplayError> {
        match self {
            Ending::Whole => None,
            Ending::Cut(error) | Ending::Damaged(error) => Some(error),
        }
    }
}

/// A replay whose records are complete and in order.
#[derive(Clone, Debug)]
pub struct Replay {
    pub(super) bytes: Vec<u8>,
    pub(super) start: Start,
    /// Payloads of the blocks, in order of first tick.
    pub(super) blocks: Vec<Payload>,
    /// Payloads of the keyframes, in tick order.
    pub(super) keyframes: Vec<Payload>,
    /// Payload of the host's latest record, with its tick.
    pub(super) host: Option<Payload>,
    pub(super) last_tick: u32,
    pub(super) end_hash: Option<u64>,
    pub(super) ending: Ending,
    /// Offset of the end of the start record.
    pub(super) start_bytes: usize,
    /// Offset of the end of the last complete record.
    pub(super) whole_bytes: usize,
}

/// A replay's bytes by purpose; they add up to the length of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Sizes {
    /// The header and the start record, which is mostly the scene.
    pub start: usize,
    /// State hashes, one per tick.
    pub hashes: usize,
    /// Inputs, member changes, and the frames of the records that contain them.
    pub inputs: usize,
    /// States from which playback can start.
    pub keyframes: usize,
    /// The end record and the host's notes.
    pub end: usize,
    /// Bytes after the last complete record.
    pub lost: usize,
}

/// Where a record's payload is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Payload {
    pub tick: u32,
    pub at: usize,
    pub bytes: usize,
}

impl Replay {
    /// The start record.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// Number of ticks played before the first recorded one.
    pub fn first_tick(&self) -> u32 {
        self.start.first_tick
    }

    /// Number of the last recorded tick, or [`Replay::first_tick`] if no tick was recorded.
    pub fn last_tick(&self) -> u32 {
        self.last_tick
    }

    /// How the replay ends.
    pub fn ending(&self) -> Ending {
        self.ending
    }

    /// The full hash after the last tick, if the game was recorded to its end.
    pub fn end_hash(&self) -> Option<u64> {
        self.end_hash
    }

    /// Length of the file in bytes.
    pub fn byte_count(&self) -> usize {
        self.bytes.len()
    }

    /// The file's contents.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the file's contents.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// The keyframes' ticks, in ascending order.
    pub fn keyframe_ticks(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.keyframes.iter().map(|payload| payload.tick)
    }

    /// Number of bytes that the keyframes take up in the file.
    pub fn keyframe_bytes(&self) -> usize {
        self.keyframes.iter().map(|payload| payload.bytes + FRAME_BYTES).sum()
    }

    /// The bytes by purpose.
    pub fn sizes(&self) -> Sizes {
        let ticks = self.first_tick() + 1..=self.last_tick;
        let full = ticks.clone().filter(|&tick| keeps_full_hash(tick)).count();
        let hashes = 8 * full + 2 * (ticks.count() - full);
        let blocks: usize = self.blocks.iter().map(|payload| payload.bytes + FRAME_BYTES).sum();
        let (start, keyframes) = (self.start_bytes, self.keyframe_bytes());
        Sizes {
            start,
            hashes,
            inputs: blocks - hashes,
            keyframes,
            end: self.whole_bytes - start - keyframes - blocks,
            lost: self.bytes.len() - self.whole_bytes,
        }
    }

    /// The block that contains a tick; `None` if the tick is outside the replay or the record cannot be decoded.
    pub fn block_with(&self, tick: u32) -> Option<Block> {
        if tick > self.last_tick {
            return None;
        }
        let after = self.blocks.partition_point(|payload| payload.tick <= tick);
        match self.record(self.blocks[after.checked_sub(1)?], 2)? {
            Record::Ticks(block) => Some(block),
            _ => None,
        }
    }

    /// The last keyframe at or before a tick; `None` if it is missing or cannot be decoded.
    pub fn keyframe_before(&self, tick: u32) -> Option<Keyframe> {
        let after = self.keyframes.partition_point(|payload| payload.tick <= tick);
        self.keyframe(after.checked_sub(1)?)
    }

    /// The first keyframe at or after a tick; `None` if it is missing or cannot be decoded.
    pub fn keyframe_after(&self, tick: u32) -> Option<Keyframe> {
        self.keyframe(self.keyframes.partition_point(|payload| payload.tick < tick))
    }

    fn keyframe(&self, index: usize) -> Option<Keyframe> {
        match self.record(*self.keyframes.get(index)?, 3)? {
            Record::Keyframe(keyframe) => Some(keyframe),
            _ => None,
        }
    }

    /// The host's latest notes, with the tick after which they were made.
    pub fn host(&self) -> Option<(u32, &[u8])> {
        let Payload { tick, at, bytes } = self.host?;
        Some((tick, self.bytes.get(at..at + bytes)?))
    }

    /// Decodes a record that was previously found to be complete.
    fn record(&self, payload: Payload, kind: u8) -> Option<Record> {
        Record::read(kind, self.bytes.get(payload.at..payload.at + payload.bytes)?).ok()
    }
}

impl Start {
    /// Reads a replay's start from at least its first [`START_BYTES_MAX`] bytes.
    pub fn find(bytes: &[u8]) -> Result<Start, ReplayError> {
        check_header(bytes)?;
        match next(bytes, HEADER_BYTES)? {
            (Record::Start(start), _) => Ok(start),
            _ => Err(wrong(HEADER_BYTES, "a replay must begin with its start record")),
        }
    }
}

impl PlayerCount {
    /// Counts the players in the complete records at the beginning of a file.
    pub fn of_beginning(bytes: &[u8]) -> PlayerCount {
        let mut count = PlayerCount::default();
        let mut at = HEADER_BYTES;
        while let Ok((kind, payload)) = sealed(bytes, at) {
            let Ok(record) = Record::read_without_state(kind, payload) else { break };
            count.note(&record);
            at += FRAME_BYTES + payload.len();
        }
        count
    }
}

pub(super) fn check_header(bytes: &[u8]) -> Result<(), ReplayError> {
    let bad = |offset, problem| Err(ReplayError { offset, problem });
    if bytes.len() > REPLAY_BYTES_MAX {
        return bad(REPLAY_BYTES_MAX, Problem::TooLong { bytes: bytes.len() });
    }
    let Some(rest) = bytes.strip_prefix(&MAGIC) else { return bad(0, Problem::NotAReplay) };
    match rest.first_chunk::<2>().map(|version| u16::from_le_bytes(*version)) {
        Some(FORMAT) => Ok(()),
        Some(found) => bad(MAGIC.len(), Problem::Format { found }),
        None => bad(MAGIC.len(), Problem::CutOff),
    }
}

/// Reads the record at `at`, and returns it along with its end.
pub(super) fn next(bytes: &[u8], at: usize) -> Result<(Record, usize), ReplayError> {
    let (kind, payload) = sealed(bytes, at)?;
    let record = Record::read(kind, payload)
        .map_err(|error| ReplayError { offset: at, problem: Problem::Record(error) })?;
    Ok((record, at + FRAME_BYTES + payload.len()))
}

/// The kind and payload of the record at `at`, if it is complete and its checksum matches.
pub(super) fn sealed(bytes: &[u8], at: usize) -> Result<(u8, &[u8]), ReplayError> {
    let bad = |problem| ReplayError { offset: at, problem };
    let rest = bytes.get(at..).unwrap_or_default();
    if rest.is_empty() {
        return Err(bad(Problem::NoEnd));
    }
    let (frame, rest) = rest.split_first_chunk::<FRAME_BYTES>().ok_or(bad(Problem::CutOff))?;
    let [kind, l0, l1, l2, l3, c0, c1, c2, c3] = *frame;
    let length = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
    if length > REPLAY_RECORD_BYTES_MAX {
        return Err(bad(Problem::LongRecord { bytes: length }));
    }
    let payload = rest.get(..length).ok_or(bad(Problem::CutOff))?;
    if checksum(kind, payload) != u32::from_le_bytes([c0, c1, c2, c3]) {
        return Err(bad(Problem::Checksum));
    }
    Ok((kind, payload))
}

pub(super) fn wrong(offset: usize, problem: &'static str) -> ReplayError {
    ReplayError { offset, problem: Problem::Order(problem) }
}
