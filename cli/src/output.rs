//! Commands' results: lines on stdout, or the reason for a failure.

use serde::Serialize;
use std::fmt::Display;
use std::io::Write;

/// The reason why a command did not succeed.
#[derive(Debug)]
pub enum Failure {
    /// A check failed, or an operation did not work. Exits with status 1.
    Check(String),
    /// The command line names something that does not exist. Exits with status 2.
    Usage(String),
}

/// Turns an error into a failure whose text begins with what was attempted.
pub trait OrFail<T> {
    /// Turns the error into [`Failure::Check`].
    fn or_check(self, what: impl Display) -> Result<T, Failure>;
    /// Turns the error into [`Failure::Usage`].
    fn or_usage(self, what: impl Display) -> Result<T, Failure>;
}

impl<T, E: Display> OrFail<T> for Result<T, E> {
    fn or_check(self, what: impl Display) -> Result<T, Failure> {
        self.map_err(|error| Failure::Check(format!("{what}: {error}")))
    }

    fn or_usage(self, what: impl Display) -> Result<T, Failure> {
        self.map_err(|error| Failure::Usage(format!("{what}: {error}")))
    }
}

/// A report as JSON.
pub fn json(report: &impl Serialize) -> String {
    serde_json::to_string(report).expect("reports hold strings and numbers only")
}

/// Makes text safe for a terminal. Text from files or the network could contain sequences that move the cursor, change
/// colours or do worse.
pub fn plain(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for char in text.chars() {
        match char {
            '\n' | '\t' => shown.push(char),
            _ if char.is_control() => shown.extend(char.escape_default()),
            _ => shown.push(char),
        }
    }
    shown
}

/// Prints a line. If the reader has closed stdout, as `head` does, that is not an error.
pub fn say(line: impl Display) -> Result<(), Failure> {
    match writeln!(std::io::stdout(), "{}", plain(&line.to_string())) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.or_check("stdout"),
    }
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn no_text_controls_the_terminal() {
        assert_eq!(plain("two\n\tlines, äöü"), "two\n\tlines, äöü");
        let evil = "\u{1b}]0;title\u{7}\u{1b}[2J\r\u{9b}31m\u{7f}";
        let shown = plain(evil);
        assert_eq!(shown, "\\u{1b}]0;title\\u{7}\\u{1b}[2J\\r\\u{9b}31m\\u{7f}");
        assert!(!shown.chars().any(char::is_control));
    }
}
