//! Blocks of ticks. Hashes are random bits and stand as they are; the rest is small differences in
//! columns, deflated.

use super::keeps_full_hash;
use super::record::{pack, read_seat, unpack};
use crate::Appearance;
use crate::limits::{QUANTA_MAX, REPLAY_BLOCK_TICKS_MAX, REPLAY_TICKS_MAX};
use crate::wire::{DecodeError, Reader, Writer};
use jostle_sim::game::POINTER_QUANTUM;
use jostle_sim::{Buttons, Input, SEATS_MAX, Seat, Vec2};

/// Longest unpacked block: every seat changes everything in every tick.
const BLOCK_BYTES_MAX: usize = 16 * REPLAY_BLOCK_TICKS_MAX * SEATS_MAX;
/// Joins, leaves and looks in one tick.
const CHANGES_PER_TICK_MAX: usize = 4 * SEATS_MAX;

/// Who came, went or looks different, effective with a tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A player took a seat.
    Join(Seat, Appearance),
    /// A player left a seat.
    Leave(Seat),
    /// A player came back with another name or colour.
    Look(Seat, Appearance),
}

/// One tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// What changed before it, in order.
    pub changes: Vec<Change>,
    /// The inputs that the game was given, in seat order; pointers in whole quanta.
    pub inputs: Vec<(Seat, Input)>,
    /// The state hash after it: all bits where [`keeps_full_hash`], else the low 16.
    pub hash: u64,
}

impl Tick {
    /// Whether `hash` is what was recorded for tick number `tick`.
    pub fn agrees(&self, tick: u32, hash: u64) -> bool {
        self.hash == kept(tick, hash)
    }
}

/// The bits of a hash that are kept.
fn kept(tick: u32, hash: u64) -> u64 {
    if keeps_full_hash(tick) { hash } else { hash & 0xffff }
}

/// Ticks in a row, at most [`REPLAY_BLOCK_TICKS_MAX`] of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Number of the first of them; ticks count from 1.
    pub first: u32,
    /// The ticks.
    pub ticks: Vec<Tick>,
}

impl Block {
    /// Number of the last tick.
    pub fn last(&self) -> u32 {
        self.first + self.ticks.len() as u32 - 1
    }

    /// Panics on an empty block and on one that is too long.
    pub(super) fn write(&self, writer: &mut Writer) {
        let count = self.ticks.len();
        assert!((1..=REPLAY_BLOCK_TICKS_MAX).contains(&count), "a block of {count} ticks");
        writer.leb32(self.first);
        writer.count(count);
        for (tick, number) in self.ticks.iter().zip(self.first..) {
            let bytes = if keeps_full_hash(number) { 8 } else { 2 };
            writer.raw(&tick.hash.to_le_bytes()[..bytes]);
        }
        let mut columns = Writer::new();
        self.write_changes(&mut columns);
        self.write_inputs(&mut columns);
        pack(writer, &columns.finish());
    }

    pub(super) fn read(reader: &mut Reader) -> Result<Block, DecodeError> {
        let first = reader.leb_up_to(REPLAY_TICKS_MAX, "tick")?;
        let count = reader.count(REPLAY_BLOCK_TICKS_MAX, 2, "number of ticks")?;
        if first == 0 || count == 0 {
            return Err(DecodeError::OutOfRange { field: "tick" });
        }
        let mut ticks = Vec::with_capacity(count);
        for number in (first..).take(count) {
            let hash = if keeps_full_hash(number) {
                reader.fixed64("hash")?
            } else {
                u64::from(reader.fixed16("hash")?)
            };
            ticks.push(Tick { changes: Vec::new(), inputs: Vec::new(), hash });
        }
        let columns = unpack(reader, BLOCK_BYTES_MAX, "inputs")?;
        let mut reader = Reader::new(&columns);
        read_changes(&mut ticks, &mut reader)?;
        read_inputs(&mut ticks, &mut reader)?;
        reader.end()?;
        Ok(Block { first, ticks })
    }

    fn write_changes(&self, columns: &mut Writer) {
        columns.count(self.ticks.iter().map(|tick| tick.changes.len()).sum());
        for (place, tick) in (0u32..).zip(&self.ticks) {
            for change in &tick.changes {
                columns.leb32(place);
                let (kind, seat, appearance) = match change {
                    Change::Join(seat, appearance) => (0, seat, Some(appearance)),
                    Change::Leave(seat) => (1, seat, None),
                    Change::Look(seat, appearance) => (2, seat, Some(appearance)),
                };
                columns.byte(kind);
                columns.byte(seat.0);
                if let Some(appearance) = appearance {
                    appearance.write(columns);
                }
            }
        }
    }

