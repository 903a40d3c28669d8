//! A seat inside a message or a replay: LEB128, one byte for the first 128.

use crate::wire::{DecodeError, Reader, Writer};
use jostle_sim::{SEATS_MAX, Seat};

/// Writes a seat. What is no seat is refused by the reader.
pub fn write_seat(writer: &mut Writer, seat: Seat) {
    writer.leb32(u32::from(seat.0));
}

/// Reads a seat below [`SEATS_MAX`].
pub fn read_seat(reader: &mut Reader) -> Result<Seat, DecodeError> {
    Ok(Seat(reader.leb_up_to(SEATS_MAX as u32 - 1, "seat")? as u16))
}
