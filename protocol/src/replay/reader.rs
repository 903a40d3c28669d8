//! Reads replays in steps, so that a page can read one between frames.

use super::read::{Ending, HEADER_BYTES, Payload, Problem, Replay, ReplayError};
use super::read::{check_header, next, sealed, wrong};
use super::record::{FRAME_BYTES, Outline, Record};
use crate::limits::{REPLAY_RECORD_BYTES_MAX, REPLAY_TICKS_MAX};

/// Number of bytes that a step reads. The record that contains the last of them is read completely.
const STEP_BYTES: usize = 256 << 10;
/// Limit on the number of bytes checksummed while searching for a record after a cut. Random bytes rarely look like a
/// plausible length; forged ones may all do so.
const SEARCH_BYTES_MAX: usize = 4 * REPLAY_RECORD_BYTES_MAX;

/// Reads a replay in steps. All steps together read each byte of the file once, and the bytes after a cut a few more
/// times. Apart from the scene, packed data stays packed, so that the cost of a file is proportional to its length.
#[derive(Debug)]
pub struct ReplayReader {
    replay: Replay,
    stage: ReadStage,
}

#[derive(Debug)]
enum ReadStage {
    /// Offset of the next record.
    Records(usize),
    /// The file seems to end within a record. If a valid record follows, the first record's length is damaged.
    Search {
        cut: ReplayError,
        at: usize,
        bytes_left: usize,
    },
    Done,
}

impl Replay {
    /// Reads a file up to the first record that is missing or damaged; see [`Replay::ending`]. An error means that not
    /// even the start can be read. Time and memory are proportional to the size of the file, because packed data is
    /// unpacked and checked only on demand. [`ReplayReader`] does the same in steps.
    pub fn read(bytes: Vec<u8>) -> Result<Replay, ReplayError> {
        Ok(ReplayReader::new(bytes)?.finish())
    }
}

impl ReplayReader {
    /// Reads the start of a file. Fails if even that is impossible.
    pub fn new(bytes: Vec<u8>) -> Result<ReplayReader, ReplayError> {
        check_header(&bytes)?;
        let head = HEADER_BYTES;
        let (Record::Start(start), end) = next(&bytes, head)? else {
            return Err(wrong(head, "a replay must begin with its start record"));
        };
        if start.first_tick >= REPLAY_TICKS_MAX {
            return Err(wrong(head, "the first tick is out of range"));
        }
        let replay = Replay {
            bytes,
            last_tick: start.first_tick,
            start,
            blocks: Vec::new(),
            keyframes: Vec::new(),
            host: None,
            end_hash: None,
            ending: Ending::Whole,
            start_bytes: end,
            whole_bytes: end,
        };
        Ok(ReplayReader { replay, stage: ReadStage::Records(end) })
    }

    /// Reads for a moment. Returns `false` once everything has been read.
    pub fn step(&mut self) -> bool {
        self.stage = match self.stage {
            ReadStage::Records(at) => self.read_records(at),
            ReadStage::Search { cut, at, bytes_left } => self.search(cut, at, bytes_left),
            ReadStage::Done => return false,
        };
        !matches!(self.stage, ReadStage::Done)
    }

    /// The fraction of the file that has been read, 0..=1.
    pub fn progress(&self) -> f64 {
        let read = match self.stage {
            ReadStage::Records(at) | ReadStage::Search { at, .. } => at,
            ReadStage::Done => self.replay.bytes.len(),
        };
        read as f64 / self.replay.bytes.len() as f64
    }

    /// Reads the rest, and returns the replay.
    pub fn finish(mut self) -> Replay {
        while self.step() {}
        self.replay
    }

    fn read_records(&mut self, mut at: usize) -> ReadStage {
        let until = at + STEP_BYTES;
        while at < until {
            match self.take(at) {
                Ok(end) => (at, self.replay.whole_bytes) = (end, end),
                Err(error) if error.problem == Problem::CutOff => {
                    return ReadStage::Search {
                        cut: error,
                        at: at + 1,
                        bytes_left: SEARCH_BYTES_MAX,
                    };
                }
                Err(error) if error.problem == Problem::NoEnd => {
                    return self.end(Ending::Cut(error));
                }
                Err(error) => return self.end(Ending::Damaged(error)),
            }
            if self.replay.end_hash.is_some() {
                return self.end(match at < self.replay.bytes.len() {
                    true => Ending::Damaged(wrong(at, "there are bytes after the end record")),
                    false => Ending::Whole,
                });
            }
        }
        ReadStage::Records(at)
    }

    /// Searches for a complete record after a cut. If there is one, the record that seems to extend past the end of the
    /// file has a damaged length.
    fn search(&mut self, cut: ReplayError, mut at: usize, mut bytes_left: usize) -> ReadStage {
        let bytes = &self.replay.bytes;
        let (until, rest) = (at + STEP_BYTES, bytes_left.saturating_sub(STEP_BYTES));
        while at < bytes.len() {
            if at >= until || bytes_left < rest {
                return ReadStage::Search { cut, at, bytes_left };
            }
            match sealed(bytes, at).map_err(|error| error.problem) {
                Ok(_) => return self.end(Ending::Damaged(cut)),
                Err(Problem::Checksum) => match bytes_left.checked_sub(bytes.len() - at) {
                    Some(left) => bytes_left = left,
                    None => break,
                },
                Err(_) => {}
            }
            at += 1;
        }
        self.end(Ending::Cut(cut))
    }

    fn end(&mut self, ending: Ending) -> ReadStage {
        self.replay.ending = ending;
        ReadStage::Done
    }

    /// Adds the record at `at`, and returns the end of that record.
    fn take(&mut self, at: usize) -> Result<usize, ReplayError> {
        let replay = &mut self.replay;
        let (kind, bytes) = sealed(&replay.bytes, at)?;
        let outline = Outline::read(kind, bytes);
        let outline =
            outline.map_err(|error| ReplayError { offset: at, problem: Problem::Record(error) })?;
        let length = bytes.len();
        let payload = |tick| Payload { tick, at: at + FRAME_BYTES, bytes: length };
        let needs_state = replay.start.first_tick > 0 && replay.keyframes.is_empty();
        match outline {
            Outline::Start => return Err(wrong(at, "a second start record")),
            Outline::Ticks { .. } | Outline::End { .. } if needs_state => {
                return Err(wrong(at, "a replay that begins later must begin with a keyframe"));
            }
            Outline::Ticks { first, .. } if first != replay.last_tick + 1 => {
                return Err(wrong(at, "these ticks do not follow those before"));
            }
            Outline::Ticks { first, last } => {
                replay.blocks.push(payload(first));
                replay.last_tick = last;
            }
            Outline::Keyframe { tick } if tick != replay.last_tick => {
                return Err(wrong(at, "a keyframe of another tick"));
            }
            Outline::Keyframe { tick } => replay.keyframes.push(payload(tick)),
            Outline::End { tick, .. } if tick != replay.last_tick => {
                return Err(wrong(at, "an end at another tick"));
            }
            Outline::End { hash, .. } => replay.end_hash = Some(hash),
            Outline::Host => replay.host = Some(payload(replay.last_tick)),
        }
        Ok(at + FRAME_BYTES + length)
    }
}