    /// One column a seat, coded with either prediction, whichever is shorter.
    fn write_inputs(&self, columns: &mut Writer) {
        let mut seats: Vec<Seat> =
            self.ticks.iter().flat_map(|tick| tick.inputs.iter().map(|&(seat, _)| seat)).collect();
        seats.sort_unstable();
        seats.dedup();
        columns.count(seats.len());
        for seat in seats {
            let values: Vec<Option<Input>> =
                self.ticks.iter().map(|tick| input_of(&tick.inputs, seat)).collect();
            let [still, moving] = [false, true].map(|steady| {
                let mut column = Writer::new();
                column.flag(steady);
                Column::new(steady).write(&values, &mut column);
                column.finish()
            });
            columns.byte(seat.0);
            columns.raw(if moving.len() < still.len() { &moving } else { &still });
        }
    }
}

fn input_of(inputs: &[(Seat, Input)], seat: Seat) -> Option<Input> {
    inputs.iter().find(|&&(other, _)| other == seat).map(|&(_, input)| input)
}

fn read_changes(ticks: &mut [Tick], columns: &mut Reader) -> Result<(), DecodeError> {
    let count = columns.count(ticks.len() * CHANGES_PER_TICK_MAX, 3, "number of changes")?;
    let mut place_before = 0;
    for _ in 0..count {
        let place = columns.leb_up_to(ticks.len() as u32 - 1, "tick of a change")? as usize;
        if place < place_before {
            return Err(DecodeError::OutOfRange { field: "tick of a change" });
        }
        place_before = place;
        let kind = columns.byte("change")?;
        let seat = read_seat(columns)?;
        let change = match kind {
            0 => Change::Join(seat, Appearance::read(columns)?),
            1 => Change::Leave(seat),
            2 => Change::Look(seat, Appearance::read(columns)?),
            _ => return Err(DecodeError::OutOfRange { field: "change" }),
        };
        ticks[place].changes.push(change);
    }
    Ok(())
}

fn read_inputs(ticks: &mut [Tick], columns: &mut Reader) -> Result<(), DecodeError> {
    let mut seat_before = None;
    for _ in 0..columns.count(SEATS_MAX, 3, "number of seats")? {
        let seat = read_seat(columns)?;
        if seat_before >= Some(seat) {
            return Err(DecodeError::OutOfRange { field: "seat" });
        }
        seat_before = Some(seat);
        let mut column = Column::new(columns.flag("prediction")?);
        column.read(seat, ticks, columns)?;
    }
    Ok(())
}

/// What one seat holds from tick to tick, and how the next pointer is predicted.
///
/// A column is a list of turns. The low three bits of a turn's byte say what changes, the high five
/// how many ticks nothing did before it, 31 standing for a number that follows.
struct Column {
    /// The pointer is expected to go on as it did, rather than to stay.
    steady: bool,
    now: Option<Input>,
    /// Last known place of the pointer and its last way, quanta.
    place: [i32; 2],
    way: [i32; 2],
}

/// Turn: buttons follow.
const BUTTONS: u8 = 1;
/// Turn: the pointer moved, differences follow.
const MOVED: u8 = 2;
/// Turn: the pointer is gone.
const AWAY: u8 = 4;
/// Turn: the seat has no input any more.
const ABSENT: u8 = 7;
/// A number of quiet ticks follows.
const LONG: u8 = 31;

impl Column {
    fn new(steady: bool) -> Column {
        Column { steady, now: None, place: [0; 2], way: [0; 2] }
    }

    fn write(&mut self, values: &[Option<Input>], out: &mut Writer) {
        let turns = values.iter().scan(None, |before, value| {
            let changed = *before != *value;
            *before = *value;
            Some(changed)
        });
        out.count(turns.filter(|&changed| changed).count());
        let mut quiet = 0u32;
        for &value in values {
            if value == self.now {
                quiet += 1;
                self.way = [0; 2];
                continue;
            }
            self.write_turn(value, quiet, out);
            quiet = 0;
        }
    }

