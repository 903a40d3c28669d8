//! Bit streams, with the lowest bit of each byte first, and codes for small numbers. There is an adaptive Rice code (as
//! in FLAC and JPEG-LS), because messages are too short for frequency tables, and a code whose width the caller knows.

use crate::error::{DecodeError, check};

/// Largest quotient written in unary; a number with a larger quotient is written in full.
const QUOTIENT_MAX: u32 = 20;
/// Eight times the number expected at the start.
const MEAN_START: u64 = 24;

/// Appends bits, starting with the lowest bit of each byte.
#[derive(Clone, Debug, Default)]
pub struct BitWriter {
    bytes: Vec<u8>,
    count: usize,
}

impl BitWriter {
    /// Removes all bits but keeps the allocation.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.count = 0;
    }

    /// Appends a number's low `count` bits, lowest first.
    pub fn push(&mut self, value: u32, count: u32) {
        let used = self.count % 8;
        // The partial byte and the new bits above it, which are at most 39 bits together.
        let begun = if used > 0 { self.bytes.pop().unwrap_or(0) } else { 0 };
        let low = u64::from(value) & ((1 << count) - 1);
        let bits = u64::from(begun) | low << used;
        self.count += count as usize;
        let bytes = (used + count as usize).div_ceil(8);
        self.bytes.extend_from_slice(&bits.to_le_bytes()[..bytes]);
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// The bytes, with the last one padded with zeros.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the bytes, with the last one padded with zeros.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Reads bits, starting from the front.
#[derive(Clone, Debug)]
pub struct BitReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> BitReader<'a> {
    /// Creates a reader at the start of `bytes`.
    pub fn new(bytes: &'a [u8]) -> BitReader<'a> {
        BitReader { bytes, at: 0 }
    }

    /// Reads the next `count` bits as a number.
    pub fn take(&mut self, count: u32, field: &'static str) -> Result<u32, DecodeError> {
        let used = self.at % 8;
        let end = (self.at + count as usize).div_ceil(8);
        let bytes = self.bytes.get(self.at / 8..end).ok_or(DecodeError::Truncated { field })?;
        let high_first = bytes.iter().rev();
        let bits = high_first.fold(0u64, |bits, &byte| bits << 8 | u64::from(byte));
        self.at += count as usize;
        Ok((bits >> used & ((1 << count) - 1)) as u32)
    }

    /// Returns the bytes after the last one read. That byte's unread bits must be zero.
    pub fn rest(mut self, field: &'static str) -> Result<&'a [u8], DecodeError> {
        let unused = self.at.next_multiple_of(8) - self.at;
        check(self.take(unused as u32, field)? == 0, field)?;
        Ok(&self.bytes[self.at / 8..])
    }

    /// Fails if any bits are left over, except zeros in the last byte.
    pub fn end(self, field: &'static str) -> Result<(), DecodeError> {
        match self.rest(field)?.len() {
            0 => Ok(()),
            count => Err(DecodeError::Trailing { count }),
        }
    }
}

/// An adaptive Rice code for a sequence of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Rice {
    /// Eight times the running mean of the numbers so far.
    mean: u64,
}

impl Rice {
    /// Creates an untrained code.
    pub fn new() -> Rice {
        Rice { mean: MEAN_START }
    }

    /// Number of low bits written verbatim, so that the unary part stays short.
    fn plain_bits(self) -> u32 {
        let mut bits = 0;
        while bits < 31 && 80u64 << bits < self.mean * 7 {
            bits += 1;
        }
        bits
    }

    fn learn(&mut self, folded: u32) {
        self.mean = self.mean - (self.mean >> 3) + u64::from(folded);
    }

    pub fn write(&mut self, value: i32, out: &mut BitWriter) {
        let folded = fold(value);
        let plain = self.plain_bits();
        let quotient = folded >> plain;
        if quotient < QUOTIENT_MAX {
            out.push((1 << quotient) - 1, quotient + 1);
            out.push(folded, plain);
        } else {
            out.push((1 << QUOTIENT_MAX) - 1, QUOTIENT_MAX);
            out.push(folded, 32);
        }
        self.learn(folded);
    }

    pub fn read(&mut self, bits: &mut BitReader, field: &'static str) -> Result<i32, DecodeError> {
        let plain = self.plain_bits();
        let mut quotient = 0;
        while quotient < QUOTIENT_MAX && bits.take(1, field)? == 1 {
            quotient += 1;
        }
        let folded = match quotient {
            QUOTIENT_MAX => bits.take(32, field)?,
            _ => {
                check(quotient <= u32::MAX >> plain, field)?;
                quotient << plain | bits.take(plain, field)?
            }
        };
        self.learn(folded);
        Ok(unfold(folded))
    }
}

/// Maps 0, -1, 1, -2, ... to 0, 1, 2, 3, ...
pub fn fold(value: i32) -> u32 {
    (value << 1 ^ value >> 31) as u32
}

/// The inverse of [`fold`].
pub fn unfold(folded: u32) -> i32 {
    (folded >> 1) as i32 ^ -((folded & 1) as i32)
}

/// Appends a number from 0 to 2^31 - 1 in the exponential Golomb code: first the number of bits of value + 1 after the
/// leading one, in unary, then those bits.
pub fn write_golomb(value: u32, out: &mut BitWriter) {
    let one_more = value + 1;
    let length = one_more.ilog2();
    out.push((1 << length) - 1, length + 1);
    out.push(one_more, length);
}

/// Reads a number written by [`write_golomb`].
pub fn read_golomb(bits: &mut BitReader, field: &'static str) -> Result<u32, DecodeError> {
    let mut length = 0;
    while bits.take(1, field)? == 1 {
        length += 1;
        check(length <= 31, field)?;
    }
    let low = bits.take(length, field)?;
    Ok((1 << length | low) - 1)
}

/// Largest high part written in unary; the remainder of a larger one uses the exponential Golomb code.
const HIGH_MAX: u32 = 4;

/// Appends a number of about `width` bits, 0..=30: the low bits verbatim, and the high part in unary if it is small.
pub fn write_wide(value: u32, width: u32, out: &mut BitWriter) {
    let high = value >> width;
    if high < HIGH_MAX {
        out.push((1 << high) - 1, high + 1);
    } else {
        out.push((1 << HIGH_MAX) - 1, HIGH_MAX);
        write_golomb(high - HIGH_MAX, out);
    }
    out.push(value, width);
}

/// Reads a number written by [`write_wide`].
pub fn read_wide(
    bits: &mut BitReader,
    width: u32,
    field: &'static str,
) -> Result<u32, DecodeError> {
    let mut high = 0;
    while high < HIGH_MAX && bits.take(1, field)? == 1 {
        high += 1;
    }
    if high == HIGH_MAX {
        let more = read_golomb(bits, field)?;
        high = more.checked_add(HIGH_MAX).ok_or(DecodeError::OutOfRange { field })?;
    }
    check(high <= u32::MAX >> width, field)?;
    Ok(high << width | bits.take(width, field)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_sim::Rng;

    /// Numbers of all sizes, in phases.
    fn numbers() -> Vec<i32> {
        let mut rng = Rng::new(3, 0);
        let mut numbers = vec![0, -1, 1, i32::MAX, i32::MIN, 0, 0, -5];
        for phase in 0..400 {
            let shift = phase * 7 % 32;
            numbers.extend((0..20).map(|_| rng.next_u32() as i32 >> shift));
        }
        numbers
    }

    fn coded(numbers: &[i32]) -> BitWriter {
        let (mut rice, mut out) = (Rice::new(), BitWriter::default());
        numbers.iter().for_each(|&number| rice.write(number, &mut out));
        out
    }

    #[test]
    fn numbers_round_trip() {
        let numbers = numbers();
        let bytes = coded(&numbers).finish();
        let (mut rice, mut bits) = (Rice::new(), BitReader::new(&bytes));
        for number in numbers {
            assert_eq!(rice.read(&mut bits, "number"), Ok(number));
        }
        assert_eq!(bits.end("number"), Ok(()));
    }

    #[test]
    fn wide_numbers_round_trip_with_any_width() {
        for width in 0..=30 {
            let mut out = BitWriter::default();
            let numbers = numbers();
            numbers.iter().for_each(|&number| write_wide(fold(number), width, &mut out));
            let bytes = out.finish();
            let mut bits = BitReader::new(&bytes);
            for &number in &numbers {
                assert_eq!(read_wide(&mut bits, width, "number").map(unfold), Ok(number));
            }
            assert_eq!(bits.rest("number"), Ok(&[][..]));
        }
    }

    #[test]
    fn small_numbers_take_few_bits() {
        let mut rng = Rng::new(4, 0);
        let small: Vec<_> = (0..1000).map(|_| rng.below(7) as i32 - 3).collect();
        assert!(coded(&small).count() < 3600, "{}", coded(&small).count());
        assert!(coded(&[0; 1000]).count() < 1020);
    }

    #[test]
    fn missing_and_left_over_bits_are_refused() {
        let bytes = coded(&[1, 2, 3, 4, 5]).finish();
        let mut rice = Rice::new();
        let mut bits = BitReader::new(&bytes[..1]);
        let read: Result<Vec<_>, _> = (0..5).map(|_| rice.read(&mut bits, "number")).collect();
        assert_eq!(read, Err(DecodeError::Truncated { field: "number" }));
        assert!(BitReader::new(&bytes).end("number").is_err());
        assert_eq!(BitReader::new(&[2]).end("number"), Err(DecodeError::Trailing { count: 1 }));
    }

    #[test]
    fn any_bits_are_safe_to_read() {
        let mut rng = Rng::new(5, 0);
        for _ in 0..20_000 {
            let bytes: Vec<u8> = (0..rng.below(40)).map(|_| rng.next_u32() as u8 | 0x11).collect();
            let (mut rice, mut bits) = (Rice::new(), BitReader::new(&bytes));
            while rice.read(&mut bits, "number").is_ok() {}
            for width in [0, 7, 30] {
                let mut bits = BitReader::new(&bytes);
                while read_wide(&mut bits, width, "number").is_ok() {}
            }
        }
    }
}
