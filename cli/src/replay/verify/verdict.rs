//! The verdict on a file, as a line and as JSON.

use jostle_protocol::replay::ReplayError;
use jostle_room::divergence::{Cause, Divergence};
use serde::Serialize;
use std::fmt;

/// The verdict on a file.
#[derive(Debug, Serialize)]
pub struct Verdict {
    /// The path as given on the command line.
    pub file: String,
    /// Number of ticks played again.
    pub ticks: u32,
    #[serde(flatten)]
    pub outcome: VerifyOutcome,
}

#[derive(Debug, Serialize)]
#[serde(tag = "result", rename_all = "lowercase")]
pub enum VerifyOutcome {
    /// All ticks are equal.
    Ok,
    /// All ticks are equal, but the end is missing.
    Cut {
        /// Where the missing part begins, in bytes.
        offset: usize,
        /// Why the file ends there.
        reason: String,
        /// The last tick in the file.
        last_tick: u32,
    },
    /// All ticks up to a damaged record are equal; the records after it are not read.
    Damaged {
        /// Where the damaged record begins, in bytes.
        offset: usize,
        reason: String,
        /// The last tick before the damage.
        last_tick: u32,
    },
    /// The game diverges from the recording.
    Differs {
        /// The first tick that differs.
        tick: u32,
        /// Phases of the tick in which the divergence may have happened; empty if unknown.
        phases: Vec<&'static str>,
        /// The first thing that differs, such as `body 3.0`; `null` if unknown.
        subject: Option<String>,
        /// The name of the number that differs.
        field: Option<&'static str>,
        /// Everything known about the divergence, as a sentence.
        reason: String,
    },
    /// The file is not a replay or cannot be played.
    Unreadable { reason: String },
}

impl VerifyOutcome {
    /// The outcome for a truncated file.
    pub fn cut(error: &ReplayError, last_tick: u32) -> VerifyOutcome {
        VerifyOutcome::Cut { offset: error.offset, reason: error.problem.to_string(), last_tick }
    }

    /// The outcome for a file with a damaged record.
    pub fn damaged(error: &ReplayError, last_tick: u32) -> VerifyOutcome {
        VerifyOutcome::Damaged {
            offset: error.offset,
            reason: error.problem.to_string(),
            last_tick,
        }
    }

    /// The outcome for a game that diverges from its recording.
    pub fn differs(divergence: &Divergence) -> VerifyOutcome {
        let (phases, subject, field) = match &divergence.cause {
            Cause::Nudge { phases, body, field, .. } => {
                let phases = phases.iter().map(|phase| phase.name()).collect();
                let subject = format!("body {}.{}", body.index, body.generation);
                (phases, Some(subject), Some(*field))
            }
            Cause::Later { difference, .. } => {
                (Vec::new(), Some(difference.subject.to_string()), Some(difference.field))
            }
            Cause::Unknown => (Vec::new(), None, None),
        };
        let (tick, reason) = (divergence.tick, divergence.to_string());
        VerifyOutcome::Differs { tick, phases, subject, field, reason }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "{}: ", self.file)?;
        match &self.outcome {
            VerifyOutcome::Ok => write!(out, "ok"),
            VerifyOutcome::Cut { offset, reason, last_tick } => {
                write!(out, "ok, cut at byte {offset} ({reason}), equal to tick {last_tick}")
            }
            VerifyOutcome::Damaged { offset, reason, last_tick } => {
                write!(out, "DAMAGED at byte {offset} ({reason}), equal to tick {last_tick}")
            }
            VerifyOutcome::Differs { reason, .. } => write!(out, "DIFFERS: {reason}"),
            VerifyOutcome::Unreadable { reason } => write!(out, "CANNOT BE READ: {reason}"),
        }
    }
}
