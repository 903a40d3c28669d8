//! The lag of a client, measured by the ticks that its inputs acknowledge. Bytes that wait in kernel buffers
//! and proxies on the way count as sent at this end of the socket; here they do not. A long round trip is no
//! lag: a client is compared with itself, at the best of its last minute.

use crate::limits::{LAG_GROWTH_TICKS, LAG_TICKS_MAX, LAG_WINDOW_TICKS, LAGGING_TICKS};

/// The ticks that one client was sent and has acknowledged.
#[derive(Clone, Debug)]
pub struct AckLag {
    /// Ticks of the newest snapshot that was sent, and of the newest that was acknowledged.
    sent: u32,
    acked: u32,
    /// When `acked` last grew, or there was nothing left to acknowledge.
    moved: u32,
    /// Ticks from the newest acknowledged to the newest sent, at the client's last input.
    behind: u32,
    /// Least `behind` in this window and in the one before.
    least: [u32; 2],
    window_began: u32,
    /// Tick since which it is more than the round trip explains.
    lagging_since: Option<u32>,
}

impl AckLag {
    /// A client that is sent its first snapshot at this tick.
    pub fn new(tick: u32) -> AckLag {
        AckLag {
            sent: tick,
            acked: tick,
            moved: tick,
            behind: 0,
            least: [u32::MAX; 2],
            window_began: tick,
            lagging_since: None,
        }
    }

    /// Notes that a snapshot of this tick was sent. While nothing moves a keyframe may be older than the snapshot
    /// before it: then the keyframe is the newest that can be acknowledged.
    pub fn sent(&mut self, tick: u32) {
        if self.acked == self.sent {
            self.moved = tick;
        }
        self.sent = tick;
        self.acked = self.acked.min(tick);
    }

    /// Notes the low bits of the tick that an input acknowledges. A client that acknowledges a tick not yet
    /// sent is treated as up to date.
    pub fn acked(&mut self, low: u16, now: u32) {
        let behind = u32::from((self.sent as u16).wrapping_sub(low));
        let behind = if behind < 1 << 15 { behind } else { 0 };
        let acked = self.sent.saturating_sub(behind);
        if acked > self.acked {
            (self.acked, self.moved) = (acked, now);
        }
        self.behind = self.sent - self.acked;
        if now - self.window_began >= LAG_WINDOW_TICKS {
            self.least = [u32::MAX, self.least[0]];
            self.window_began = now;
        }
        self.least[0] = self.least[0].min(self.behind);
        let usual = self.least[0].min(self.least[1]);
        let lags = self.behind > usual + LAG_GROWTH_TICKS || self.behind > LAG_TICKS_MAX;
        self.lagging_since = lags.then(|| self.lagging_since.unwrap_or(now));
    }

    /// Ticks from the newest snapshot acknowledged to the newest sent.
    pub fn ticks(&self) -> u32 {
        self.behind
    }

    /// Returns whether it lags for long enough to get a lower rate.
    pub fn lags(&self, now: u32) -> bool {
        self.lagging_since.is_some_and(|since| now - since >= LAGGING_TICKS)
    }

    /// Notes that its rate is lower from now on, so that it has time to catch up.
    pub fn restart(&mut self, now: u32) {
        self.lagging_since = self.lagging_since.map(|_| now);
    }

    /// Returns whether it is sent snapshots and has acknowledged none for `ticks_max` ticks.
    pub fn is_silent(&self, now: u32, ticks_max: u32) -> bool {
        self.sent > self.acked && now - self.moved >= ticks_max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays a client that is sent each of these ticks and acknowledges it `behind` ticks later.
    fn plays(lag: &mut AckLag, ticks: std::ops::Range<u32>, behind: impl Fn(u32) -> u32) {
        for tick in ticks {
            lag.sent(tick);
            lag.acked(tick.saturating_sub(behind(tick)) as u16, tick);
        }
    }

    #[test]
    fn a_long_round_trip_and_a_stall_are_no_lag_and_growth_is() {
        let mut lag = AckLag::new(0);
        plays(&mut lag, 1..600, |_| 24);
        // A stall of half a second now and then.
        plays(&mut lag, 600..1200, |tick| 24 + (30 - tick as i32 % 150).max(0) as u32);
        assert!(!lag.lags(1200) && lag.ticks() == 24);
        plays(&mut lag, 1200..1200 + LAGGING_TICKS, |_| 25 + LAG_GROWTH_TICKS);
        assert!(!lag.lags(1199 + LAGGING_TICKS));
        plays(&mut lag, 1200 + LAGGING_TICKS..1300 + LAGGING_TICKS, |_| 25 + LAG_GROWTH_TICKS);
        assert!(lag.lags(1300 + LAGGING_TICKS));
        lag.restart(1300 + LAGGING_TICKS);
        assert!(!lag.lags(1301 + LAGGING_TICKS), "it has time to catch up");
        plays(&mut lag, 1400 + LAGGING_TICKS..1402 + LAGGING_TICKS, |_| 26);
        assert!(!lag.lags(u32::MAX));
    }

    #[test]
    fn a_longer_round_trip_is_accepted_in_the_end_up_to_a_limit() {
        let mut lag = AckLag::new(0);
        plays(&mut lag, 1..100, |_| 5);
        plays(&mut lag, 100..100 + 2 * LAG_WINDOW_TICKS, |_| 6 + LAG_GROWTH_TICKS);
        assert!(!lag.lags(100 + 2 * LAG_WINDOW_TICKS));
        plays(&mut lag, 10_000..20_000, |_| LAG_TICKS_MAX + 1);
        assert!(lag.lags(20_000));
    }

    #[test]
    fn a_client_is_silent_if_it_acknowledges_nothing_that_it_is_sent() {
        let mut lag = AckLag::new(70_000);
        assert!(!lag.is_silent(90_000, 1200), "nothing moved, nothing was sent");
        lag.sent(90_000);
        assert!(!lag.is_silent(91_199, 1200) && lag.is_silent(91_200, 1200));
        // An old acknowledgement does not help; the low bits are of some ticks ago.
        lag.acked(70_000u32 as u16, 91_200);
        assert!(lag.is_silent(91_200, 1200));
        lag.acked(90_000u32 as u16, 91_200);
        assert!(!lag.is_silent(95_000, 1200));
        lag.sent(95_000);
        lag.acked(96_000u32 as u16, 95_001);
        assert_eq!((lag.ticks(), lag.is_silent(99_999, 1200)), (0, false), "the future");
    }

    #[test]
    fn a_restart_with_an_older_keyframe_is_no_lag() {
        let mut lag = AckLag::new(0);
        plays(&mut lag, 1..100, |_| 0);
        lag.sent(90);
        for low in [99, 90] {
            lag.acked(low, 120);
            assert_eq!((lag.ticks(), lag.is_silent(9000, 1200)), (0, false));
        }
        lag.sent(121);
        lag.acked(90, 125);
        assert_eq!(lag.ticks(), 31);
    }
}
