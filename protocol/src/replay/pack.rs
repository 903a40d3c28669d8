//! Compresses the last part of a record.

use crate::error::DecodeError;
use crate::wire::{Reader, Writer};

/// Deflate level. Higher levels take several times as long and save only a few percent.
const LEVEL: u8 = 6;

/// Deflates bytes and writes them as the rest of a record.
pub fn pack(writer: &mut Writer, bytes: &[u8]) {
    writer.raw(&miniz_oxide::deflate::compress_to_vec(bytes, LEVEL));
}

/// Inflates the rest of a record, up to `bytes_max` bytes.
pub fn unpack(
    reader: &mut Reader,
    bytes_max: usize,
    field: &'static str,
) -> Result<Vec<u8>, DecodeError> {
    let packed = reader.raw(reader.remaining(), field)?;
    let unpacked = miniz_oxide::inflate::decompress_to_vec_with_limit(packed, bytes_max);
    #[cfg(test)]
    tests::count(unpacked.as_ref().map_or_else(|error| error.output.len(), Vec::len));
    unpacked.map_err(|_| DecodeError::OutOfRange { field })
}

#[cfg(test)]
pub(super) mod tests {
    use std::cell::Cell;

    thread_local!(static UNPACKED: Cell<usize> = const { Cell::new(0) });

    pub(super) fn count(bytes: usize) {
        UNPACKED.set(UNPACKED.get() + bytes);
    }

    /// Number of bytes unpacked in this thread since the previous call.
    pub fn unpacked() -> usize {
        UNPACKED.take()
    }
}
