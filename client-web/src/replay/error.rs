//! Why a file cannot be watched, in sentences.

use jostle_protocol::replay::{Problem, ReplayError};
use jostle_room::PlaybackError;
use std::fmt;

/// Why a file cannot be watched.
#[derive(Clone, Debug, PartialEq)]
pub enum ReplayLoadError {
    /// Not even its start can be read.
    Unreadable(ReplayError),
    /// Its start can be read, but not played.
    Unplayable(PlaybackError),
}

impl From<ReplayError> for ReplayLoadError {
    fn from(error: ReplayError) -> ReplayLoadError {
        ReplayLoadError::Unreadable(error)
    }
}

impl From<PlaybackError> for ReplayLoadError {
    fn from(error: PlaybackError) -> ReplayLoadError {
        ReplayLoadError::Unplayable(error)
    }
}

impl ReplayLoadError {
    /// Two or three words.
    pub fn title(&self) -> &'static str {
        match self {
            ReplayLoadError::Unreadable(error) => match error.problem {
                Problem::NotAReplay => "Not a replay",
                Problem::Format { .. } => "Unsupported version",
                Problem::TooLong { .. } => "Too big",
                _ => "Damaged replay",
            },
            ReplayLoadError::Unplayable(_) => "Can't be played",
        }
    }

    /// A sentence or two about what it means and what to do.
    pub fn advice(&self) -> &'static str {
        match self {
            ReplayLoadError::Unreadable(error) => match error.problem {
                Problem::NotAReplay => {
                    "This isn't a Jostle replay. Choose a file ending in .jostle."
                }
                Problem::Format { .. } => "This replay was made by a different version of Jostle.",
                Problem::TooLong { .. } => "This file is too big to be a replay.",
                _ => {
                    "The start of this file is missing or damaged, so it can't be played. Try \
                     downloading it again."
                }
            },
            ReplayLoadError::Unplayable(_) => {
                "The file is intact, but it doesn't match its scene. It was probably edited or \
                 made by another program."
            }
        }
    }
}

/// The flaw, with its place in the file.
impl fmt::Display for ReplayLoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReplayLoadError::Unreadable(error) => error.fmt(f),
            ReplayLoadError::Unplayable(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ReplayLoadError {}
