//! Threads that do nothing but wake 60 times a second: how late one comes, and how long it waits for a
//! processor, is what any server would suffer here before it does anything; what others meet beside the
//! play, without having waited for a processor, it suffers as well.

use super::tally::{Spread, Tally};
use crate::limits::CATCH_UP_TICKS_MAX;
use crate::run_queue::RunQueue;
use crate::schedule::Schedule;
use jostle_sim::TICKS_PER_SECOND;
use serde::Serialize;
use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread::JoinHandle;
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
        let watch = std::thread::spawn(move || listen(|since| since < length));
        let watched = watch.join().expect("it only sleeps");
        Canary {
            late_ms: watched.late.spread(),
            queued_ms: watched.queued.map(|queued| queued.as_secs_f64() * 1e3),
            watched_ms: watched.length.as_secs_f64() * 1e3,
        }
    }

    /// Whether figures of this machine say nothing of a server.
    pub fn is_too_busy(&self) -> bool {
        self.late_ms.p99 > LATE_P99_MS_MAX
            || self.queued_ms.is_some_and(|queued| queued > QUEUED_SHARE_MAX * self.watched_ms)
    }
}

/// Idle threads beside the play, one for each processor. They compete with bots and server, so only what
/// they did not wait for a processor is told: then the machine itself stood still, as a virtual one does
/// while its host has others run.
pub struct Beside {
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Watched>>,
}

/// What no thread could do anything about.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Still {
    /// How late they woke, less the time that they waited for a processor.
    pub late_own_ms: Spread,
    /// Ticks that the one which fared worst would have missed for it, by a room's own rule.
    pub missed_ticks: u64,
}

impl Beside {
    /// Begins to watch; `None` where the system does not tell how long threads wait.
    pub fn begin() -> Option<Beside> {
        RunQueue::of_this_thread().waited()?;
        let over = Arc::new(AtomicBool::new(false));
        let count = std::thread::available_parallelism().map_or(1, NonZero::get);
        let watch = |_| {
            let over = Arc::clone(&over);
            std::thread::spawn(move || listen(|_| !over.load(Relaxed)))
        };
        let threads = (0..count).map(watch).collect();
        Some(Beside { over, threads })
    }

    /// Ends the watch.
    pub fn end(self) -> Still {
        self.over.store(true, Relaxed);
        let (mut own, mut missed_ticks) = (Tally::default(), 0);
        for thread in self.threads {
            let watched = thread.join().expect("it only sleeps");
            own.merge(&watched.own);
            missed_ticks = missed_ticks.max(watched.missed);
        }
        Still { late_own_ms: own.spread(), missed_ticks }
    }
}

struct Watched {
    late: Tally,
    /// Less the time in the queue of a processor.
    own: Tally,
    queued: Option<Duration>,
    length: Duration,
    /// Ticks that this alone would have cost.
    missed: u64,
}

/// Wakes at every tick for as long as `goes_on` says of the time since it began.
fn listen(goes_on: impl Fn(Duration) -> bool) -> Watched {
    let (start, run_queue) = (Instant::now(), RunQueue::of_this_thread());
    let begun = run_queue.waited();
    let mut schedule = Schedule::new(start);
    let (mut late, mut own, mut missed) = (Tally::default(), Tally::default(), 0);
    while goes_on(start.elapsed()) {
        let queued = run_queue.waited();
        let awaited = schedule.next_at();
        std::thread::sleep(awaited.saturating_duration_since(Instant::now()));
        let now = Instant::now();
        let after = now.saturating_duration_since(awaited);
        late.add(after);
        let after_own = after.saturating_sub(run_queue.waited_since(queued).unwrap_or_default());
        own.add(after_own);
        let behind = 1 + after_own.as_millis() as u64 * u64::from(TICKS_PER_SECOND) / 1000;
        missed += behind.saturating_sub(CATCH_UP_TICKS_MAX.into());
        schedule.due(now);
    }
    let queued = run_queue.waited_since(begun);
    Watched { late, own, queued, length: start.elapsed(), missed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

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

    #[test]
    fn a_thread_that_would_have_missed_ticks_says_how_many() {
        let missed = 2 + u64::from(CATCH_UP_TICKS_MAX);
        let pause = Duration::from_secs(1) * missed as u32 / TICKS_PER_SECOND;
        let turns = Cell::new(0);
        let watched = listen(|_| {
            std::thread::sleep(if turns.get() == 1 { pause } else { Duration::ZERO });
            turns.set(turns.get() + 1);
            turns.get() < 4
        });
        assert!(watched.missed >= 1 && watched.late.spread().max > 50.0);
        assert_eq!(watched.late.spread().count, 3);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn idle_threads_beside_a_play_see_every_tick() {
        let beside = Beside::begin().expect("Linux counts");
        std::thread::sleep(Duration::from_millis(60));
        assert!(beside.end().late_own_ms.count >= 2);
    }
}
