//! Points that move: centres of bodies and players' pointers. The code of a move is a pure function
//! of where the point was in the last four snapshots, which both ends hold: how fast it is, whether
//! it moves at all and how many bits the surprise will take come out of those four, so nothing else
//! is sent, kept or learned.
//!
//! A point that moved within the last three snapshots takes one bit if it is where it was expected,
//! else one bit and two numbers. One that was at rest takes nothing until it wakes.

use crate::bits::{
    BitReader, BitWriter, fold, read_golomb, read_wide, unfold, write_golomb, write_wide,
};
use crate::limits::QUANTA_MAX;
use crate::wire::{DecodeError, Reader};

/// A place in quanta.
pub type Place = [i32; 2];

/// Low bits of the first move of a point that was at rest.
const WAKE_WIDTH: u32 = 2;
/// A way of so many quanta or less is the trembling of something at rest, not a speed.
const TREMBLING: i32 = 1;

/// Where a point was in the four newest snapshots, the newest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trail([Place; 4]);

impl Trail {
    /// Of a point that is new: as if it had always been there.
    pub fn resting(place: Place) -> Trail {
        Trail([place; 4])
    }

    /// Where it is.
    pub fn place(&self) -> Place {
        self.0[0]
    }

    /// The next snapshot has it here.
    pub fn go(&mut self, place: Place) {
        let [newest, second, third, _] = self.0;
        self.0 = [place, newest, second, third];
    }

    /// Whether it moved lately.
    pub fn is_moving(&self) -> bool {
        let [newest, older @ ..] = self.0;
        // One branch instead of six: this is asked of every point, and most are at rest.
        let apart = |[x, y]: Place| x ^ newest[0] | y ^ newest[1];
        apart(older[0]) | apart(older[1]) | apart(older[2]) != 0
    }

    /// The last three ways along an axis, the newest first.
    fn ways(&self, axis: usize) -> [i32; 3] {
        let at = |age: usize| self.0[age][axis];
        [at(0) - at(1), at(1) - at(2), at(2) - at(3)]
    }

    /// Where it is next if it goes on as in the last snapshot.
    pub fn expected(&self) -> Place {
        let along = |axis: usize| {
            let [way, ..] = self.ways(axis);
            let way = if way.abs() <= TREMBLING { 0 } else { way };
            (self.0[0][axis] + way).clamp(-QUANTA_MAX, QUANTA_MAX)
        };
        [along(0), along(1)]
    }

    /// Low bits of the surprise along an axis: of three eighths of how much the ways changed.
    fn width(&self, axis: usize) -> u32 {
        let [one, two, three] = self.ways(axis);
        let changes = (one - two).unsigned_abs() + (two - three).unsigned_abs();
        u32::BITS - (3 * changes / 8).leading_zeros()
    }
}

/// A point that was at rest and is not any more.
#[derive(Clone, Debug)]
struct Woken {
    /// Sleepers before it, whether they wake or not.
    before: u32,
    from: Place,
    to: Place,
}

/// Coded moves, in memory that is used again for the next message's.
#[derive(Clone, Debug, Default)]
pub struct Moves {
    bits: BitWriter,
    woken: Vec<Woken>,
}

impl Moves {
    /// The moves of points, each with its trail and where it is now; `None` if all are where they are
    /// expected.
    pub fn code<'a>(&mut self, points: impl Iterator<Item = (&'a Trail, Place)>) -> Option<&[u8]> {
        let Moves { bits, woken } = self;
        bits.clear();
        woken.clear();
        let (mut surprising, mut asleep) = (false, 0);
        for (trail, place) in points {
            if trail.is_moving() {
                let expected = trail.expected();
                let is_elsewhere = place != expected;
                bits.push(u32::from(is_elsewhere), 1);
                if is_elsewhere {
                    write_way(expected, place, [trail.width(0), trail.width(1)], bits);
                    surprising = true;
                }
            } else {
                if place != trail.place() {
                    woken.push(Woken { before: asleep, from: trail.place(), to: place });
                }
                asleep += 1;
            }
        }
        if !surprising && woken.is_empty() {
            return None;
        }
        write_woken(asleep, woken, bits);
        Some(bits.bytes())
    }
}

/// How many woke; then for each how many slept on before it, and its way.
fn write_woken(asleep: u32, woken: &[Woken], bits: &mut BitWriter) {
    write_golomb(woken.len() as u32, bits);
    let width = gap_width(asleep as usize, woken.len());
    let mut next = 0;
    for Woken { before, from, to } in woken {
        write_wide(before - next, width, bits);
        write_way(*from, *to, [WAKE_WIDTH; 2], bits);
        next = before + 1;
    }
}

fn write_way(from: Place, to: Place, widths: [u32; 2], bits: &mut BitWriter) {
    for axis in 0..2 {
        write_wide(fold(to[axis] - from[axis]), widths[axis], bits);
    }
}

/// Low bits of a gap among `rest` sleepers of which `count` wake: of the mean gap.
fn gap_width(rest: usize, count: usize) -> u32 {
    (rest / (count + 1)).max(1).ilog2()
}

/// Where the points are now; what [`Moves::code`] made is taken off the reader.
pub fn read<'a>(
    trails: impl Iterator<Item = &'a Trail>,
    reader: &mut Reader,
) -> Result<Vec<Place>, DecodeError> {
    let mut bits = BitReader::new(reader.rest());
    let mut places: Vec<Place> = Vec::with_capacity(trails.size_hint().0);
    let (mut surprising, mut asleep) = (false, Vec::with_capacity(trails.size_hint().0));
    for trail in trails {
        let mut place = trail.place();
        if !trail.is_moving() {
            asleep.push(places.len());
        } else {
            place = trail.expected();
            if bits.take(1, "move")? == 1 {
                place = read_way(place, [trail.width(0), trail.width(1)], &mut bits)?;
                surprising = true;
            }
        }
        places.push(place);
    }
    surprising |= read_woken(&asleep, &mut places, &mut bits)? > 0;
    let left = bits.rest("moves")?.len();
    reader.raw(reader.remaining() - left, "moves")?;
    if surprising { Ok(places) } else { Err(DecodeError::OutOfRange { field: "moves" }) }
}

/// How many woke.
fn read_woken(
    asleep: &[usize],
    places: &mut [Place],
    bits: &mut BitReader,
) -> Result<usize, DecodeError> {
    let field = "woken";
    let count = read_golomb(bits, field)? as usize;
    if count > asleep.len() {
        return Err(DecodeError::OutOfRange { field });
    }
    let width = gap_width(asleep.len(), count);
    let mut rest = asleep;
    for _ in 0..count {
        let gap = read_wide(bits, width, field)? as usize;
        let (&index, after) = rest
            .get(gap..)
            .and_then(<[usize]>::split_first)
            .ok_or(DecodeError::OutOfRange { field })?;
        places[index] = read_way(places[index], [WAKE_WIDTH; 2], bits)?;
        rest = after;
    }
    Ok(count)
}

/// The end of a way that is not zero.
fn read_way(from: Place, widths: [u32; 2], bits: &mut BitReader) -> Result<Place, DecodeError> {
    let mut to = from;
    for (axis, width) in to.iter_mut().zip(widths) {
        *axis = axis
            .checked_add(unfold(read_wide(bits, width, "move")?))
            .filter(|sum| (-QUANTA_MAX..=QUANTA_MAX).contains(sum))
            .ok_or(DecodeError::OutOfRange { field: "move" })?;
    }
    if to == from { Err(DecodeError::OutOfRange { field: "move" }) } else { Ok(to) }
}
