//! The log of refusals, which any peer can cause at will. For each reason, one refusal per second is logged, along with
//! the number of earlier ones that were left out. Untrusted text is logged as [`Foreign`].

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter, Write};
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use tracing::info;

/// Minimum time between log lines about refusals for the same reason.
const REFUSAL_LOG_EVERY: Duration = Duration::from_secs(1);
/// Maximum number of characters of untrusted text shown in the log.
const FOREIGN_CHARS_MAX: usize = 64;

/// The time when a refusal was last logged for each reason. The number of reasons is small, since they are values of a
/// metric's label.
#[derive(Debug, Default)]
pub struct RefusalLog(Mutex<BTreeMap<&'static str, Logged>>);

#[derive(Debug)]
struct Logged {
    at: Instant,
    left_out: u64,
}

impl RefusalLog {
    /// Logs a refusal, unless one for the same reason was just logged.
    pub fn log(&self, reason: &'static str, address: IpAddr, about: impl Display) {
        if let Some(left_out) = self.admit(reason, Instant::now()) {
            info!(reason, %address, %about, left_out, "refused");
        }
    }

    /// If a refusal for this reason may be logged now, returns the number left out since the last logged one.
    pub fn admit(&self, reason: &'static str, now: Instant) -> Option<u64> {
        let mut reasons = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(logged) = reasons.get_mut(reason) else {
            reasons.insert(reason, Logged { at: now, left_out: 0 });
            return Some(0);
        };
        if now.saturating_duration_since(logged.at) < REFUSAL_LOG_EVERY {
            logged.left_out += 1;
            return None;
        }
        Some(std::mem::replace(logged, Logged { at: now, left_out: 0 }).left_out)
    }
}

/// Untrusted text in the form that the log uses: at most [`FOREIGN_CHARS_MAX`] characters, in quotes, with special
/// characters escaped.
#[derive(Debug)]
pub struct Foreign<'a>(pub &'a [u8]);

impl Display for Foreign<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        // A character takes at most four bytes, so the cut comes after the last one shown.
        let text = String::from_utf8_lossy(&self.0[..self.0.len().min(4 * FOREIGN_CHARS_MAX)]);
        let mut chars = text.chars();
        formatter.write_char('"')?;
        for char in chars.by_ref().take(FOREIGN_CHARS_MAX) {
            write!(formatter, "{}", char.escape_debug())?;
        }
        formatter.write_str(if chars.next().is_some() { "\"..." } else { "\"" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_a_second_and_reason_is_logged_with_the_count_of_the_rest() {
        let log = RefusalLog::default();
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        assert_eq!(log.admit("flood", at(0)), Some(0));
        for ms in 1..1000 {
            assert_eq!(log.admit("flood", at(ms)), None);
        }
        assert_eq!(log.admit("silent", at(500)), Some(0), "another reason");
        assert_eq!(log.admit("flood", at(1000)), Some(999));
        assert_eq!(log.admit("flood", at(1999)), None);
        assert_eq!(log.admit("flood", at(2500)), Some(1));
    }

    #[test]
    fn foreign_text_is_cut_and_escaped() {
        let shown = |bytes: &[u8]| Foreign(bytes).to_string();
        assert_eq!(shown(b"http://a.example"), "\"http://a.example\"");
        assert_eq!(shown(b"a\n\x1b[31m\"\xff"), "\"a\\n\\u{1b}[31m\\\"\u{fffd}\"");
        assert_eq!(shown(&[b'a'; 64]), format!("\"{}\"", "a".repeat(64)));
        assert_eq!(shown(&[b'a'; 16 << 10]), format!("\"{}\"...", "a".repeat(64)));
        let wide = "\u{1f600}".repeat(64);
        assert_eq!(shown(wide.as_bytes()), format!("\"{wide}\""));
    }
}
