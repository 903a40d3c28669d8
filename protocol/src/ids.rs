//! Fields used by both messages and replays: seats, bodies and their kinds.

use crate::error::{DecodeError, check};
use crate::limits::BODIES_MAX;
use crate::wire::{Reader, Writer};
use jostle_game::{Kind, SEATS_MAX, Seat};
use jostle_sim::BodyId;

/// Writes a seat as LEB128: one byte for the first 128.
pub fn write_seat(writer: &mut Writer, seat: Seat) {
    writer.leb32(u32::from(seat.0));
}

/// Reads a seat below [`SEATS_MAX`].
pub fn read_seat(reader: &mut Reader) -> Result<Seat, DecodeError> {
    Ok(Seat(reader.leb_up_to(SEATS_MAX as u32 - 1, "seat")? as u16))
}

/// Writes the id of a body.
pub fn write_id(writer: &mut Writer, id: BodyId) {
    writer.leb32(id.index);
    writer.leb32(id.generation);
}

/// Reads the id of a body, whose index is below [`BODIES_MAX`].
pub fn read_id(reader: &mut Reader, field: &'static str) -> Result<BodyId, DecodeError> {
    let index = reader.leb_up_to(BODIES_MAX as u32 - 1, field)?;
    Ok(BodyId { index, generation: reader.leb32(field)? })
}

/// The kind of a body by its index in [`Kind::ALL`].
pub fn kind_of(byte: u8) -> Result<Kind, DecodeError> {
    let kind = Kind::ALL.get(usize::from(byte)).copied();
    kind.ok_or(DecodeError::OutOfRange { field: "body kind" })
}

/// Reads a 16-bit number as LEB128.
pub fn read_leb16(reader: &mut Reader, field: &'static str) -> Result<u16, DecodeError> {
    Ok(reader.leb_up_to(u32::from(u16::MAX), field)? as u16)
}

/// Fails unless seats increase. `before` is the previous seat in the list.
pub fn check_seat_order(before: Option<Seat>, seat: Seat) -> Result<(), DecodeError> {
    check(before < Some(seat), "seat")
}
