//! The processor share of a room with a guest's scene. It is measured, because a scene within its budget may still be
//! slow.

use crate::limits::GUEST_SHARE;
use std::time::{Duration, Instant};

/// A token bucket of processor time. It is refilled at one part in [`GUEST_SHARE`] of real time.
#[derive(Debug)]
pub struct ProcessorShare {
    left: Duration,
    max: Duration,
    /// Maximum work in one tick.
    tick_max: Duration,
    last: Option<(Instant, Duration)>,
}

impl ProcessorShare {
    /// Creates a full bucket of size `excess`, from which one tick may take `tick_max`.
    pub fn new(excess: Duration, tick_max: Duration) -> ProcessorShare {
        ProcessorShare { left: excess, max: excess, tick_max, last: None }
    }

    /// Takes the work since the last call from the bucket; `worked` is the total processor time of the room's thread.
    /// Returns whether the bucket had enough, and the work was within the limit for a tick. The first call only starts
    /// the count.
    pub fn spend(&mut self, now: Instant, worked: Duration) -> bool {
        let Some((then, worked_before)) = self.last.replace((now, worked)) else { return true };
        let gained = now.saturating_duration_since(then) / GUEST_SHARE;
        let spent = worked.saturating_sub(worked_before);
        let left = self.left.saturating_add(gained).min(self.max).checked_sub(spent);
        self.left = left.unwrap_or_default();
        left.is_some() && spent <= self.tick_max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_nanos(1_000_000_000 / 60);

    /// Number of ticks, at most 100,000, that a room survives if each tick takes `cost`.
    fn lasts(cost: Duration) -> u32 {
        let mut share = ProcessorShare::new(Duration::from_secs(5), TICK);
        let began = Instant::now();
        (0..100_000).find(|&tick| !share.spend(began + TICK * tick, cost * tick)).unwrap_or(100_000)
    }

    #[test]
    fn a_room_within_its_share_lasts_and_another_ends_the_sooner_the_more_it_takes() {
        assert_eq!(lasts(TICK / GUEST_SHARE), 100_000);
        assert_eq!(lasts(TICK / 4).div_ceil(60), 40, "seconds at twice the share");
        assert_eq!(lasts(TICK).div_ceil(60), 6, "seconds at a whole processor");
    }

    #[test]
    fn a_single_tick_that_takes_too_long_ends_a_room_that_has_saved_up() {
        let mut share = ProcessorShare::new(Duration::from_secs(5), 6 * TICK);
        let began = Instant::now();
        assert!(share.spend(began, Duration::ZERO));
        assert!(share.spend(began, 6 * TICK));
        assert!(!share.spend(began, 13 * TICK));
    }

    #[test]
    fn time_that_was_not_used_is_saved_up_to_the_excess_only() {
        let mut share = ProcessorShare::new(Duration::from_secs(1), Duration::MAX);
        let began = Instant::now();
        assert!(share.spend(began, Duration::from_secs(7)), "the first call only begins to count");
        assert!(share.spend(began + Duration::from_secs(3600), Duration::from_secs(8)));
        assert!(!share.spend(began + Duration::from_secs(3600), Duration::from_millis(8001)));
    }
}
