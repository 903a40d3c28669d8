//! A replay's records, each sealed with its length and a checksum.

use super::block::Block;
use super::pack::{pack, unpack};
use crate::appearance::Appearance;
use crate::error::DecodeError;
use crate::ids::{check_seat_order, read_seat, write_seat};
use crate::limits::{
    PROGRAM_BYTES_MAX, REPLAY_RECORD_BYTES_MAX, ROOM_CODE_BYTES_MAX, SCENE_BYTES_MAX,
    SCENE_NAME_BYTES_MAX,
};
use crate::wire::{Reader, Writer};
use jostle_game::{SEATS_MAX, Seat};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// The first bytes of every replay file.
pub const MAGIC: [u8; 8] = *b"jostle\x1a\n";
/// Version of the format.
pub const FORMAT: u16 = 1;
/// Kind of the record that contains a host's notes.
const HOST: u8 = 5;
/// Length of a record's kind, length and checksum fields, bytes.
pub(super) const FRAME_BYTES: usize = 9;
/// Maximum length of the sealed end record, which is the last record in a file, bytes: frame, tick and hash.
pub const END_BYTES_MAX: usize = FRAME_BYTES + END_PAYLOAD_BYTES[1];
/// Minimum and maximum length of the end record's payload, in bytes.
const END_PAYLOAD_BYTES: [usize; 2] = [1 + 8, 5 + 8];

/// A replay's start record.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Start {
    /// Version of the program that played the game.
    pub program: String,
    /// Time of the recording, in seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// The room's code. May be empty.
    pub room: String,
    /// The scene's name.
    pub scene_name: String,
    /// The text of the scene file.
    pub scene: String,
    /// The game's seed.
    pub seed: u64,
    /// Number of ticks played before the first recorded one. If it is not 0, the next record is a keyframe.
    pub first_tick: u32,
}

/// The complete state after a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keyframe {
    /// Number of ticks played before this state.
    pub tick: u32,
    /// The full state hash.
    pub hash: u64,
    /// Names and colours by seat.
    pub members: Vec<(Seat, Appearance)>,
    /// The state, as returned by `Game::save`.
    pub state: Vec<u8>,
}

/// A record in a replay.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// The first record.
    Start(Start),
    /// A block of ticks.
    Ticks(Block),
    /// The complete state after the last tick so far.
    Keyframe(Keyframe),
    /// The final record of a game that was recorded to its end.
    End {
        /// Total number of ticks played.
        tick: u32,
        /// The full state hash after these ticks.
        hash: u64,
    },
    /// A host's notes about a room. They are not part of the game, and their format is private to the host; replay
    /// players skip them.
    Host(Vec<u8>),
}

/// The numbers in a record that are needed before it is played. None of them are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outline {
    Start,
    /// Numbers of the first and last tick.
    Ticks {
        first: u32,
        last: u32,
    },
    Keyframe {
        tick: u32,
    },
    End {
        tick: u32,
        hash: u64,
    },
    Host,
}

impl Outline {
    /// Reads the leading numbers in a sealed record's payload. The checksum has already been verified.
    pub(super) fn read(kind: u8, payload: &[u8]) -> Result<Outline, DecodeError> {
        let mut reader = Reader::new(payload);
        match kind {
            1 => Ok(Outline::Start),
            2 => {
                let (first, count) = Block::read_span(&mut reader)?;
                Ok(Outline::Ticks { first, last: first + (count as u32 - 1) })
            }
            3 => Ok(Outline::Keyframe { tick: reader.leb32("tick")? }),
            HOST => Ok(Outline::Host),
            kind => match Record::read(kind, payload)? {
                Record::End { tick, hash } => Ok(Outline::End { tick, hash }),
                _ => Err(DecodeError::OutOfRange { field: "kind of record" }),
            },
        }
    }
}

/// The start of a file: the magic number and the format version.
pub fn header() -> Vec<u8> {
    [&MAGIC[..], &FORMAT.to_le_bytes()].concat()
}

impl Record {
    fn kind(&self) -> u8 {
        match self {
            Record::Start(_) => 1,
            Record::Ticks(_) => 2,
            Record::Keyframe(_) => 3,
            Record::End { .. } => 4,
            Record::Host(_) => HOST,
        }
    }

    /// Encodes the record in the form in which it is appended to a file. Compression takes about 30 microseconds for a
    /// few seconds of a game, and a millisecond for a keyframe with thousands of particles.
    pub fn seal(&self) -> Vec<u8> {
        let mut writer = Writer::new();
        match self {
            Record::Start(start) => start.write(&mut writer),
            Record::Ticks(block) => block.write(&mut writer),
            Record::Keyframe(keyframe) => keyframe.write(&mut writer),
            Record::End { tick, hash } => {
                writer.leb32(*tick);
                writer.fixed64(*hash);
            }
            Record::Host(notes) => return frame(HOST, notes),
        }
        frame(self.kind(), &writer.finish())
    }