    fn write_turn(&mut self, value: Option<Input>, quiet: u32, out: &mut Writer) {
        let before = self.now.unwrap_or_default();
        let after = value.unwrap_or_default();
        let buttons = if before.buttons == after.buttons { 0 } else { BUTTONS };
        let pointer = match after.pointer {
            same if same == before.pointer => 0,
            Some(_) => MOVED,
            None => AWAY,
        };
        let turn = if value.is_none() { ABSENT } else { buttons | pointer };
        let long = quiet >= u32::from(LONG);
        out.byte(turn | (if long { LONG } else { quiet as u8 }) << 3);
        if long {
            out.leb32(quiet);
        }
        self.now = value;
        if turn == ABSENT {
            return;
        }
        if turn & BUTTONS != 0 {
            out.leb32(u32::from(after.buttons.0));
        }
        if let (MOVED, Some(pointer)) = (pointer, after.pointer) {
            let quanta = in_quanta(pointer);
            let expected = self.expected();
            for axis in 0..2 {
                out.zigzag(quanta[axis] - expected[axis]);
            }
            self.move_to(quanta);
        } else {
            self.way = [0; 2];
        }
    }

    fn read(
        &mut self,
        seat: Seat,
        ticks: &mut [Tick],
        columns: &mut Reader,
    ) -> Result<(), DecodeError> {
        let field = "turns";
        let count = columns.count(ticks.len(), 1, field)?;
        let mut at = 0;
        for _ in 0..count {
            let byte = columns.byte(field)?;
            let quiet = match byte >> 3 {
                LONG => columns.leb_up_to(ticks.len() as u32, field)? as usize,
                quiet => usize::from(quiet),
            };
            if at + quiet >= ticks.len() {
                return Err(DecodeError::OutOfRange { field });
            }
            self.fill(seat, &mut ticks[at..at + quiet]);
            at += quiet;
            self.read_turn(byte & 7, columns)?;
            if let Some(input) = self.now {
                ticks[at].inputs.push((seat, input));
            }
            at += 1;
        }
        self.fill(seat, &mut ticks[at..]);
        Ok(())
    }

    /// Quiet ticks: nothing changes.
    fn fill(&mut self, seat: Seat, ticks: &mut [Tick]) {
        if !ticks.is_empty() {
            self.way = [0; 2];
        }
        if let Some(input) = self.now {
            ticks.iter_mut().for_each(|tick| tick.inputs.push((seat, input)));
        }
    }

    fn read_turn(&mut self, turn: u8, columns: &mut Reader) -> Result<(), DecodeError> {
        if turn == ABSENT {
            self.now = None;
            return Ok(());
        }
        if turn & MOVED != 0 && turn & AWAY != 0 {
            return Err(DecodeError::OutOfRange { field: "turns" });
        }
        let mut input = self.now.unwrap_or_default();
        if turn & BUTTONS != 0 {
            let buttons = columns.leb_up_to(u32::from(Buttons::ALL.0), "buttons")?;
            input.buttons = Buttons(buttons as u16);
        }
        if turn & MOVED != 0 {
            let expected = self.expected();
            let mut quanta = [0; 2];
            for axis in 0..2 {
                quanta[axis] = expected[axis].wrapping_add(columns.zigzag("pointer")?);
                if quanta[axis].unsigned_abs() > QUANTA_MAX.unsigned_abs() {
                    return Err(DecodeError::OutOfRange { field: "pointer" });
                }
            }
            self.move_to(quanta);
            input.pointer = Some(Vec2::new(quanta[0] as f32, quanta[1] as f32) * POINTER_QUANTUM);
        } else {
            self.way = [0; 2];
        }
        if turn & AWAY != 0 {
            input.pointer = None;
        }
        self.now = Some(input);
        Ok(())
    }

    fn expected(&self) -> [i32; 2] {
        let way = if self.steady { self.way } else { [0; 2] };
        [self.place[0] + way[0], self.place[1] + way[1]]
    }

    fn move_to(&mut self, quanta: [i32; 2]) {
        self.way = [quanta[0] - self.place[0], quanta[1] - self.place[1]];
        self.place = quanta;
    }
}

/// A pointer that was rounded to the quantum, in quanta.
fn in_quanta(pointer: Vec2) -> [i32; 2] {
    let quanta = pointer / POINTER_QUANTUM;
    [quanta.x as i32, quanta.y as i32]
}
