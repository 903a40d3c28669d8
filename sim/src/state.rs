//! The state of the simulation. [`io`] describes each type once, and [`bytes`] saves and restores it. The hash
//! digests it word by word in a fixed order, and the search for the first difference lists and compares the same
//! words.
//!
//! Saved bytes leave out everything that can be derived, and store data shared by many bodies only once. The hash
//! covers every word of each body.

pub mod bytes;
pub mod io;

pub use io::{Subject, Word};

use crate::hash::StateHasher;
use io::{Field, StateIo};
use std::fmt;

/// The first word in which two states differ, in the order of the state hash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Owner of the word.
    pub subject: Subject,
    /// Name of the word.
    pub field: Field,
    /// Values in the two states; `None` if a state has no such subject.
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

impl StateIo for StateHasher {
    #[cfg_attr(not(target_arch = "wasm32"), inline)]
    fn hashed(&mut self, _: Field, word: Word) {
        let (Word::Bits(bits) | Word::Number(bits)) = word;
        self.push(bits);
    }
}

/// A state as a list of its labelled words.
#[derive(Default)]
pub struct StateDump {
    subject: Option<Subject>,
    words: Vec<(Subject, Field, Word)>,
}

impl StateIo for StateDump {
    fn subject(&mut self, subject: Subject) {
        self.subject = Some(subject);
    }

    fn hashed(&mut self, field: Field, word: Word) {
        self.words.push((self.subject.unwrap_or(Subject::WORLD), field, word));
    }
}

impl StateDump {
    /// Returns the first word that differs.
    pub fn first_difference(&self, other: &StateDump) -> Option<Difference> {
        let index = self.words.iter().zip(&other.words).position(|(one, other)| one != other);
        let index = index.unwrap_or(self.words.len().min(other.words.len()));
        match (self.words.get(index), other.words.get(index)) {
            (None, None) => None,
            (Some(&(subject, field, one)), Some(&(twin, twin_field, other)))
                if (subject, field) == (twin, twin_field) =>
            {
                Some(Difference { subject, field, values: [Some(one), Some(other)] })
            }
            // From here on, the lists are out of step because one has a subject that the other lacks.
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

    /// Whether the list has words of a subject. This is always so if the subject is `twin`.
    fn has(&self, subject: Subject, twin: Subject) -> bool {
        subject == twin || self.words.iter().any(|&(other, ..)| other == subject)
    }
}
