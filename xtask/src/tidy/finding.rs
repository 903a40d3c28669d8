//! A finding of tidy: its position, the problem, the rule, and how to fix it.

use std::fmt::{self, Display};

/// A problem to fix, with its position.
#[derive(Debug, PartialEq)]
pub struct Finding {
    path: String,
    /// Line number, counted from 1; 0 for the file as a whole.
    line: usize,
    text: String,
}

impl Finding {
    /// Creates a finding at a line of a file.
    pub fn at(path: &str, line: usize, text: impl Into<String>) -> Finding {
        Finding { path: path.to_owned(), line, text: text.into() }
    }

    /// Creates a finding about a file as a whole.
    pub fn of(path: &str, text: impl Into<String>) -> Finding {
        Finding::at(path, 0, text)
    }
}

impl Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.path, self.text),
            line => write!(f, "{}:{line}: {}", self.path, self.text),
        }
    }
}
