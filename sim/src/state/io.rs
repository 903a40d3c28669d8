//! The single description of each type's state, and the operations that run it.

use crate::body::BodyId;
use crate::rng::Rng;
use glam::Vec2;
use std::fmt;

/// Owner of a word of state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A body, or the free slot that it left behind.
    Body(BodyId),
    /// Two bodies that hold each other apart, the lower slot first.
    Contact(u32, u32),
    /// The only one of its kind, such as the world.
    One(&'static str),
    /// One of several, such as a particle, counted from 0, or a player, given by seat.
    Numbered(&'static str, u32),
}

impl Subject {
    /// The world as a whole.
    pub const WORLD: Subject = Subject::One("world");
}

impl fmt::Display for Subject {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Subject::Body(id) => write!(out, "body {}.{}", id.index, id.generation),
            Subject::Contact(a, b) => write!(out, "contact of {a} and {b}"),
            Subject::One(name) => write!(out, "{name}"),
            Subject::Numbered(name, number) => write!(out, "{name} {number}"),
        }
    }
}

/// A word of state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Word {
    /// A count, an index or a set of flags.
    Bits(u32),
    /// The bits of a number; +0 and -0 count as equal.
    Number(u32),
}

impl fmt::Display for Word {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Word::Bits(bits) => write!(out, "{bits}"),
            Word::Number(bits) => write!(out, "{:e} ({bits:08x})", f32::from_bits(*bits)),
        }
    }
}

/// Name of a field, in differences and errors.
pub type Field = &'static str;

/// Runs descriptions of state. A description is a function that takes a value, passes on its fields in a fixed order,
/// each with a check, and returns a value made from the results.
///
/// Hashes, lists for comparison and saved bytes are made from the values passed in; a restored state consists of the
/// values returned. A field is therefore named only once, and everything that is saved is also hashed, except for
/// values passed to [`StateIo::saved`]. After the first invalid byte, a reader returns the values passed in and runs
/// no further checks; its results must not be used until its error has been checked.
pub trait StateIo: Sized {
    /// Whether values come from saved bytes. Only then are values checked and lists returned.
    const READS: bool = false;

    /// Names the owner of the fields that follow.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn subject(&mut self, _: Subject) {}

    /// Takes a word that is hashed but not saved, since it can be derived from saved words.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn hashed(&mut self, _field: Field, _word: Word) {}

