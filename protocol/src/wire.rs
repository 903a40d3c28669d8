//! A bounds-checked reader for fields, and the matching writer. Numbers are little-endian or LEB128; only the shortest
//! LEB128 form is accepted. This module does not depend on any message.

use crate::bits::{fold, unfold};
use crate::error::{DecodeError, check};
use crate::limits::QUANTA_MAX;
use jostle_sim::Vec2;

/// Appends fields to a message.
#[derive(Clone, Debug, Default)]
pub struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// Creates an empty message.
    pub fn new() -> Writer {
        Writer::default()
    }

    /// Removes everything written so far but keeps the allocation.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }

    /// The message so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the message's bytes.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    /// Writes one byte unchanged.
    pub fn byte(&mut self, value: u8) {
        self.bytes.push(value);
    }

    /// Writes a byte that is 0 or 1.
    pub fn flag(&mut self, value: bool) {
        self.byte(u8::from(value));
    }

    /// Writes two bytes, little-endian.
    pub fn fixed16(&mut self, value: u16) {
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes four bytes, little-endian.
    pub fn fixed32(&mut self, value: u32) {
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes eight bytes, little-endian.
    pub fn fixed64(&mut self, value: u64) {
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// Writes a number as LEB128, which takes 1 to 5 bytes.
    pub fn leb32(&mut self, value: u32) {
        self.leb64(u64::from(value));
    }

    /// Writes a number as LEB128, which takes 1 to 10 bytes.
    pub fn leb64(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.byte(value as u8 | 0x80);
            value >>= 7;
        }
        self.byte(value as u8);
    }

    /// Writes a length or count as LEB128. Panics if it exceeds `u32::MAX`, which is far above any limit.
    pub fn count(&mut self, value: usize) {
        self.leb32(u32::try_from(value).expect("counts are limited far below u32::MAX"));
    }

    /// Writes a signed number as LEB128, where 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
    pub fn zigzag(&mut self, value: i32) {
        self.leb32(fold(value));
    }

    /// Writes two signed numbers, each in zigzag form.
    pub fn quanta(&mut self, value: [i32; 2]) {
        value.into_iter().for_each(|axis| self.zigzag(axis));
    }

    /// Writes the four bytes of a finite number. Panics on other numbers, because the reader would refuse them.
    pub fn finite(&mut self, value: f32) {
        assert!(value.is_finite(), "{value} cannot travel");
        self.fixed32(value.to_bits());
    }

    /// Writes two finite numbers, which take eight bytes.
    pub fn point(&mut self, value: Vec2) {
        self.finite(value.x);
        self.finite(value.y);
    }

    /// Writes a length and UTF-8 text. Panics if the text exceeds `bytes_max` bytes, because the reader would refuse
    /// it.
    pub fn text(&mut self, value: &str, bytes_max: usize) {
        let bytes = value.len();
        assert!(bytes <= bytes_max, "text of {bytes} bytes exceeds {bytes_max}");
        self.count(bytes);
        self.bytes.extend_from_slice(value.as_bytes());
    }

    /// Writes bytes without their length.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// Writes a flag, followed by the value if it is `Some`.
    pub fn option<T>(&mut self, value: Option<T>, write: impl FnOnce(&mut Writer, T)) {
        self.flag(value.is_some());
        if let Some(value) = value {
            write(self, value);
        }
    }

    /// Writes one bit per item, lowest bit first. The last byte is padded with zeros.
    pub fn bits(&mut self, items: impl Iterator<Item = bool>) {
        let (mut byte, mut used) = (0u8, 0);
        for item in items {
            byte |= u8::from(item) << used;
            used += 1;
            if used == 8 {
                self.byte(byte);
                (byte, used) = (0, 0);
            }
        }
        if used > 0 {
            self.byte(byte);
        }
    }
}

/// Reads fields from the front of a message. When a method fails, its error names the field.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    /// Creates a reader at the start of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Reader<'a> {
        Reader { bytes }
    }

    /// Number of bytes left.
    pub fn remaining(&self) -> usize {
        self.bytes.len()
    }

    /// The remaining bytes, which stay unread.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes
    }

    /// Reads the next `count` bytes.
    pub fn raw(&mut self, count: usize, field: &'static str) -> Result<&'a [u8], DecodeError> {
        let (taken, rest) =
            self.bytes.split_at_checked(count).ok_or(DecodeError::Truncated { field })?;
        self.bytes = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], DecodeError> {
        let (taken, rest) =
            self.bytes.split_first_chunk::<N>().ok_or(DecodeError::Truncated { field })?;
        self.bytes = rest;
        Ok(*taken)
    }

    /// Reads one byte of any value.
    pub fn byte(&mut self, field: &'static str) -> Result<u8, DecodeError> {
        Ok(self.array::<1>(field)?[0])
    }

    /// Reads a byte that must be 0 or 1.
    pub fn flag(&mut self, field: &'static str) -> Result<bool, DecodeError> {
        let byte = self.byte(field)?;
        check(byte <= 1, field)?;
        Ok(byte == 1)
    }

    /// Reads a flag, followed by the value if the flag is set. See [`Writer::option`].
    pub fn option<T>(
        &mut self,
        field: &'static str,
        read: impl FnOnce(&mut Reader<'a>) -> Result<T, DecodeError>,
    ) -> Result<Option<T>, DecodeError> {
        let is_some = self.flag(field)?;
        is_some.then(|| read(self)).transpose()
    }

    /// Reads two bytes, little-endian.
    pub fn fixed16(&mut self, field: &'static str) -> Result<u16, DecodeError> {
        Ok(u16::from_le_bytes(self.array(field)?))
    }

    /// Reads four bytes, little-endian.
    pub fn fixed32(&mut self, field: &'static str) -> Result<u32, DecodeError> {
        Ok(u32::from_le_bytes(self.array(field)?))
    }

    /// Reads eight bytes, little-endian.
    pub fn fixed64(&mut self, field: &'static str) -> Result<u64, DecodeError> {
        Ok(u64::from_le_bytes(self.array(field)?))
    }

    /// Reads a LEB128 number up to `u32::MAX`.
    pub fn leb32(&mut self, field: &'static str) -> Result<u32, DecodeError> {
        u32::try_from(self.leb64(field)?).map_err(|_| DecodeError::OutOfRange { field })
    }

    /// Reads a LEB128 number up to `u64::MAX`; only the shortest form is accepted.
    pub fn leb64(&mut self, field: &'static str) -> Result<u64, DecodeError> {
        let mut value = 0u64;
        for shift in (0..u64::BITS).step_by(7) {
            let byte = self.byte(field)?;
            let group = u64::from(byte & 0x7f);
            let fits = (group << shift) >> shift == group;
            let shortest = byte != 0 || shift == 0;
            check(fits && shortest, field)?;
            value |= group << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(DecodeError::OutOfRange { field })
    }

    /// Reads a LEB128 number up to `value_max`.
    pub fn leb_up_to(&mut self, value_max: u32, field: &'static str) -> Result<u32, DecodeError> {
        let value = self.leb32(field)?;
        check(value <= value_max, field)?;
        Ok(value)
    }

    /// Reads a count of items of at least `bytes_each` bytes. Fails before anything is allocated if the count exceeds
    /// `count_max` or the items cannot fit in the rest of the message.
    pub fn count(
        &mut self,
        count_max: usize,
        bytes_each: usize,
        field: &'static str,
    ) -> Result<usize, DecodeError> {
        let count = self.leb32(field)? as usize;
        check(count <= count_max, field)?;
        if count > self.remaining() / bytes_each {
            return Err(DecodeError::Truncated { field });
        }
        Ok(count)
    }

    /// Reads a count that is at least 1, for a section that is omitted when empty.
    pub fn some_count(
        &mut self,
        count_max: usize,
        bytes_each: usize,
        field: &'static str,
    ) -> Result<usize, DecodeError> {
        let count = self.count(count_max, bytes_each, field)?;
        check(count > 0, field)?;
        Ok(count)
    }

    /// Reads a signed number. See [`Writer::zigzag`].
    pub fn zigzag(&mut self, field: &'static str) -> Result<i32, DecodeError> {
        Ok(unfold(self.leb32(field)?))
    }

    /// Reads two signed numbers within [`QUANTA_MAX`].
    pub fn quanta(&mut self, field: &'static str) -> Result<[i32; 2], DecodeError> {
        let quanta = [self.zigzag(field)?, self.zigzag(field)?];
        check(quanta.iter().all(|axis| (-QUANTA_MAX..=QUANTA_MAX).contains(axis)), field)?;
        Ok(quanta)
    }

    /// Reads a number that must be finite.
    pub fn finite(&mut self, field: &'static str) -> Result<f32, DecodeError> {
        let value = f32::from_bits(self.fixed32(field)?);
        check(value.is_finite(), field)?;
        Ok(value)
    }

    /// Reads two numbers that must be finite.
    pub fn point(&mut self, field: &'static str) -> Result<Vec2, DecodeError> {
        Ok(Vec2::new(self.finite(field)?, self.finite(field)?))
    }

    /// Reads a length and UTF-8 text of at most `bytes_max` bytes.
    pub fn text(&mut self, bytes_max: usize, field: &'static str) -> Result<&'a str, DecodeError> {
        let bytes = self.count(bytes_max, 1, field)?;
        str::from_utf8(self.raw(bytes, field)?).map_err(|_| DecodeError::OutOfRange { field })
    }

    /// Reads `count` bits, lowest bit first. The padding in the last byte must be zero.
    pub fn bits(&mut self, count: usize, field: &'static str) -> Result<Vec<bool>, DecodeError> {
        let bytes = self.raw(count.div_ceil(8), field)?;
        let bit = |index: usize| bytes[index / 8] >> (index % 8) & 1 == 1;
        check(!(count..8 * bytes.len()).any(bit), field)?;
        Ok((0..count).map(bit).collect())
    }

    /// Fails if any bytes are left over.
    pub fn end(self) -> Result<(), DecodeError> {
        match self.remaining() {
            0 => Ok(()),
            count => Err(DecodeError::Trailing { count }),
        }
    }
}

/// A strictly increasing list of numbers, each coded as its distance from the smallest possible value.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gaps {
    next: u32,
}

impl Gaps {
    /// Writes the next number. Panics unless it is larger than the previous one.
    pub fn write(&mut self, writer: &mut Writer, value: u32) {
        assert!(value >= self.next, "{value} must be at least {}", self.next);
        writer.leb32(value - self.next);
        self.next = value + 1;
    }

    /// Reads the next number, which must be below `end`.
    pub fn read(
        &mut self,
        reader: &mut Reader,
        end: usize,
        field: &'static str,
    ) -> Result<u32, DecodeError> {
        let value = self
            .next
            .checked_add(reader.leb32(field)?)
            .filter(|&value| (value as usize) < end && value < u32::MAX)
            .ok_or(DecodeError::OutOfRange { field })?;
        self.next = value + 1;
        Ok(value)
    }
}

#[cfg(test)]
mod tests;
