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
    /// A finite number within a range.
    Number {
        /// The least and the greatest.
        range: [f32; 2],
        /// It must be above the least.
        above: bool,
        /// Value where the file says nothing.
        default: f32,
    },
    /// A whole number within a range.
    Whole {
        /// The least and the greatest.
        range: [i64; 2],
        /// Value where the file says nothing.
        default: i64,
    },
    /// Two finite numbers, each within a range.
    Vector {
        /// The least and the greatest of each.
        range: [f32; 2],
        /// Value where the file says nothing.
        default: [f32; 2],
    },
    /// Either `true` or `false`.
    Truth {
        /// Value where the file says nothing.
        default: bool,
    },
    /// A text in one line.
    Text {
        /// Greatest length, in characters.
        chars_max: usize,
    },
    /// One of these words.
    Choice {
        /// The words that are allowed.
        names: Vec<String>,
    },
}
