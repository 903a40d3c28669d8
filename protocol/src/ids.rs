//! Fields that both messages and replays use: seats, bodies and body kinds.

use crate::error::{DecodeError, check};
use crate::limits::BODIES_MAX;
use crate::wire::{Reader, Writer};
use jostle_game::{Kind, SEATS_MAX, Seat};
use jostle_sim::BodyId;

/// Writes a seat as LEB128, which takes one byte for each of the first 128 seats.
pub fn write_seat(writer: &mut Writer, seat: Seat) {
    writer.leb32(u32::from(seat.0));
}

/// Reads a seat below [`SEATS_MAX`].
pub fn read_seat(reader: &mut Reader) -> Result<Seat, DecodeError> {
    Ok(Seat(reader.leb_up_to(SEATS_MAX as u32 - 1, "seat")? as u16))
}

/// Writes a body's id.
pub fn write_id(writer: &mut Writer, id: BodyId) {
    writer.leb32(id.index);
    writer.leb32(id.generation);
}

/// Reads a body's id, whose index is below [`BODIES_MAX`].
pub fn read_id(reader: &mut Reader, field: &'static str) -> Result<BodyId, DecodeError> {
    let index = reader.leb_up_to(BODIES_MAX as u32 - 1, field)?;
    Ok(BodyId { index, generation: reader.leb32(field)? })
}

/// A body's kind, given by its index in [`Kind::ALL`].
pub fn kind_of(byte: u8) -> Result<Kind, DecodeError> {
    let kind = Kind::ALL.get(usize::from(byte)).copied();
    kind.ok_or(DecodeError::OutOfRange { field: "body kind" })
}

/// Reads a 16-bit number as LEB128.
pub fn read_leb16(reader: &mut Reader, field: &'static str) -> Result<u16, DecodeError> {
    Ok(reader.leb_up_to(u32::from(u16::MAX), field)? as u16)
}

/// Fails unless seats are in increasing order. `before` is the previous seat in the list.
pub fn check_seat_order(before: Option<Seat>, seat: Seat) -> Result<(), DecodeError> {
    check(before < Some(seat), "seat")
}
