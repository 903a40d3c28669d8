//! The tick schedule. Tick n is due at `start + n / 60 s`, whatever happened before. The schedule also keeps track of
//! missed ticks and of the time spent on each phase. It is pure, so that it can be tested without waiting; the room's
//! thread passes the time in.

use crate::limits::CATCH_UP_TICKS_MAX;
use jostle_sim::TICKS_PER_SECOND;
use std::time::{Duration, Instant};
use tracing::warn;

/// Minimum time between log lines about a room's missed ticks.
const MISSED_LOG_EVERY: Duration = Duration::from_secs(1);

/// An absolute 60 Hz schedule, so that errors in individual sleeps do not add up.
#[derive(Debug)]
pub struct Schedule {
    start: Instant,
    /// Number of 1/60 s slots that were played or skipped.
    slots: u64,
    /// Number of slots that were skipped.
    missed: u64,
}

impl Schedule {
    /// Creates a schedule whose first tick is due 1/60 s after `start`.
    pub fn new(start: Instant) -> Schedule {
        Schedule { start, slots: 0, missed: 0 }
    }

    /// The time when the next tick is due.
    pub fn next_at(&self) -> Instant {
        let nanos = (self.slots + 1) * 1_000_000_000 / u64::from(TICKS_PER_SECOND);
        self.start + Duration::from_nanos(nanos)
    }

    /// Returns the number of ticks to play now, at most [`CATCH_UP_TICKS_MAX`]; any further slots count as missed.
    pub fn due(&mut self, now: Instant) -> u32 {
        let elapsed = now.saturating_duration_since(self.start).as_nanos();
        // `next_at` rounds a slot down by at most a nanosecond.
        let reached = (elapsed + 1) * u128::from(TICKS_PER_SECOND) / 1_000_000_000;
        let behind = (reached as u64).saturating_sub(self.slots);
        let played = behind.min(u64::from(CATCH_UP_TICKS_MAX));
        self.missed += behind - played;
        self.slots += behind;
        played as u32
    }

    /// Skips everything due until now, which counts as neither played nor missed. Returns no ticks.
    pub fn pass(&mut self, now: Instant) -> u32 {
        let missed = self.missed;
        self.due(now);
        self.missed = missed;
        0
    }

    /// Number of ticks that were due but never played.
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

/// The time spent in each phase of a wakeup.
pub struct Stopwatch {
    since: Instant,
    /// Time spent in each phase so far: inputs, play, send.
    pub laps: [Duration; 3],
}

impl Stopwatch {
    /// Starts in the first phase.
    pub fn start(now: Instant) -> Stopwatch {
        Stopwatch { since: now, laps: [Duration::ZERO; 3] }
    }

    /// Ends a phase and begins the next.
    pub fn lap(&mut self, phase: usize, now: Instant) {
        self.laps[phase] += now - self.since;
        self.since = now;
    }
}

/// Logs missed ticks, with at most one line per [`MISSED_LOG_EVERY`].
#[derive(Default)]
pub struct Missed {
    logged: u64,
    logged_at: Option<Instant>,
}

impl Missed {
    /// Updates the total number of missed ticks.
    pub fn report(&mut self, room: &str, missed: u64, now: Instant) {
        let quiet = self.logged_at.is_some_and(|at| now - at < MISSED_LOG_EVERY);
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
    fn each_slot_is_due_exactly_when_it_says() {
        let start = Instant::now();
        let mut schedule = Schedule::new(start);
        for _ in 0..1000 {
            let at = schedule.next_at();
            assert_eq!(schedule.due(at - Duration::from_nanos(2)), 0);
            assert_eq!(schedule.due(at), 1);
            assert_eq!(schedule.due(at), 0);
        }
        assert_eq!(schedule.missed(), 0);
    }

    #[test]
    fn ticks_do_not_drift_over_a_day() {
        let start = Instant::now();
        let mut schedule = Schedule::new(start);
        schedule.due(start + Duration::from_secs(86_400));
        let next = schedule.next_at() - start;
        assert!(next > Duration::from_secs(86_400));
        assert!(next < Duration::from_secs(86_400) + Duration::from_millis(17));
    }

    #[test]
    fn a_short_stall_is_caught_up_and_a_long_one_skipped() {
        let start = Instant::now();
        let mut schedule = Schedule::new(start);
        assert_eq!(schedule.due(start + Duration::from_millis(70)), 4);
        assert_eq!(schedule.missed(), 0);
        assert_eq!(schedule.due(start + Duration::from_millis(1000)), CATCH_UP_TICKS_MAX);
        assert_eq!(schedule.missed(), 60 - 4 - u64::from(CATCH_UP_TICKS_MAX));
        assert_eq!(schedule.due(start + Duration::from_millis(1017)), 1);
        let missed = schedule.missed();
        assert_eq!(schedule.pass(start + Duration::from_millis(5000)), 0);
        assert_eq!(schedule.due(start + Duration::from_millis(5017)), 1);
        assert_eq!(schedule.missed(), missed, "what is passed over is not missed");
    }

    #[test]
    fn missed_ticks_are_logged_at_most_once_a_second() {
        let mut missed = Missed::default();
        let start = Instant::now();
        missed.report("arena", 3, start);
        assert_eq!(missed.logged, 3);
        missed.report("arena", 9, start + MISSED_LOG_EVERY / 2);
        assert_eq!(missed.logged, 3);
        missed.report("arena", 9, start + MISSED_LOG_EVERY);
        assert_eq!(missed.logged, 9);
    }
}
