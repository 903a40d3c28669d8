//! A line of the doctor's report.

use serde::Serialize;
use std::fmt;

/// The result of a check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    pub about: String,
    /// A description of the current state.
    pub found: String,
    /// A recommendation; `None` if everything is fine.
    pub change: Option<String>,
}

impl Finding {
    /// A finding without a recommendation.
    pub fn fine(about: impl Into<String>, found: impl Into<String>) -> Finding {
        Finding { about: about.into(), found: found.into(), change: None }
    }

    /// A finding with a recommendation.
    pub fn change(
        about: impl Into<String>,
        found: impl Into<String>,
        change: impl Into<String>,
    ) -> Finding {
        Finding { change: Some(change.into()), ..Finding::fine(about, found) }
    }

    /// A finding that is fine if `is_fine` is true; otherwise `change` is recommended.
    pub fn judged(
        about: impl Into<String>,
        found: impl Into<String>,
        is_fine: bool,
        change: impl Into<String>,
    ) -> Finding {
        match is_fine {
            true => Finding::fine(about, found),
            false => Finding::change(about, found, change),
        }
    }

    /// Whether nothing needs to be changed.
    pub fn is_fine(&self) -> bool {
        self.change.is_none()
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.is_fine() { "fine" } else { "change" };
        write!(out, "{verdict:<7} {:<12} {}", self.about, self.found)?;
        self.change.as_ref().map_or(Ok(()), |change| write!(out, ". To change: {change}"))
    }
}

/// Formats a number of bytes for people.
pub fn megabytes(bytes: u64) -> String {
    match bytes >> 20 {
        mb if mb >= 10 << 10 => format!("{} GB", mb >> 10),
        mb => format!("{mb} MB"),
    }
}
