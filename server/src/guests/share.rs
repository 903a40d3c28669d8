//! The processor share of a room with a guest's scene. Its use is measured, because even a scene within its budget may
//! be slow.

use crate::limits::GUEST_SHARE;
use std::time::{Duration, Instant};

/// A token bucket of processor time. It refills at 1/[`GUEST_SHARE`] of real time.
#[derive(Debug)]
pub struct ProcessorShare {
    left: Duration,
    max: Duration,
    /// Maximum processor time for one tick.
    tick_max: Duration,
    last: Option<(Instant, Duration)>,
}

impl ProcessorShare {
    /// Creates a full bucket that holds `excess`, from which one tick may take up to `tick_max`.
    pub fn new(excess: Duration, tick_max: Duration) -> ProcessorShare {
        ProcessorShare { left: excess, max: excess, tick_max, last: None }
    }

    /// Takes the processor time used since the previous call from the bucket; `worked` is the thread's total. Returns
    /// whether the bucket had enough and the time was within the limit for a tick. The first call only starts the
    /// count.
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

    /// Number of ticks, at most 100,000, that a room survives if each tick costs `cost`.
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
