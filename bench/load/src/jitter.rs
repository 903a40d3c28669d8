//! Idle threads that wake at 60 Hz. Their lateness is the machine's own jitter, a lower bound for the server's.

use jostle_cli::bots::histogram::{Durations, Percentiles};
use jostle_server::host::clock::RunQueue;
use jostle_server::host::ticker::schedule::Schedule;
use jostle_server::limits::CATCH_UP_TICKS_MAX;
use jostle_sim::TICKS_PER_SECOND;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// If the p99 lateness of an idle thread exceeds this, the machine is too busy for meaningful figures.
const LATE_P99_MS_MAX: f64 = 1.0;
/// If an idle thread waits for a processor during more than this share of the time, the machine is too busy as well.
const QUEUED_SHARE_MAX: f64 = 0.005;

pub struct JitterProbe {
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Watched>>,
}

/// The machine's jitter while a probe ran.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Jitter {
    /// Lateness of all threads together.
    pub late_ms: Percentiles,
    /// Lateness without waits for a processor. A virtual machine is also paused while its host runs others, and no run
    /// queue shows that.
    pub late_own_ms: Percentiles,
    /// Share of time spent waiting for a processor; `None` if the system does not report it.
    pub queued_share: Option<f64>,
    /// Number of ticks that a room would have missed with the worst thread's lateness, excluding waits for a processor.
    pub missed_ticks: u64,
}

impl JitterProbe {
    pub fn start(threads: usize) -> JitterProbe {
        let over = Arc::new(AtomicBool::new(false));
        let start = |_| {
            let over = Arc::clone(&over);
            std::thread::spawn(move || {
                let clock = MachineClock(RunQueue::of_this_thread());
                watch(&clock, || over.load(Relaxed))
            })
        };
        let threads = (0..threads).map(start).collect();
        JitterProbe { over, threads }
    }

    pub fn stop(self) -> Jitter {
        self.over.store(true, Relaxed);
        let watched = self.threads.into_iter().map(|thread| thread.join().expect("it only sleeps"));
        Jitter::of(&watched.collect::<Vec<_>>())
    }
}

impl Jitter {
    fn of(threads: &[Watched]) -> Jitter {
        let (mut late, mut own) = (Durations::default(), Durations::default());
        for watched in threads {
            late.merge(&watched.late);
            own.merge(&watched.own);
        }
        let queued: Option<Duration> = threads.iter().map(|watched| watched.queued).sum();
        let length: Duration = threads.iter().map(|watched| watched.length).sum();
        Jitter {
            late_ms: late.percentiles(),
            late_own_ms: own.percentiles(),
            queued_share: queued
                .map(|queued| queued.as_secs_f64() / length.as_secs_f64().max(1e-9)),
            missed_ticks: threads.iter().map(|watched| watched.missed).max().unwrap_or(0),
        }
    }

    /// Whether this machine is too busy to say anything about a server.
    pub fn is_too_busy(&self) -> bool {
        self.late_ms.p99 > LATE_P99_MS_MAX
            || self.queued_share.is_some_and(|share| share > QUEUED_SHARE_MAX)
    }
}

/// Source of a thread's clock and run-queue wait, which tests replace.
trait Clock {
    fn now(&self) -> Instant;
    fn sleep_until(&self, at: Instant);
    /// Time spent waiting for a processor so far.
    fn waited(&self) -> Option<Duration>;
}

struct MachineClock(RunQueue);

impl Clock for MachineClock {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn sleep_until(&self, at: Instant) {
        std::thread::sleep(at.saturating_duration_since(Instant::now()));
    }

    fn waited(&self) -> Option<Duration> {
        self.0.waited()
    }
}

/// Measurements from one thread.
struct Watched {
    late: Durations,
    /// Lateness excluding waits for a processor.
    own: Durations,
    queued: Option<Duration>,
    length: Duration,
    /// Number of ticks missed because of `own` alone.
    missed: u64,
}

/// Wakes at every tick until `is_over` returns true.
fn watch(clock: &impl Clock, is_over: impl Fn() -> bool) -> Watched {
    let (start, begun) = (clock.now(), clock.waited());
    let since = |before: Option<Duration>| Some(clock.waited()?.saturating_sub(before?));
    let mut schedule = Schedule::new(start);
    let (mut late, mut own, mut missed) = (Durations::default(), Durations::default(), 0);
    while !is_over() {
        let (queued, due) = (clock.waited(), schedule.next_at());
        clock.sleep_until(due);
        let now = clock.now();
        let after = now.saturating_duration_since(due);
        late.record(after);
        let after_own = after.saturating_sub(since(queued).unwrap_or_default());
        own.record(after_own);
        let behind = 1 + after_own.as_millis() as u64 * u64::from(TICKS_PER_SECOND) / 1000;
        missed += behind.saturating_sub(CATCH_UP_TICKS_MAX.into());
        schedule.due(now);
    }
    let length = clock.now().saturating_duration_since(start);
    Watched { late, own, queued: since(begun), length, missed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// A clock that follows a script of late wakeups, with part of each delay spent waiting for a processor.
    struct ScriptedClock<'a> {
        now: Cell<Instant>,
        waited: Cell<Duration>,
        script: &'a [(Duration, Duration)],
        wakes: Cell<usize>,
    }

    impl Clock for ScriptedClock<'_> {
        fn now(&self) -> Instant {
            self.now.get()
        }

        fn sleep_until(&self, at: Instant) {
            let (late, queued) = self.script[self.wakes.replace(self.wakes.get() + 1)];
            self.now.set(at.max(self.now.get()) + late);
            self.waited.set(self.waited.get() + queued);
        }

        fn waited(&self) -> Option<Duration> {
            Some(self.waited.get())
        }
    }

    fn play(script: &[(Duration, Duration)]) -> Watched {
        let clock = ScriptedClock {
            now: Cell::new(Instant::now()),
            waited: Cell::default(),
            script,
            wakes: Cell::new(0),
        };
        watch(&clock, || clock.wakes.get() == script.len())
    }

    #[test]
    fn a_late_thread_counts_the_ticks_it_would_have_missed() {
        let stall = Duration::from_secs(1) * (2 + CATCH_UP_TICKS_MAX) / TICKS_PER_SECOND;
        let quiet = (Duration::from_micros(100), Duration::ZERO);
        let watched = play(&[quiet, (stall, Duration::ZERO), quiet]);
        assert_eq!((watched.missed, watched.late.percentiles().count), (2, 3));
        let busy = play(&[quiet, (stall, stall), quiet]);
        assert_eq!(busy.missed, 0, "a wait for a processor is no stall");
        assert_eq!(busy.queued, Some(stall));
        let jitter = Jitter::of(&[watched, busy]);
        assert_eq!((jitter.missed_ticks, jitter.late_ms.count), (2, 6));
    }

    #[test]
    fn late_wakes_and_long_queues_are_too_busy() {
        let quiet = Jitter {
            late_ms: Percentiles { p99: 0.2, ..Percentiles::default() },
            queued_share: Some(0.001),
            ..Jitter::default()
        };
        assert!(!quiet.is_too_busy() && !Jitter { queued_share: None, ..quiet }.is_too_busy());
        assert!(Jitter { queued_share: Some(0.1), ..quiet }.is_too_busy());
        let late_ms = Percentiles { p99: 3.0, ..Percentiles::default() };
        assert!(Jitter { late_ms, ..quiet }.is_too_busy());
    }

    #[test]
    fn a_probe_wakes_until_it_is_stopped() {
        let probe = JitterProbe::start(1);
        assert!(probe.stop().late_ms.count < 1000);
    }
}
