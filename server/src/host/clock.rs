//! The time of a room's thread. A trait, so that tests can play hours and stalls in a moment.

use crate::host::run_queue::RunQueue;
use crate::host::thread_time;
use std::time::{Duration, Instant};

/// Where a room's thread takes the time from, and how it waits.
pub trait TickClock {
    /// The time now. Never goes back.
    fn now(&self) -> Instant;

    /// Sleeps until `at`, or longer. Returns for how long of that the thread was ready to run but had no
    /// processor; `None` where that is not counted.
    fn sleep_until(&mut self, at: Instant) -> Option<Duration>;

    /// Processor time that the thread has taken so far.
    fn worked(&self) -> Duration;
}

/// The system's monotonic clock.
pub struct SystemClock {
    run_queue: RunQueue,
}

impl SystemClock {
    /// The clock for the calling thread.
    pub fn of_this_thread() -> SystemClock {
        SystemClock { run_queue: RunQueue::of_this_thread() }
    }
}

impl TickClock for SystemClock {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn sleep_until(&mut self, at: Instant) -> Option<Duration> {
        let waited_before = self.run_queue.waited();
        std::thread::sleep(at.saturating_duration_since(Instant::now()));
        self.run_queue.waited_since(waited_before)
    }

    fn worked(&self) -> Duration {
        thread_time::taken()
    }
}
