//! Blocks of ticks. Hashes are random bits and are stored uncompressed, as are the coded pointer moves, which do not
//! compress any further. The rest is stored as deflated columns.

mod column;

use super::pack::{pack, unpack};
use crate::appearance::Appearance;
use crate::bits::{BitReader, BitWriter};
use crate::error::{DecodeError, check};
use crate::ids::{check_seat_order, read_seat, write_seat};
use crate::limits::{NAME_BYTES_MAX, REPLAY_BLOCK_TICKS_MAX, REPLAY_TICKS_MAX};
use crate::wire::{Reader, Writer};
use jostle_game::{Input, SEATS_MAX, Seat};

/// Maximum length of a tick's unpacked inputs, bytes: every seat changes all its inputs.
const INPUTS_PER_TICK_BYTES_MAX: usize = 16 * SEATS_MAX;
/// Maximum number of joins, leaves and appearance changes in one tick.
const CHANGES_PER_TICK_MAX: usize = 4 * SEATS_MAX;
/// Maximum length of a block's unpacked changes, bytes: as many as one tick may have, with the longest names.
const CHANGES_BYTES_MAX: usize = CHANGES_PER_TICK_MAX * (16 + NAME_BYTES_MAX);

/// A change in the members that takes effect in a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A player takes this seat.
    Join(Seat, Appearance),
    /// A player gives up this seat.
    Leave(Seat),
    /// A player returns, possibly with a different name or colour.
    Look(Seat, Appearance),
}

/// All 64 bits of the hash are stored for ticks that are multiples of this number, and 16 bits for the others.
pub const FULL_HASH_TICKS: u32 = 60;

/// Returns true if all 64 bits of this tick's hash are stored.
pub fn keeps_full_hash(tick: u32) -> bool {
    tick.is_multiple_of(FULL_HASH_TICKS)
}

/// One tick, as stored in a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Changes that precede the tick, in order.
    pub changes: Vec<Change>,
    /// The game's inputs in seat order, with pointers in whole quanta.
    pub inputs: Vec<(Seat, Input)>,
    /// The state hash after the tick: all bits if [`keeps_full_hash`] is true, otherwise the low 16.
    pub hash: u64,
}

impl Tick {
    /// Returns true if `hash` agrees with the hash recorded for tick number `tick`.
    pub fn agrees(&self, tick: u32, hash: u64) -> bool {
        self.hash == kept(tick, hash)
    }
}

/// The bits of a hash that are stored.
fn kept(tick: u32, hash: u64) -> u64 {
    if keeps_full_hash(tick) { hash } else { hash & 0xffff }
}

/// Consecutive ticks, up to [`REPLAY_BLOCK_TICKS_MAX`] of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Number of the first tick. Ticks are counted from 1.
    pub first: u32,
    /// Consecutive ticks, from `first` on.
    pub ticks: Vec<Tick>,
}

impl Block {
    /// Number of the last tick.
    pub fn last(&self) -> u32 {
        self.first + self.ticks.len() as u32 - 1
    }

    /// Writes the block. Panics if it is empty or too long.
    pub(super) fn write(&self, writer: &mut Writer) {
        let count = self.ticks.len();
        assert!((1..=REPLAY_BLOCK_TICKS_MAX).contains(&count), "a block of {count} ticks");
        writer.leb32(self.first);
        writer.count(count);
        for (tick, number) in self.ticks.iter().zip(self.first..) {
            let bytes = if keeps_full_hash(number) { 8 } else { 2 };
            writer.raw(&tick.hash.to_le_bytes()[..bytes]);
        }
        let (mut columns, mut moves) = (Writer::new(), BitWriter::default());
        self.write_changes(&mut columns);
        self.write_inputs(&mut columns, &mut moves);
        let moves = moves.finish();
        writer.count(moves.len());
        writer.raw(&moves);
        pack(writer, &columns.finish());
    }

    pub(super) fn read(reader: &mut Reader) -> Result<Block, DecodeError> {
        let (first, count) = Block::read_numbers(reader)?;
        let mut ticks = Vec::with_capacity(count);
        for number in (first..).take(count) {
            let hash = if keeps_full_hash(number) {
                reader.fixed64("hash")?
            } else {
                u64::from(reader.fixed16("hash")?)
            };
            ticks.push(Tick { changes: Vec::new(), inputs: Vec::new(), hash });
        }
        let bytes_max = count * INPUTS_PER_TICK_BYTES_MAX;
        let moves = reader.count(bytes_max, 1, "moves of pointers")?;
        let mut moves = BitReader::new(reader.raw(moves, "moves of pointers")?);
        let columns = unpack(reader, bytes_max + CHANGES_BYTES_MAX, "inputs")?;
        let mut reader = Reader::new(&columns);
        read_changes(&mut ticks, &mut reader)?;
        read_inputs(&mut ticks, &mut reader, &mut moves)?;
        reader.end()?;
        moves.end("moves of pointers")?;
        Ok(Block { first, ticks })
    }

