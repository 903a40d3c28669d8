//! How a room's thread spends its time, and the ticks that it misses.

use crate::limits;
use std::time::{Duration, Instant};
use tracing::warn;

/// Time by phase of a wakeup.
pub struct Stopwatch {
    since: Instant,
    /// Time in each phase so far: inputs, play, send.
    pub laps: [Duration; 3],
}

impl Stopwatch {
    /// Starts in the first phase.
    pub fn start(now: Instant) -> Stopwatch {
        Stopwatch { since: now, laps: [Duration::ZERO; 3] }
    }

    /// Ends a phase, and begins the next.
    pub fn lap(&mut self, phase: usize, now: Instant) {
        self.laps[phase] += now - self.since;
        self.since = now;
    }
}

/// The log of missed ticks, one line at most in [`limits::MISSED_LOG_EVERY`].
#[derive(Default)]
pub struct Missed {
    logged: u64,
    logged_at: Option<Instant>,
}

impl Missed {
    /// Takes the number of ticks missed so far.
    pub fn report(&mut self, room: &str, missed: u64, now: Instant) {
        let quiet = self.logged_at.is_some_and(|at| now - at < limits::MISSED_LOG_EVERY);
        if missed > self.logged && !quiet {
            warn!(%room, ticks = missed - self.logged, in_all = missed, "missed ticks");
            *self = Missed { logged: missed, logged_at: Some(now) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missed_ticks_are_logged_at_most_once_a_second() {
        let mut missed = Missed::default();
        let start = Instant::now();
        missed.report("arena", 3, start);
        assert_eq!(missed.logged, 3);
        missed.report("arena", 9, start + limits::MISSED_LOG_EVERY / 2);
        assert_eq!(missed.logged, 3);
        missed.report("arena", 9, start + limits::MISSED_LOG_EVERY);
        assert_eq!(missed.logged, 9);
    }
}