    /// Finds the end record's tick in the last [`END_BYTES_MAX`] bytes of a file, or fewer; `None` if the file does not
    /// end with an end record.
    pub fn last_tick(tail: &[u8]) -> Option<u32> {
        (END_PAYLOAD_BYTES[0]..=END_PAYLOAD_BYTES[1]).find_map(|bytes| {
            let at = tail.len().checked_sub(FRAME_BYTES + bytes)?;
            let payload = &tail[at + FRAME_BYTES..];
            match Record::read(4, payload) {
                Ok(end @ Record::End { tick, .. }) if end.seal() == tail[at..] => Some(tick),
                _ => None,
            }
        })
    }

    /// Like [`Record::read`], but leaves a keyframe's state packed and omits it from the result.
    pub(super) fn read_without_state(kind: u8, payload: &[u8]) -> Result<Record, DecodeError> {
        match kind {
            3 => Keyframe::read_members(&mut Reader::new(payload)).map(Record::Keyframe),
            _ => Record::read(kind, payload),
        }
    }

    /// Decodes a sealed record's payload. The checksum has already been verified.
    pub(super) fn read(kind: u8, payload: &[u8]) -> Result<Record, DecodeError> {
        if kind == HOST {
            return Ok(Record::Host(payload.to_vec()));
        }
        let mut reader = Reader::new(payload);
        let record = match kind {
            1 => Record::Start(Start::read(&mut reader)?),
            2 => Record::Ticks(Block::read(&mut reader)?),
            3 => Record::Keyframe(Keyframe::read(&mut reader)?),
            4 => Record::End { tick: reader.leb32("tick")?, hash: reader.fixed64("hash")? },
            _ => return Err(DecodeError::OutOfRange { field: "kind of record" }),
        };
        reader.end()?;
        Ok(record)
    }
}

/// Prepends the kind, length and checksum to a payload, as in a file. This is public so that tests of readers can build
/// payloads that no [`Record`] produces.
pub fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    let mut framed = vec![kind];
    framed.extend((payload.len() as u32).to_le_bytes());
    framed.extend(checksum(kind, payload).to_le_bytes());
    framed.extend(payload);
    framed
}

/// The digest of a record's kind, length and payload.
pub(super) fn checksum(kind: u8, payload: &[u8]) -> u32 {
    xxh3_64_with_seed(payload, (payload.len() as u64) << 8 | u64::from(kind)) as u32
}

impl Start {
    fn write(&self, writer: &mut Writer) {
        writer.text(&self.program, PROGRAM_BYTES_MAX);
        writer.leb64(self.unix_s);
        writer.text(&self.room, ROOM_CODE_BYTES_MAX);
        writer.text(&self.scene_name, SCENE_NAME_BYTES_MAX);
        writer.fixed64(self.seed);
        writer.leb32(self.first_tick);
        pack(writer, self.scene.as_bytes());
    }

    fn read(reader: &mut Reader) -> Result<Start, DecodeError> {
        let program = reader.text(PROGRAM_BYTES_MAX, "program")?.to_owned();
        let unix_s = reader.leb64("time")?;
        let room = reader.text(ROOM_CODE_BYTES_MAX, "room")?.to_owned();
        let scene_name = reader.text(SCENE_NAME_BYTES_MAX, "scene name")?.to_owned();
        let seed = reader.fixed64("seed")?;
        let first_tick = reader.leb32("first tick")?;
        let scene = unpack(reader, SCENE_BYTES_MAX, "scene")?;
        let scene =
            String::from_utf8(scene).map_err(|_| DecodeError::OutOfRange { field: "scene" })?;
        Ok(Start { program, unix_s, room, scene_name, scene, seed, first_tick })
    }
}

impl Keyframe {
    fn write(&self, writer: &mut Writer) {
        writer.leb32(self.tick);
        writer.fixed64(self.hash);
        writer.count(self.members.len());
        for (seat, appearance) in &self.members {
            write_seat(writer, *seat);
            appearance.write(writer);
        }
        pack(writer, &self.state);
    }

    fn read(reader: &mut Reader) -> Result<Keyframe, DecodeError> {
        let keyframe = Keyframe::read_members(reader)?;
        let state = unpack(reader, REPLAY_RECORD_BYTES_MAX, "state")?;
        Ok(Keyframe { state, ..keyframe })
    }

    /// Reads everything except the state, which stays empty.
    fn read_members(reader: &mut Reader) -> Result<Keyframe, DecodeError> {
        let (tick, hash) = (reader.leb32("tick")?, reader.fixed64("hash")?);
        let mut members: Vec<(Seat, Appearance)> = Vec::new();
        for _ in 0..reader.count(SEATS_MAX, 3, "number of members")? {
            let seat = read_seat(reader)?;
            check_seat_order(members.last().map(|&(before, _)| before), seat)?;
            members.push((seat, Appearance::read(reader)?));
        }
        Ok(Keyframe { tick, hash, members, state: Vec::new() })
    }
}
