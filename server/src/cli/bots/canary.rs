//! A thread that does nothing but wake 60 times a second: how late it comes, and how long it waits for
//! a processor, is what any server would suffer here before it does anything.

use super::tally::{Spread, Tally};
use crate::run_queue::RunQueue;
use crate::schedule::Schedule;
use serde::Serialize;
use std::time::{Duration, Instant};

/// A machine whose idle thread comes later than this once in a hundred times is too busy to judge.
const LATE_P99_MS_MAX: f64 = 1.0;
/// And so is one that lets it wait this share of the time for a processor.
const QUEUED_SHARE_MAX: f64 = 0.005;

/// What the thread met.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Canary {
    /// How late it woke.
    pub late_ms: Spread,
    /// Time that it waited for a processor, if the system tells.
    pub queued_ms: Option<f64>,
    /// Time of the whole watch.
    pub watched_ms: f64,
}

impl Canary {
    /// Watches for so long, on a thread of its own, which this waits for.
    pub fn watch(length: Duration) -> Canary {
        std::thread::spawn(move || listen(length)).join().expect("it only sleeps")
    }

    /// Whether figures of this machine say nothing of a server.
    pub fn is_too_busy(&self) -> bool {
        self.late_ms.p99 > LATE_P99_MS_MAX
            || self.queued_ms.is_some_and(|queued| queued > QUEUED_SHARE_MAX * self.watched_ms)
    }
}

fn listen(length: Duration) -> Canary {
    let (start, run_queue) = (Instant::now(), RunQueue::of_this_thread());
    let queued_before = run_queue.waited();
    let (mut schedule, mut late) = (Schedule::new(start), Tally::default());
    while start.elapsed() < length {
        let awaited = schedule.next_at();
        std::thread::sleep(awaited.saturating_duration_since(Instant::now()));
        let now = Instant::now();
        late.add(now.saturating_duration_since(awaited));
        schedule.due(now);
    }
    let queued = run_queue.waited_since(queued_before);
    Canary {
        late_ms: late.spread(),
        queued_ms: queued.map(|queued| queued.as_secs_f64() * 1e3),
        watched_ms: start.elapsed().as_secs_f64() * 1e3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_wakes_and_long_queues_are_told_from_a_quiet_machine() {
        let quiet = Canary {
            late_ms: Spread { p99: 0.2, ..Spread::default() },
            queued_ms: Some(1.0),
            watched_ms: 3000.0,
        };
        assert!(!quiet.is_too_busy());
        assert!(!Canary { queued_ms: None, ..quiet }.is_too_busy());
        assert!(Canary { queued_ms: Some(100.0), ..quiet }.is_too_busy());
        let late_ms = Spread { p99: 3.0, ..Spread::default() };
        assert!(Canary { late_ms, ..quiet }.is_too_busy());
    }
}
