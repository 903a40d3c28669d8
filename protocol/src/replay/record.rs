//! Records: what a replay consists of, each sealed with its length and a checksum.

use super::block::Block;
use super::{FORMAT, MAGIC};
use crate::Appearance;
use crate::limits::{
    PROGRAM_BYTES_MAX, REPLAY_RECORD_BYTES_MAX, ROOM_CODE_BYTES_MAX, SCENE_BYTES_MAX,
    SCENE_NAME_BYTES_MAX,
};
use crate::seat::{read_seat, write_seat};
use crate::wire::{DecodeError, Reader, Writer};
use jostle_sim::{SEATS_MAX, Seat};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Deflate level: higher ones take several times as long for a few percent.
const PACK_LEVEL: u8 = 6;
/// Kind, length and checksum.
pub(super) const FRAME_BYTES: usize = 9;

/// What a replay begins with.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Start {
    /// Version of the program that played the game.
    pub program: String,
    /// When, in seconds since 1970; 0 if unknown.
    pub unix_s: u64,
    /// Code of the room; may be empty.
    pub room: String,
    /// Name of the scene.
    pub scene_name: String,
    /// The whole scene file.
    pub scene: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Ticks that were played before the first one recorded. Unless it is 0, the next record is a
    /// keyframe.
    pub first_tick: u32,
}

/// The whole state after a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keyframe {
    /// Ticks played.
    pub tick: u32,
    /// All bits of the state hash.
    pub hash: u64,
    /// Who sits where.
    pub members: Vec<(Seat, Appearance)>,
    /// What `Game::save` gave.
    pub state: Vec<u8>,
}

/// One record.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// The first one.
    Start(Start),
    /// The next ticks.
    Ticks(Block),
    /// The state after the ticks so far.
    Keyframe(Keyframe),
    /// The last one: the game was recorded to its end.
    End {
        /// Ticks played.
        tick: u32,
        /// All bits of the state hash after them.
        hash: u64,
    },
}

/// What a file begins with: magic and format version.
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
        }
    }

    /// The record as it is appended to a file. Packing takes its time: about 30 microseconds for a
    /// few seconds of a game, a millisecond for a keyframe with thousands of particles.
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
        }
        frame(self.kind(), &writer.finish())
    }

    /// Reads what a sealed record holds; the checksum was compared by then.
    pub(super) fn read(kind: u8, payload: &[u8]) -> Result<Record, DecodeError> {
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

/// A payload with its kind, length and checksum before it: a record as it stands in a file. For those
/// who test readers with payloads that no [`Record`] has.
pub fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    let mut framed = vec![kind];
    framed.extend((payload.len() as u32).to_le_bytes());
    framed.extend(checksum(kind, payload).to_le_bytes());
    framed.extend(payload);
    framed
}

/// Digest of a record's kind, length and payload.
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
        let (tick, hash) = (reader.leb32("tick")?, reader.fixed64("hash")?);
        let mut members: Vec<(Seat, Appearance)> = Vec::new();
        for _ in 0..reader.count(SEATS_MAX, 3, "number of members")? {
            let seat = read_seat(reader)?;
            if members.last().is_some_and(|&(before, _)| before >= seat) {
                return Err(DecodeError::OutOfRange { field: "seat" });
            }
            members.push((seat, Appearance::read(reader)?));
        }
        let state = unpack(reader, REPLAY_RECORD_BYTES_MAX, "state")?;
        Ok(Keyframe { tick, hash, members, state })
    }
}

/// The rest of a record, deflated.
pub(super) fn pack(writer: &mut Writer, bytes: &[u8]) {
    writer.raw(&miniz_oxide::deflate::compress_to_vec(bytes, PACK_LEVEL));
}

/// The rest of a record, inflated to at most `bytes_max`.
pub(super) fn unpack(
    reader: &mut Reader,
    bytes_max: usize,
    field: &'static str,
) -> Result<Vec<u8>, DecodeError> {
    let packed = reader.raw(reader.remaining(), field)?;
    miniz_oxide::inflate::decompress_to_vec_with_limit(packed, bytes_max)
        .map_err(|_| DecodeError::OutOfRange { field })
}
