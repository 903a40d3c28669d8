//! The clock of a room's thread. It is a trait, so that tests can simulate hours and stalls instantly.

use crate::host::thread_time;
use std::fs::File;
use std::io::{Read, Seek};
use std::time::{Duration, Instant};

/// The time source for a room's thread, and its means of waiting.
pub trait TickClock {
    /// The current time, which never goes backwards.
    fn now(&self) -> Instant;

    /// Sleeps until `at`, or longer. Returns how long the thread was ready to run but had no processor; `None` if the
    /// system does not measure that.
    fn sleep_until(&mut self, at: Instant) -> Option<Duration>;

    /// Processor time that the thread has used so far.
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

/// Scheduling statistics of one thread: how long it was ready to run but had no processor. That delay makes ticks late
/// too, but the machine causes it; the server causes the rest. It is measured only on Linux.
pub struct RunQueue {
    counts: Option<File>,
}

impl RunQueue {
    /// Opens the calling thread's statistics.
    pub fn of_this_thread() -> RunQueue {
        RunQueue { counts: File::open("/proc/thread-self/schedstat").ok() }
    }

    /// Total waiting time so far; `None` if the system does not measure it.
    pub fn waited(&self) -> Option<Duration> {
        let mut bytes = [0; 96];
        let mut file = self.counts.as_ref()?;
        file.rewind().ok()?;
        let length = file.read(&mut bytes).ok()?;
        waited(str::from_utf8(&bytes[..length]).ok()?)
    }

    /// Waiting time since [`RunQueue::waited`] returned `before`. Never negative.
    pub fn waited_since(&self, before: Option<Duration>) -> Option<Duration> {
        Some(self.waited()?.saturating_sub(before?))
    }
}

/// Parses the second of three numbers: nanoseconds on a processor, nanoseconds waiting for one, time slices.
fn waited(schedstat: &str) -> Option<Duration> {
    let nanos = schedstat.split_ascii_whitespace().nth(1)?;
    nanos.parse().ok().map(Duration::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_number_is_the_wait() {
        assert_eq!(waited("12 3400 5\n"), Some(Duration::from_nanos(3400)));
        assert_eq!(waited(""), None);
        assert_eq!(waited("1 x 2"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_thread_is_counted_and_only_ever_waits_longer() {
        let counts = RunQueue::of_this_thread();
        let before = counts.waited().expect("a count");
        std::thread::yield_now();
        assert!(counts.waited().expect("a count") >= before);
        assert_eq!(counts.waited_since(Some(Duration::MAX)), Some(Duration::ZERO));
        assert_eq!(counts.waited_since(None), None);
    }
}
