//! Saved states as bytes: fixed-size little-endian words. Saved bytes may come from anywhere, so
//! every number is checked where it is read.

use super::Subject;
use super::io::{Field, StateIo};
use crate::body::BodyId;
use crate::hash::StateHasher;
use glam::Vec2;

/// Reason why bytes are no valid state of this scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("byte {at} of the state: {field} is {problem}")]
pub struct StateError {
    /// Offset of the field.
    pub at: usize,
    /// Name of the field.
    pub field: &'static str,
    /// "missing" or "out of range".
    pub problem: &'static str,
}

/// Above every number of a game, and small enough that a step with it stays finite.
pub const PLAUSIBLE_MAX: f32 = 1e9;
/// In place of an index: no body.
const NOBODY: u32 = u32::MAX;

/// Writes a state as bytes.
#[derive(Default)]
pub struct StateWriter(/** The bytes so far. */ pub Vec<u8>);

impl StateWriter {
    /// Appends one byte, unchanged.
    pub fn byte(&mut self, value: u8) {
        self.0.push(value);
    }

    /// Appends 16 bits.
    pub fn short(&mut self, value: u16) {
        self.0.extend(value.to_le_bytes());
    }

    /// Appends 32 bits.
    pub fn word(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    /// Appends 64 bits.
    pub fn long(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    /// Appends the bits of a number.
    pub fn number(&mut self, value: f32) {
        self.word(value.to_bits());
    }

    /// Appends the bits of both components.
    pub fn vector(&mut self, value: Vec2) {
        self.number(value.x);
        self.number(value.y);
    }

    /// Appends a body's id, or none.
    pub fn body(&mut self, body: Option<BodyId>) {
        self.word(body.map_or(NOBODY, |id| id.index));
        self.word(body.map_or(0, |id| id.generation));
    }
}

/// Reads a state from bytes, and names the field where it is wrong.
pub struct StateReader<'a> {
    bytes: &'a [u8],
    at: usize,
    error: Option<StateError>,
}

impl<'a> StateReader<'a> {
    /// Creates a reader at the first byte.
    pub fn new(bytes: &'a [u8]) -> StateReader<'a> {
        StateReader { bytes, at: 0, error: None }
    }

    /// Returns the error for the field that was read last.
    pub fn wrong(&self, field: &'static str) -> StateError {
        StateError { at: self.at, field, problem: "out of range" }
    }

    /// Fails for the field that was read last unless `fine`.
    pub fn check(&mut self, fine: bool, field: &'static str) -> Result<(), StateError> {
        if fine { Ok(()) } else { Err(self.wrong(field)) }
    }

    /// Fails unless all fields so far were right.
    pub fn ok(&self) -> Result<(), StateError> {
        self.error.map_or(Ok(()), Err)
    }

    fn refuse(&mut self, field: Field, problem: &'static str) {
        self.error.get_or_insert(StateError { at: self.at, field, problem });
    }

    /// Fails if bytes are left after the last field.
    pub fn end(&mut self) -> Result<(), StateError> {
        self.ok()?;
        self.check(self.at == self.bytes.len(), "end")
    }

    fn array<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], StateError> {
        let missing = StateError { at: self.at, field, problem: "missing" };
        let bytes = self.bytes[self.at..].first_chunk::<N>().ok_or(missing)?;
        self.at += N;
        Ok(*bytes)
    }

    /// Reads one byte of any value.
    pub fn byte(&mut self, field: &'static str) -> Result<u8, StateError> {
        Ok(self.array::<1>(field)?[0])
    }

    /// Reads 16 bits.
    pub fn short(&mut self, field: &'static str) -> Result<u16, StateError> {
        Ok(u16::from_le_bytes(self.array(field)?))
    }

    /// Reads 32 bits.
    pub fn word(&mut self, field: &'static str) -> Result<u32, StateError> {
        Ok(u32::from_le_bytes(self.array(field)?))
    }

    /// Reads 64 bits.
    pub fn long(&mut self, field: &'static str) -> Result<u64, StateError> {
        Ok(u64::from_le_bytes(self.array(field)?))
    }

    /// Reads a finite number.
    pub fn number(&mut self, field: &'static str) -> Result<f32, StateError> {
        let value = f32::from_bits(self.word(field)?);
        self.check(value.is_finite(), field)?;
        Ok(value)
    }

    /// Reads a finite vector.
    pub fn vector(&mut self, field: &'static str) -> Result<Vec2, StateError> {
        Ok(Vec2::new(self.number(field)?, self.number(field)?))
    }

    /// Reads a number below [`PLAUSIBLE_MAX`] in magnitude.
    pub fn plausible_number(&mut self, field: &'static str) -> Result<f32, StateError> {
        let value = self.number(field)?;
        self.check(value.abs() < PLAUSIBLE_MAX, field)?;
        Ok(value)
    }

    /// Reads a vector of such numbers.
    pub fn plausible(&mut self, field: &'static str) -> Result<Vec2, StateError> {
        Ok(Vec2::new(self.plausible_number(field)?, self.plausible_number(field)?))
    }

    /// Reads a body's id, or none.
    pub fn body(&mut self, field: &'static str) -> Result<Option<BodyId>, StateError> {
        let (index, generation) = (self.word(field)?, self.word(field)?);
        Ok((index != NOBODY).then_some(BodyId { index, generation }))
    }

    /// Reads a number of entries of at least `bytes_each`; refused before anything is allocated if
    /// it exceeds `count_max` or the remaining bytes.
    pub fn count(
        &mut self,
        count_max: usize,
        bytes_each: usize,
        field: &'static str,
    ) -> Result<usize, StateError> {
        let count = self.word(field)? as usize;
        let fits = count <= count_max && count <= (self.bytes.len() - self.at) / bytes_each;
        self.check(fits, field)?;
        Ok(count)
    }
}

impl StateIo for StateWriter {
    fn saved<const N: usize>(&mut self, _: Field, given: [u8; N]) -> [u8; N] {
        self.0.extend(given);
        given
    }
}

impl StateIo for StateReader<'_> {
    const READS: bool = true;

    fn saved<const N: usize>(&mut self, field: Field, given: [u8; N]) -> [u8; N] {
        match self.bytes[self.at..].first_chunk() {
            Some(bytes) if self.error.is_none() => {
                self.at += N;
                *bytes
            }
            _ => {
                self.refuse(field, "missing");
                given
            }
        }
    }

    fn checked<T>(&mut self, field: Field, given: T, read: impl FnOnce() -> Option<T>) -> T {
        let read = if self.error.is_none() { read() } else { None };
        read.unwrap_or_else(|| {
            self.refuse(field, "out of range");
            given
        })
    }

    fn bytes_left(&self) -> usize {
        self.bytes.len() - self.at
    }
}

/// Hashes the saved bytes of a state instead of its words; each subject begins a new word.
pub struct ByteHasher<'a>(/** Digests the bytes. */ pub &'a mut StateHasher);

impl StateIo for ByteHasher<'_> {
    fn subject(&mut self, _: Subject) {
        self.0.fill_word();
    }

    fn saved<const N: usize>(&mut self, _: Field, given: [u8; N]) -> [u8; N] {
        self.0.push_bytes(&given);
        given
    }
}
