//! The error type of every decoder in this crate.

/// The reason why bytes were refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The message ends inside a field.
    #[error("message ends inside {field}")]
    Truncated {
        /// Field that was being read.
        field: &'static str,
    },
    /// A field has a value outside its range.
    #[error("{field} is out of range")]
    OutOfRange {
        /// Field that was being read.
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
    /// The message is longer than allowed for its kind.
    #[error("message of {bytes} bytes exceeds {bytes_max}")]
    TooLong {
        /// Length of the message.
        bytes: usize,
        /// Largest allowed length.
        bytes_max: usize,
    },
}

/// Refuses a field as out of range unless its value is valid.
pub(crate) fn check(is_valid: bool, field: &'static str) -> Result<(), DecodeError> {
    if is_valid { Ok(()) } else { Err(DecodeError::OutOfRange { field }) }
}