    /// Reads the number of the first tick and the number of ticks.
    fn read_numbers(reader: &mut Reader) -> Result<(u32, usize), DecodeError> {
        let first = reader.leb_up_to(REPLAY_TICKS_MAX, "tick")?;
        let count = reader.count(REPLAY_BLOCK_TICKS_MAX, 2, "number of ticks")?;
        check(first > 0 && count > 0, "tick")?;
        Ok((first, count))
    }

    /// Reads the same numbers from a block without decoding it. The hashes are skipped.
    pub(super) fn read_span(reader: &mut Reader) -> Result<(u32, usize), DecodeError> {
        let (first, count) = Block::read_numbers(reader)?;
        let full = (first..).take(count).filter(|&tick| keeps_full_hash(tick)).count();
        reader.raw(2 * count + 6 * full, "hash")?;
        Ok((first, count))
    }

    fn write_changes(&self, columns: &mut Writer) {
        columns.count(self.ticks.iter().map(|tick| tick.changes.len()).sum());
        for (index, tick) in (0u32..).zip(&self.ticks) {
            for change in &tick.changes {
                columns.leb32(index);
                let (kind, seat, appearance) = match change {
                    Change::Join(seat, appearance) => (0, seat, Some(appearance)),
                    Change::Leave(seat) => (1, seat, None),
                    Change::Look(seat, appearance) => (2, seat, Some(appearance)),
                };
                columns.byte(kind);
                write_seat(columns, *seat);
                if let Some(appearance) = appearance {
                    appearance.write(columns);
                }
            }
        }
    }

    /// Writes each seat's input columns.
    fn write_inputs(&self, columns: &mut Writer, moves: &mut BitWriter) {
        let inputs = self.ticks.iter().flat_map(|tick| tick.inputs.iter());
        let mut seats: Vec<u64> = inputs.map(|&(seat, _)| seat.0.into()).collect();
        seats.sort_unstable();
        seats.dedup();
        columns.count(seats.len());
        for seat in seats.into_iter().map(|seat| Seat(seat as u16)) {
            let inputs: Vec<Option<Input>> =
                self.ticks.iter().map(|tick| input_of(&tick.inputs, seat)).collect();
            write_seat(columns, seat);
            column::write(&inputs, columns, moves);
        }
    }
}

fn input_of(inputs: &[(Seat, Input)], seat: Seat) -> Option<Input> {
    let index = inputs.binary_search_by_key(&seat, |&(seat, _)| seat).ok()?;
    Some(inputs[index].1)
}

fn read_changes(ticks: &mut [Tick], columns: &mut Reader) -> Result<(), DecodeError> {
    let count = columns.count(ticks.len() * CHANGES_PER_TICK_MAX, 3, "number of changes")?;
    let mut before = 0;
    for _ in 0..count {
        let index = columns.leb_up_to(ticks.len() as u32 - 1, "tick of a change")? as usize;
        check(index >= before, "tick of a change")?;
        before = index;
        let kind = columns.byte("change")?;
        let seat = read_seat(columns)?;
        let change = match kind {
            0 => Change::Join(seat, Appearance::read(columns)?),
            1 => Change::Leave(seat),
            2 => Change::Look(seat, Appearance::read(columns)?),
            _ => return Err(DecodeError::OutOfRange { field: "change" }),
        };
        ticks[index].changes.push(change);
    }
    Ok(())
}

fn read_inputs(
    ticks: &mut [Tick],
    columns: &mut Reader,
    moves: &mut BitReader,
) -> Result<(), DecodeError> {
    let mut seat_before = None;
    for _ in 0..columns.count(SEATS_MAX, 3, "number of seats")? {
        let seat = read_seat(columns)?;
        check_seat_order(seat_before, seat)?;
        seat_before = Some(seat);
        let inputs = column::read(ticks.len(), columns, moves)?;
        for (tick, input) in ticks.iter_mut().zip(inputs) {
            tick.inputs.extend(input.map(|input| (seat, input)));
        }
    }
    Ok(())
}
