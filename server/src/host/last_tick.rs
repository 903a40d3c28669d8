//! When a room last woke to play. Its thread writes this and everyone may read it, so that a room whose thread does not
//! answer is seen without asking it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The time at which a room's thread last woke for a tick. Starts at the time the room opens.
#[derive(Debug)]
pub struct LastTick {
    opened: Instant,
    /// Milliseconds from `opened` to that time.
    woke_ms: AtomicU64,
}

impl LastTick {
    /// That of a room that opens now.
    pub fn new(opened: Instant) -> LastTick {
        LastTick { opened, woke_ms: AtomicU64::new(0) }
    }

    /// The room's thread woke for a tick, whether or not it may play it.
    pub fn woke(&self, now: Instant) {
        let ms = now.saturating_duration_since(self.opened).as_millis() as u64;
        self.woke_ms.store(ms, Ordering::Relaxed);
    }

    pub fn age(&self, now: Instant) -> Duration {
        let woke = Duration::from_millis(self.woke_ms.load(Ordering::Relaxed));
        now.saturating_duration_since(self.opened).saturating_sub(woke)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_grows_until_the_room_wakes() {
        let opened = Instant::now();
        let after = |seconds| opened + Duration::from_secs(seconds);
        let last = LastTick::new(opened);
        assert_eq!(last.age(after(3)), Duration::from_secs(3), "a room that never woke");
        last.woke(after(5));
        assert_eq!(last.age(after(5)), Duration::ZERO);
        assert_eq!(last.age(after(17)), Duration::from_secs(12));
        assert_eq!(last.age(after(4)), Duration::ZERO, "a reader whose clock was read before");
    }
}