    /// Takes bytes that are saved but not hashed. They must be hashed in another form, or affect only later state
    /// that is itself hashed.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn saved<const N: usize>(&mut self, _field: Field, given: [u8; N]) -> [u8; N] {
        given
    }

    /// Returns `given` or, when reading, the meaning of the last value read. `None` makes that value invalid.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn checked<T>(&mut self, _: Field, given: T, _read: impl FnOnce() -> Option<T>) -> T {
        given
    }

    /// Number of bytes left to read.
    fn bytes_left(&self) -> usize {
        usize::MAX
    }

    /// Marks the last value read as invalid unless it fits.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn check(&mut self, field: Field, fits: impl FnOnce() -> bool) {
        self.checked(field, (), || fits().then_some(()));
    }

    /// Takes a count, an index or flags that are only hashed, like [`StateIo::hashed`].
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn bits(&mut self, field: Field, bits: u32) {
        self.hashed(field, Word::Bits(bits));
    }

    /// Takes a byte, which is hashed as a word.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn byte(&mut self, field: Field, value: u8) -> u8 {
        self.bits(field, u32::from(value));
        self.saved(field, [value])[0]
    }

    /// Takes 16 bits, which are hashed as a word.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn short(&mut self, field: Field, value: u16) -> u16 {
        self.bits(field, u32::from(value));
        self.saved_short(field, value)
    }

    /// Takes 16 bits that are only saved, like [`StateIo::saved`].
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn saved_short(&mut self, field: Field, value: u16) -> u16 {
        u16::from_le_bytes(self.saved(field, value.to_le_bytes()))
    }

    /// Takes a word of 32 bits.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn word(&mut self, field: Field, value: u32) -> u32 {
        self.bits(field, value);
        self.saved_word(field, value)
    }

    /// Takes a word of 32 bits that is only saved, like [`StateIo::saved`].
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn saved_word(&mut self, field: Field, value: u32) -> u32 {
        u32::from_le_bytes(self.saved(field, value.to_le_bytes()))
    }

    /// Takes 64 bits, low half first.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn long(&mut self, field: Field, value: u64) -> u64 {
        let low = self.word(field, value as u32);
        u64::from(self.word(field, (value >> 32) as u32)) << 32 | u64::from(low)
    }

    /// Takes up to seven flags in one byte.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn flags<const N: usize>(&mut self, field: Field, flags: [bool; N]) -> [bool; N] {
        let bits = flags.iter().rev().fold(0, |bits, &flag| bits << 1 | u8::from(flag));
        let bits = self.byte(field, bits);
        let read = || std::array::from_fn(|index| bits >> index & 1 == 1);
        self.checked(field, flags, || (bits >> N == 0).then(read))
    }

    /// Takes a number; +0 and -0 have the same hash.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn number(&mut self, field: Field, value: f32, fits: impl FnOnce(f32) -> bool) -> f32 {
        self.hashed(field, Word::Number((value + 0.0).to_bits()));
        let read = f32::from_le_bytes(self.saved(field, value.to_le_bytes()));
        self.checked(field, value, || fits(read).then_some(read))
    }

    /// Takes both components of a vector.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn vector(&mut self, fields: [Field; 2], it: Vec2, fits: impl Fn(f32) -> bool) -> Vec2 {
        let x = self.number(fields[0], it.x, &fits);
        Vec2::new(x, self.number(fields[1], it.y, &fits))
    }

    /// Takes the id of a body, or `None`.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn body(&mut self, field: Field, body: Option<BodyId>) -> Option<BodyId> {
        let BodyId { index, generation } = body.unwrap_or(NOBODY);
        self.bits(field, index);
        self.bits(field, generation);
        self.saved_body(field, body)
    }

    /// Takes the id of a body or `None`, which is only saved, like [`StateIo::saved`].
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn saved_body(&mut self, field: Field, body: Option<BodyId>) -> Option<BodyId> {
        let BodyId { index, generation } = body.unwrap_or(NOBODY);
        let index = self.saved_word(field, index);
        let generation = self.saved_word(field, generation);
        (index != NOBODY.index).then_some(BodyId { index, generation })
    }

    /// Takes the id of a body; `None` is invalid.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn id(&mut self, field: Field, id: BodyId) -> BodyId {
        let read = self.body(field, Some(id));
        self.checked(field, id, || read)
    }

    /// Takes the state of a random number generator.
    fn generator(&mut self, field: Field, rng: &Rng) -> Rng {
        let [state, increment] = rng.state().map(|half| self.long(field, half));
        self.check(field, || increment & 1 == 1);
        Rng::from_state([state, increment])
    }

    /// Describes every entry passed in.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn each<T, U>(
        &mut self,
        given: impl IntoIterator<Item = T>,
        mut entry: impl FnMut(&mut Self, u32, T) -> U,
    ) -> Vec<U> {
        let mut read = Vec::new();
        for (index, given) in given.into_iter().enumerate() {
            let value = entry(self, index as u32, given);
            if Self::READS {
                read.push(value);
            }
        }
        read
    }

    /// Takes the number of entries, which is not hashed. It is refused before anything is allocated if it
    /// exceeds `most`, or if fewer than `size` bytes per entry are left.
    fn count(&mut self, field: Field, given: usize, [most, size]: [usize; 2]) -> usize {
        let count = self.saved_word(field, given as u32) as usize;
        let most = most.min(self.bytes_left() / size);
        self.checked(field, given, || (count <= most).then_some(count))
    }

    /// Takes a list. `limits` holds the maximum number of entries and the minimum number of bytes per entry. Entries
    /// to be read start as `blank`.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn list<T: Clone>(
        &mut self,
        field: Field,
        limits: [usize; 2],
        given: impl ExactSizeIterator<Item = T>,
        blank: T,
        entry: impl FnMut(&mut Self, u32, T) -> T,
    ) -> Vec<T> {
        let count = self.count(field, given.len(), limits);
        self.entries(count, given, blank, entry)
    }

    /// Takes the entries of a list after its length.
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn entries<T: Clone>(
        &mut self,
        count: usize,
        given: impl Iterator<Item = T>,
        blank: T,
        entry: impl FnMut(&mut Self, u32, T) -> T,
    ) -> Vec<T> {
        if Self::READS {
            self.each(std::iter::repeat_n(blank, count), entry)
        } else {
            self.each(given, entry)
        }
    }
}

/// Represents the absence of a body.
pub const NOBODY: BodyId = BodyId { index: u32::MAX, generation: 0 };

/// Exceeds every number in a game, yet is so small that a step with it stays finite.
pub const PLAUSIBLE_MAX: f32 = 1e9;

/// Whether a number can occur in a game: its magnitude is below [`PLAUSIBLE_MAX`].
pub fn plausible(value: f32) -> bool {
    value.abs() < PLAUSIBLE_MAX
}
