//! The state word by word, for whoever looks at all of it: the hash digests the words, and the
//! search for a first difference compares them.

pub mod bytes;

use crate::body::BodyId;
use crate::hash::StateHasher;
use glam::Vec2;
use std::fmt;

/// Whose state a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The world as a whole.
    World,
    /// A body, or the slot that it left.
    Body(BodyId),
    /// Two bodies that hold each other apart, by slot.
    Contact {
        /// Lower slot.
        a: u32,
        /// Higher slot.
        b: u32,
    },
    /// A spring, counted from 0.
    Spring(u32),
    /// A running emitter, counted from 0.
    Emitter(u32),
    /// A particle, counted from 0.
    Particle(u32),
    /// The rules as a whole.
    Rules,
    /// The player in this seat.
    Player(u16),
}

impl fmt::Display for Subject {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Subject::World => write!(out, "world"),
            Subject::Body(id) => write!(out, "body {}.{}", id.index, id.generation),
            Subject::Contact { a, b } => write!(out, "contact of {a} and {b}"),
            Subject::Spring(place) => write!(out, "spring {place}"),
            Subject::Emitter(place) => write!(out, "emitter {place}"),
            Subject::Particle(place) => write!(out, "particle {place}"),
            Subject::Rules => write!(out, "rules"),
            Subject::Player(seat) => write!(out, "player {seat}"),
        }
    }
}

/// A word of state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Word {
    /// A count, an index or a set of flags.
    Bits(u32),
    /// The bits of a number; both zeros are one.
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

/// The first place, in the order of the state hash, where two states differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Whose state.
    pub subject: Subject,
    /// Which part of it.
    pub field: &'static str,
    /// What the two states say; `None` where one of them has no such subject.
    pub values: [Option<Word>; 2],
}

impl fmt::Display for Difference {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "{} {}: ", self.subject, self.field)?;
        match self.values {
            [Some(one), Some(other)] => write!(out, "{one} against {other}"),
            [Some(_), None] => write!(out, "only the first has it"),
            [None, _] => write!(out, "only the second has it"),
        }
    }
}

/// Takes the words of a state, always in the same order.
pub(crate) trait Words {
    fn word(&mut self, subject: Subject, field: &'static str, word: Word);

    #[inline]
    fn bits(&mut self, subject: Subject, field: &'static str, bits: u32) {
        self.word(subject, field, Word::Bits(bits));
    }

    /// The low half first.
    #[inline]
    fn long(&mut self, subject: Subject, field: &'static str, bits: u64) {
        self.bits(subject, field, bits as u32);
        self.bits(subject, field, (bits >> 32) as u32);
    }

    #[inline]
    fn number(&mut self, subject: Subject, field: &'static str, value: f32) {
        self.word(subject, field, Word::Number((value + 0.0).to_bits()));
    }

    #[inline]
    fn vector(&mut self, subject: Subject, fields: [&'static str; 2], value: Vec2) {
        self.number(subject, fields[0], value.x);
        self.number(subject, fields[1], value.y);
    }

    #[inline]
    fn name(&mut self, subject: Subject, field: &'static str, body: BodyId) {
        self.bits(subject, field, body.index);
        self.bits(subject, field, body.generation);
    }
}

impl Words for StateHasher {
    #[inline]
    fn word(&mut self, _: Subject, _: &'static str, word: Word) {
        let (Word::Bits(bits) | Word::Number(bits)) = word;
        self.push(bits);
    }
}

/// All words, kept with their labels.
#[derive(Default)]
pub(crate) struct Listing(Vec<(Subject, &'static str, Word)>);

impl Words for Listing {
    fn word(&mut self, subject: Subject, field: &'static str, word: Word) {
        self.0.push((subject, field, word));
    }
}

impl Listing {
    /// The first word that is not the same.
    pub fn first_difference(&self, other: &Listing) -> Option<Difference> {
        let place = self.0.iter().zip(&other.0).position(|(one, other)| one != other);
        let place = place.unwrap_or(self.0.len().min(other.0.len()));
        match (self.0.get(place), other.0.get(place)) {
            (None, None) => None,
            (Some(&(subject, field, one)), Some(&(twin, twin_field, other)))
                if (subject, field) == (twin, twin_field) =>
            {
                Some(Difference { subject, field, values: [Some(one), Some(other)] })
            }
            // From here on the lists are out of step: one has a subject that the other lacks.
            (Some(&(subject, field, one)), None) => {
                Some(Difference { subject, field, values: [Some(one), None] })
            }
            (Some(&(subject, field, one)), Some(&(twin, ..))) if !other.has(subject, twin) => {
                Some(Difference { subject, field, values: [Some(one), None] })
            }
            (_, Some(&(subject, field, other))) => {
                Some(Difference { subject, field, values: [None, Some(other)] })
            }
        }
    }

    /// Whether the list has words of a subject, beside those of its `twin`.
    fn has(&self, subject: Subject, twin: Subject) -> bool {
        subject == twin || self.0.iter().any(|&(other, ..)| other == subject)
    }
}

#[cfg(test)]
mod tests;
