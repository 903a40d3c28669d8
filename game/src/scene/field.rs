//! The contents that scene files may have, as their reader asks for it.

use std::ops::Range;

/// A field that the reader of a scene asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInfo {
    /// Its path, like `bodies[3].radius`.
    pub path: String,
    /// The bytes of its value, if the file has it.
    pub given: Option<Range<usize>>,
    /// The values that it may have.
    pub form: FieldForm,
}

/// The values that a field may have, and the one that it has without the file's word. For a field that a file must
/// have, or whose default is none, that one stands for nothing.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldForm {
    /// A number.
    Number {
        /// The least and the greatest.
        range: [f32; 2],
        /// It must be above the least.
        above: bool,
        /// The default.
        default: f32,
    },
    /// A whole number.
    Whole {
        /// The least and the greatest.
        range: [i64; 2],
        /// The default.
        default: i64,
    },
    /// Two numbers.
    Vector {
        /// The least and the greatest of each.
        range: [f32; 2],
        /// The default.
        default: [f32; 2],
    },
    /// `true` or `false`.
    Truth {
        /// The default.
        default: bool,
    },
    /// A text in one line.
    Text {
        /// Its greatest length.
        chars_max: usize,
    },
    /// One of these words.
    Choice {
        /// The words.
        names: Vec<String>,
    },
}
