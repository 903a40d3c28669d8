//! How commands answer: lines on stdout, and the reason why they failed.

use serde::Serialize;
use std::fmt::Display;
use std::io::Write;

/// Why a command ended without success.
#[derive(Debug)]
pub enum Failure {
    /// Something was checked and is wrong, or did not work: status 1.
    Check(String),
    /// The command line asks for something that is not there: status 2.
    Usage(String),
}

/// Text of a report.
pub fn json(report: &impl Serialize) -> String {
    serde_json::to_string(report).expect("reports hold strings and numbers only")
}

/// Prints a line. Whoever closes our stdout, as `head` does, has seen enough.
pub fn say(line: impl Display) -> Result<(), Failure> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Check(format!("stdout: {error}")))
        }
        _ => Ok(()),
    }
}
