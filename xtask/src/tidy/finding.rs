//! The words of every message of tidy: the place, what was found, what is allowed, how to mend it.

use std::fmt::{self, Display};
use thiserror::Error;

const ARROWS: &str = "xtask/src/tidy/arrows.rs";

/// Something to mend, with its place.
#[derive(Debug, PartialEq)]
pub struct Finding {
    path: String,
    /// From 1; 0 for the file as a whole.
    line: usize,
    fault: Fault,
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.path, self.fault),
            line => write!(f, "{}:{line}: {}", self.path, self.fault),
        }
    }
}

/// A fault that tidy refuses. Each message says what was found, what is allowed and how to mend it.
#[derive(Debug, PartialEq, Error)]
pub enum Fault {
    #[error("{0} bytes; at most {1}; remove it or make it smaller")]
    Large(usize, usize),
    #[error("{0} lines; at most {1}; shorten it")]
    Long(usize, usize),
    #[error("does not open with `//!`; each file says what lives in it; add that line")]
    NoHeader,
    #[error("path of one machine, {0}; paths hold anywhere; read it from the environment")]
    MachinePath(String),
    #[error("ignored test; every test runs; mend it or remove it")]
    IgnoredTest,
    #[error("assertion that cannot fail; assertions check something; mend it or remove it")]
    HollowAssertion,
    #[error("unfinished: {0}!; only finished work is committed; finish it")]
    Unfinished(&'static str),
    #[error(
        "`{0}` in a crate whose result depends on its input alone; pass the value in, or use an exact function"
    )]
    Impure(&'static str),
    #[error("differs from {0}; the deterministic crates refuse the same things; copy it")]
    OtherLints(&'static str),
    #[error("link to {0}, which does not exist; links lead to tracked files; correct it")]
    DeadLink(String),
    #[error("link to #{0}, which is no heading of {1}; links lead to headings; correct it")]
    DeadHeading(String, String),
    #[error("`{0}` does not exist; documents name tracked files; correct the path")]
    DeadPath(String),
    #[error("no `{0}` in the code; the code map names what exists; correct it")]
    DeadSymbol(String),
    #[error("`{0}` is no row of {1}; citations name rows; add the row or correct the number")]
    DeadRow(String, &'static str),
    #[error("missing; citations need its rows; restore it")]
    NoRows,
    #[error("not in the table of crates; each has a layer; add it to LAYERS in {ARROWS}")]
    UnknownCrate,
    #[error("depends on {0}; allowed of ours: {1}; move what both need below them")]
    Arrow(String, String),
    #[error("depends on {0}; inner crates know neither sockets nor pages; move that code up")]
    Outside(String),
    #[error(
        "circle of files; imports form no circle; move what they share into a file below them:\n    {0}"
    )]
    Circle(String),
    #[error("`{0}` is in no circle any more; this list only shrinks; remove the line")]
    MendedCircle(String),
    #[error("`{0}` is of the old vocabulary; the word is `{1}`; rename it")]
    OldWord(String, &'static str),
    #[error("`{0}` is no longer in the code; this list only shrinks; remove the line")]
    MendedWord(String),
}

impl Fault {
    /// The fault at a line of a file.
    pub fn at(self, path: &str, line: usize) -> Finding {
        Finding { path: path.to_owned(), line, fault: self }
    }

    /// The fault of a file as a whole.
    pub fn of(self, path: &str) -> Finding {
        self.at(path, 0)
    }
}
