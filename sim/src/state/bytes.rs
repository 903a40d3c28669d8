//! Saves states as bytes, in fixed-size little-endian words. Saved bytes may come from anywhere, so every number
//! is checked as it is read.

use super::io::{Field, StateIo, Subject};
use crate::hash::StateHasher;

/// The reason why bytes are not a valid state of this scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("byte {at} of the state: {field} is {problem}")]
pub struct StateError {
    /// Offset of the field.
    pub at: usize,
    /// Name of the field.
    pub field: Field,
    /// Either "missing" or "out of range".
    pub problem: &'static str,
}

/// Writes a state as bytes.
#[derive(Default)]
pub struct StateWriter(/** The bytes so far. */ pub Vec<u8>);

impl StateIo for StateWriter {
    fn saved<const N: usize>(&mut self, _: Field, given: [u8; N]) -> [u8; N] {
        self.0.extend(given);
        given
    }
}

/// Reads a state from bytes, and remembers the first invalid field.
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

    /// Fails if any field so far was invalid.
    pub fn ok(&self) -> Result<(), StateError> {
        self.error.map_or(Ok(()), Err)
    }

    /// Fails if any field was invalid or bytes are left over.
    pub fn end(&mut self) -> Result<(), StateError> {
        let left = self.bytes_left();
        self.check("end", || left == 0);
        self.ok()
    }

    fn refuse(&mut self, field: Field, problem: &'static str) {
        self.error.get_or_insert(StateError { at: self.at, field, problem });
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

/// Hashes a state's saved bytes instead of its words. Each subject begins a new word.
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
