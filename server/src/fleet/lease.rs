//! A node's lease as its rooms see it. Before each tick, a room checks whether it may still be played here.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// This node's lease. Rooms read it; the fleet's task extends it.
#[derive(Debug)]
pub struct Lease {
    epoch_of_clock: Instant,
    /// End of the lease, in nanoseconds since `epoch_of_clock`.
    until: AtomicU64,
    incarnation: AtomicU64,
}

impl Lease {
    /// Creates a lease that is not valid yet. Times are counted from `start`.
    pub fn new(start: Instant) -> Lease {
        Lease { epoch_of_clock: start, until: AtomicU64::new(0), incarnation: AtomicU64::new(0) }
    }

    /// Extends this incarnation's lease. If the incarnation has changed, the previous incarnation's rooms pause first.
    pub fn set(&self, incarnation: u64, until: Duration) {
        if self.incarnation.swap(incarnation, Ordering::SeqCst) != incarnation {
            self.until.store(0, Ordering::SeqCst);
        }
        self.until.store(until.as_nanos() as u64, Ordering::SeqCst);
    }

    /// Time left on the lease.
    pub fn left(&self, now: Instant) -> Duration {
        let until = Duration::from_nanos(self.until.load(Ordering::SeqCst));
        (self.epoch_of_clock + until).saturating_duration_since(now)
    }
}

/// The lease under which a room is held.
#[derive(Clone, Debug)]
pub struct RoomLease {
    lease: Arc<Lease>,
    held_under: Arc<AtomicU64>,
}

impl RoomLease {
    /// The lease of a room held by this incarnation of the node.
    pub fn new(lease: Arc<Lease>, incarnation: u64) -> RoomLease {
        RoomLease { lease, held_under: Arc::new(AtomicU64::new(incarnation)) }
    }

    /// Moves the room to another incarnation of the node.
    pub fn renew(&self, incarnation: u64) {
        self.held_under.store(incarnation, Ordering::SeqCst);
    }

    /// Returns whether the room may be played at this time.
    pub fn allows(&self, now: Instant) -> bool {
        // The order matters: the time left may belong to an incarnation that has just started.
        self.lease.left(now) > Duration::ZERO
            && self.lease.incarnation.load(Ordering::SeqCst)
                == self.held_under.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_is_played_while_the_lease_lasts_and_is_held_under_it() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let lease = Arc::new(Lease::new(start));
        let room = RoomLease::new(Arc::clone(&lease), 7);
        assert!(!room.allows(at(0)), "before it begins");
        lease.set(7, Duration::from_secs(15));
        assert!(room.allows(at(14)) && !room.allows(at(15)));
        lease.set(8, Duration::from_secs(30));
        assert!(!room.allows(at(16)), "another incarnation has to claim the room first");
        room.renew(8);
        assert!(room.allows(at(29)) && !room.allows(at(31)));
    }
}
