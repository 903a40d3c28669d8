//! Why a file cannot be watched, in sentences.

use jostle_protocol::replay::{Problem, ReplayError};
use jostle_room::PlaybackError;
use std::fmt;

/// Why a file cannot be watched.
#[derive(Clone, Debug, PartialEq)]
pub enum FilmError {
    /// Not even its start can be read.
    Unreadable(ReplayError),
    /// Its start can be read, but not played.
    Unplayable(PlaybackError),
}

impl From<ReplayError> for FilmError {
    fn from(error: ReplayError) -> FilmError {
        FilmError::Unreadable(error)
    }
}

impl From<PlaybackError> for FilmError {
    fn from(error: PlaybackError) -> FilmError {
        FilmError::Unplayable(error)
    }
}

impl FilmError {
    /// Two or three words.
    pub fn title(&self) -> &'static str {
        match self {
            FilmError::Unreadable(error) => match error.problem {
                Problem::NotAReplay => "Not a replay",
                Problem::Format { .. } => "Another format",
                Problem::TooLong { .. } => "Too long",
                _ => "Damaged replay",
            },
            FilmError::Unplayable(_) => "Cannot be played",
        }
    }

    /// What it means and what to do, in a sentence or two.
    pub fn advice(&self) -> &'static str {
        match self {
            FilmError::Unreadable(error) => match error.problem {
                Problem::NotAReplay => {
                    "This file holds something else. Choose one that a server recorded: its name \
                     ends in .jostle."
                }
                Problem::Format { .. } => {
                    "This replay was recorded by another version of Jostle: open it with that one."
                }
                Problem::TooLong { .. } => "No replay is as long as this file: choose another one.",
                _ => {
                    "The beginning of this file is missing or damaged, so nothing of it can be \
                     shown. Get the file again from where it came from."
                }
            },
            FilmError::Unplayable(_) => {
                "The file is whole, but what it tells cannot happen in its scene: it was made by \
                 another program or changed by hand."
            }
        }
    }
}

/// What was found, with its place in the file.
impl fmt::Display for FilmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FilmError::Unreadable(error) => error.fmt(f),
            FilmError::Unplayable(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for FilmError {}
