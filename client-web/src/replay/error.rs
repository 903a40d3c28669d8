//! The reasons why a file cannot be watched, and their explanations.

use jostle_protocol::replay::{Problem, ReplayError};
use jostle_room::PlaybackError;

/// Why a file cannot be watched: the error and its position in the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReplayLoadError {
    /// The start of the file cannot be read.
    #[error(transparent)]
    Unreadable(#[from] ReplayError),
    /// The start of the file can be read but not played.
    #[error(transparent)]
    Unplayable(#[from] PlaybackError),
}

impl ReplayLoadError {
    /// A title of two or three words, and one or two sentences of explanation and advice.
    pub fn title_and_advice(&self) -> (&'static str, &'static str) {
        match self {
            ReplayLoadError::Unreadable(error) => match error.problem {
                Problem::NotAReplay => {
                    ("Not a replay", "This isn't a Jostle replay. Choose a file ending in .jostle.")
                }
                Problem::Format { .. } => (
                    "Unsupported version",
                    "This replay was made by a different version of Jostle.",
                ),
                Problem::TooLong { .. } => ("Too big", "This file is too big to be a replay."),
                _ => (
                    "Damaged replay",
                    "The start of this file is missing or damaged, so it can't be played. Try \
                     downloading it again.",
                ),
            },
            ReplayLoadError::Unplayable(_) => (
                "Can't be played",
                "The file is intact, but it doesn't match its scene. It was probably edited or \
                 made by another program.",
            ),
        }
    }
}
