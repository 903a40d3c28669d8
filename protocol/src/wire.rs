//! Bytes: a bounds-checked reader and a writer of LEB128 numbers.

/// Why bytes were refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The message ends inside a field.
    #[error("message ends inside {field}")]
    Truncated {
        /// The field.
        field: &'static str,
    },
    /// A field has a value outside its range.
    #[error("{field} is out of range")]
    OutOfRange {
        /// The field.
        field: &'static str,
    },
    /// Bytes are left after the last field.
    #[error("{count} bytes are left over")]
    Trailing {
        /// How many.
        count: usize,
    },
    /// The snapshot is coded against a tick that this end does not hold.
    #[error("snapshot needs baseline tick {tick}")]
    MissingBaseline {
        /// The tick.
        tick: u32,
    },
    /// The message is longer than its kind may be.
    #[error("message of {bytes} bytes exceeds {bytes_max}")]
    TooLong {
        /// Found.
        bytes: usize,
        /// Allowed.
        bytes_max: usize,
    },
}
