//! The error type for all decoders in this crate.

/// The reason why bytes were refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The message ends inside a field.
    #[error("message ends inside {field}")]
    Truncated {
        /// The field being read.
        field: &'static str,
    },
    /// A field's value is out of range.
    #[error("{field} is out of range")]
    OutOfRange {
        /// The field being read.
        field: &'static str,
    },
    /// Bytes are left after the last field.
    #[error("{count} bytes are left over")]
    Trailing {
        /// Number of extra bytes.
        count: usize,
    },
    /// A delta arrived before any keyframe.
    #[error("no keyframe came before")]
    NoBaseline,
    /// The message is longer than its kind allows.
    #[error("message of {bytes} bytes exceeds {bytes_max}")]
    TooLong {
        /// Length of the message, in bytes.
        bytes: usize,
        /// Maximum length allowed, in bytes.
        bytes_max: usize,
    },
}

/// Refuses a field as out of range unless its value is valid.
pub(crate) fn check(is_valid: bool, field: &'static str) -> Result<(), DecodeError> {
    if is_valid { Ok(()) } else { Err(DecodeError::OutOfRange { field }) }
}
