//! The values that fields of scene files may have, as the parser, the editor's form and the documentation see them.

use super::limits::{SIZE_MAX, SPEED_MAX};
use jostle_sim::TICKS_PER_SECOND;
use std::fmt;
use std::ops::Range as Bytes;

/// A field requested by the reader of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInfo {
    /// Path of the field, like `bodies[3].radius`.
    pub path: String,
    /// Bytes of the field's value, if the file has it.
    pub given: Option<Bytes<usize>>,
    /// The values that the field may have.
    pub form: FieldForm,
    /// Whether the default in `form` applies if the file does not have the field.
    pub has_default: bool,
}

/// The values that a field may have, and its default. The default is meaningless if the file must have the field, or
/// if the field may be absent; see [`FieldInfo::has_default`].
#[derive(Clone, Debug, PartialEq)]
pub enum FieldForm {
    /// A finite number within a range.
    Number {
        /// Smallest and greatest value.
        range: [f32; 2],
        /// Whether the smallest value itself is excluded.
        above: bool,
        /// Value if the file does not have the field.
        default: f32,
    },
    /// A whole number within a range.
    Whole {
        /// Smallest and greatest value.
        range: [i64; 2],
        /// Value if the file does not have the field.
        default: i64,
    },
    /// Two finite numbers, each within a range.
    Vector {
        /// Smallest and greatest value of each number.
        range: [f32; 2],
        /// Value if the file does not have the field.
        default: [f32; 2],
    },
    /// Either `true` or `false`.
    Truth {
        /// Value if the file does not have the field.
        default: bool,
    },
    /// A single line of text.
    Text {
        /// Greatest length, in characters.
        chars_max: usize,
    },
    /// One of these words.
    Choice {
        /// The allowed words.
        names: Vec<String>,
    },
}

/// The range of numbers that a field may have.
#[derive(Clone, Copy)]
pub(super) struct Range {
    pub low: f32,
    pub high: f32,
    pub above_low: bool,
}

/// Range of coordinates of anything in a scene.
pub(super) const POSITION: Range = Range::from(-2.0 * SIZE_MAX, 2.0 * SIZE_MAX);
/// A component of a velocity.
pub(super) const VELOCITY: Range = Range::from(-SPEED_MAX, SPEED_MAX);
/// Times in a scene, seconds.
pub(super) const SECONDS: Range = Range::from(0.0, 3600.0);
/// Times between events, seconds.
pub(super) const INTERVAL: Range = Range::from(1.0 / TICKS_PER_SECOND as f32, 3600.0);

impl Range {
    /// A range that includes both `low` and `high`.
    pub const fn from(low: f32, high: f32) -> Range {
        Range { low, high, above_low: false }
    }

    /// A range above `low`, up to and including `high`.
    pub const fn above(low: f32, high: f32) -> Range {
        Range { low, high, above_low: true }
    }

    pub const fn ends(&self) -> [f32; 2] {
        [self.low, self.high]
    }

    /// Whether the range contains a value; no range contains NaN or infinities.
    pub fn contains(&self, value: f32) -> bool {
        value <= self.high && if self.above_low { value > self.low } else { value >= self.low }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.above_low {
            write!(out, "a number above {}, at most {}", self.low, self.high)
        } else {
            write!(out, "a number from {} to {}", self.low, self.high)
        }
    }
}
