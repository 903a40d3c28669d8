//! Moves of points: the centres of bodies and players' pointers. A move is coded against the point's positions in the
//! last four snapshots, which both ends have. These positions determine the expected position and the number of bits
//! for the difference from it, so no other side information is needed.
//!
//! A point that moved within the four snapshots takes one bit if it is at its expected position, and otherwise one bit
//! and two numbers. A point at rest takes nothing until it wakes.

use crate::bits::{
    BitReader, BitWriter, fold, read_golomb, read_wide, unfold, write_golomb, write_wide,
};
use crate::error::{DecodeError, check};
use crate::limits::QUANTA_MAX;
use crate::position_history::{Position, PositionHistory};
use crate::wire::Reader;

/// Number of low bits in the first move of a point that was at rest.
const WAKE_WIDTH: u32 = 2;
/// Number of low bits for the difference from the expected position along each axis: enough for three eighths of the
/// recent change between displacements.
fn widths(history: &PositionHistory) -> [u32; 2] {
    [0, 1].map(|axis| {
        let [one, two, three] = history.displacements(axis);
        let changes = (one - two).unsigned_abs() + (two - three).unsigned_abs();
        u32::BITS - (3 * changes / 8).leading_zeros()
    })
}

/// A point that was at rest until now.
#[derive(Clone, Debug)]
struct Woken {
    /// Number of resting points before this one, including those that have woken.
    before: u32,
    from: Position,
    to: Position,
}

/// The encoder for moves. Its memory is reused from one message to the next.
#[derive(Clone, Debug, Default)]
pub struct MoveEncoder {
    bits: BitWriter,
    woken: Vec<Woken>,
}

impl MoveEncoder {
    /// Encodes the moves of points, each given with its history and current position; `None` if all are at their
    /// expected positions.
    pub fn encode<'a>(
        &mut self,
        points: impl Iterator<Item = (&'a PositionHistory, Position)>,
    ) -> Option<&[u8]> {
        let MoveEncoder { bits, woken } = self;
        bits.clear();
        woken.clear();
        let (mut surprising, mut asleep) = (false, 0);
        for (history, position) in points {
            if history.is_moving() {
                let expected = history.expected();
                let is_elsewhere = position != expected;
                bits.push(u32::from(is_elsewhere), 1);
                if is_elsewhere {
                    write_move(expected, position, widths(history), bits);
                    surprising = true;
                }
            } else {
                if position != history.position() {
                    woken.push(Woken { before: asleep, from: history.position(), to: position });
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

/// Writes the number of woken points, and then, for each one, the number of resting points since the previous one and
/// its move.
fn write_woken(asleep: u32, woken: &[Woken], bits: &mut BitWriter) {
    write_golomb(woken.len() as u32, bits);
    let width = gap_width(asleep as usize, woken.len());
    let mut next = 0;
    for Woken { before, from, to } in woken {
        write_wide(before - next, width, bits);
        write_move(*from, *to, [WAKE_WIDTH; 2], bits);
        next = before + 1;
    }
}

fn write_move(from: Position, to: Position, widths: [u32; 2], bits: &mut BitWriter) {
    for axis in 0..2 {
        write_wide(fold(to[axis] - from[axis]), widths[axis], bits);
    }
}

/// Number of low bits for a gap among `rest` resting points if `count` of them wake: as many as the mean gap needs.
fn gap_width(rest: usize, count: usize) -> u32 {
    (rest / (count + 1)).max(1).ilog2()
}

/// Reads the output of [`MoveEncoder::encode`], and returns the points' positions.
pub fn read<'a>(
    histories: impl Iterator<Item = &'a PositionHistory>,
    reader: &mut Reader,
) -> Result<Vec<Position>, DecodeError> {
    let mut bits = BitReader::new(reader.rest());
    let mut positions: Vec<Position> = Vec::with_capacity(histories.size_hint().0);
    let (mut surprising, mut asleep) = (false, Vec::with_capacity(histories.size_hint().0));
    for history in histories {
        let mut position = history.position();
        if !history.is_moving() {
            asleep.push(positions.len());
        } else {
            position = history.expected();
            if bits.take(1, "move")? == 1 {
                position = read_move(position, widths(history), &mut bits)?;
                surprising = true;
            }
        }
        positions.push(position);
    }
    surprising |= read_woken(&asleep, &mut positions, &mut bits)? > 0;
    let left = bits.rest("moves")?.len();
    reader.raw(reader.remaining() - left, "moves")?;
    check(surprising, "moves")?;
    Ok(positions)
}

/// Reads the woken points, and returns their number.
fn read_woken(
    asleep: &[usize],
    positions: &mut [Position],
    bits: &mut BitReader,
) -> Result<usize, DecodeError> {
    let field = "woken";
    let count = read_golomb(bits, field)? as usize;
    check(count <= asleep.len(), field)?;
    let width = gap_width(asleep.len(), count);
    let mut rest = asleep;
    for _ in 0..count {
        let gap = read_wide(bits, width, field)? as usize;
        let (&index, after) = rest
            .get(gap..)
            .and_then(<[usize]>::split_first)
            .ok_or(DecodeError::OutOfRange { field })?;
        positions[index] = read_move(positions[index], [WAKE_WIDTH; 2], bits)?;
        rest = after;
    }
    Ok(count)
}

/// Reads the end of a move, which must differ from its start.
fn read_move(
    from: Position,
    widths: [u32; 2],
    bits: &mut BitReader,
) -> Result<Position, DecodeError> {
    let mut to = from;
    for (axis, width) in to.iter_mut().zip(widths) {
        *axis = axis
            .checked_add(unfold(read_wide(bits, width, "move")?))
            .filter(|sum| (-QUANTA_MAX..=QUANTA_MAX).contains(sum))
            .ok_or(DecodeError::OutOfRange { field: "move" })?;
    }
    check(to != from, "move")?;
    Ok(to)
}
