//! How far a client is behind, by the ticks that its inputs say it heard. What waits in kernel buffers
//! and proxies on the way looks sent from this end of the socket; here it does not. A long way is no
//! lag: a client is compared with itself, at the best of its last minute.

use crate::limits::{LAG_GROWTH_TICKS, LAG_TICKS_MAX, LAG_WINDOW_TICKS, LAGGING_TICKS};

/// What one client was sent and heard.
#[derive(Clone, Debug)]
pub struct Lag {
    /// Ticks of the newest snapshot that was sent, and of the newest that was heard.
    sent: u32,
    heard: u32,
    /// When `heard` last grew, or there was nothing left to hear.
    moved: u32,
    /// From the newest that was sent to the newest that was heard, at the client's last word.
    behind: u32,
    /// Least of it in this window and in the one before.
    least: [u32; 2],
    window_began: u32,
    /// Since when it is more than the way explains.
    lagging_since: Option<u32>,
}

impl Lag {
    /// A client that is sent its first snapshot at this tick.
    pub fn new(tick: u32) -> Lag {
        Lag {
            sent: tick,
            heard: tick,
            moved: tick,
            behind: 0,
            least: [u32::MAX; 2],
            window_began: tick,
            lagging_since: None,
        }
    }

    /// A snapshot of this tick is on its way. While nothing moves a keyframe may be older than what was
    /// sent before: then that is the newest that can be heard.
    pub fn sent(&mut self, tick: u32) {
        if self.heard == self.sent {
            self.moved = tick;
        }
        self.sent = tick;
        self.heard = self.heard.min(tick);
    }

    /// An input of now says what was heard, by its low bits. Who claims the future is told as little as
    /// who is up to date.
    pub fn heard(&mut self, low: u16, now: u32) {
        let behind = u32::from((self.sent as u16).wrapping_sub(low));
        let behind = if behind < 1 << 15 { behind } else { 0 };
        let heard = self.sent.saturating_sub(behind);
        if heard > self.heard {
            (self.heard, self.moved) = (heard, now);
        }
        self.behind = self.sent - self.heard;
        if now - self.window_began >= LAG_WINDOW_TICKS {
            self.least = [u32::MAX, self.least[0]];
            self.window_began = now;
        }
        self.least[0] = self.least[0].min(self.behind);
        let usual = self.least[0].min(self.least[1]);
        let lags = self.behind > usual + LAG_GROWTH_TICKS || self.behind > LAG_TICKS_MAX;
        self.lagging_since = lags.then(|| self.lagging_since.unwrap_or(now));
    }

    /// Ticks from the newest snapshot that was sent to the newest that was heard.
    pub fn ticks(&self) -> u32 {
        self.behind
    }

    /// Whether it lags for long enough to be sent less.
    pub fn lags(&self, now: u32) -> bool {
        self.lagging_since.is_some_and(|since| now - since >= LAGGING_TICKS)
    }

    /// It is sent less from now on: has it time to catch up.
    pub fn relieved(&mut self, now: u32) {
        self.lagging_since = self.lagging_since.map(|_| now);
    }

    /// Whether it is sent snapshots and has heard none for so long.
    pub fn is_silent(&self, now: u32, ticks_max: u32) -> bool {
        self.sent > self.heard && now - self.moved >= ticks_max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A client that is sent every tick up to `until`, and hears it `behind` ticks later.
    fn plays(lag: &mut Lag, ticks: std::ops::Range<u32>, behind: impl Fn(u32) -> u32) {
        for tick in ticks {
            lag.sent(tick);
            lag.heard(tick.saturating_sub(behind(tick)) as u16, tick);
        }
    }

    #[test]
    fn a_long_way_and_a_stall_are_no_lag_and_growth_is() {
        let mut lag = Lag::new(0);
        plays(&mut lag, 1..600, |_| 24);
        // A stall of half a second now and then.
        plays(&mut lag, 600..1200, |tick| 24 + (30 - tick as i32 % 150).max(0) as u32);
        assert!(!lag.lags(1200) && lag.ticks() == 24);
        plays(&mut lag, 1200..1200 + LAGGING_TICKS, |_| 25 + LAG_GROWTH_TICKS);
        assert!(!lag.lags(1199 + LAGGING_TICKS));
        plays(&mut lag, 1200 + LAGGING_TICKS..1300 + LAGGING_TICKS, |_| 25 + LAG_GROWTH_TICKS);
        assert!(lag.lags(1300 + LAGGING_TICKS));
        lag.relieved(1300 + LAGGING_TICKS);
        assert!(!lag.lags(1301 + LAGGING_TICKS), "it has time to catch up");
        plays(&mut lag, 1400 + LAGGING_TICKS..1402 + LAGGING_TICKS, |_| 26);
        assert!(!lag.lags(u32::MAX));
    }

    #[test]
    fn a_way_that_became_longer_is_accepted_in_the_end_unless_nobody_has_one_so_long() {
        let mut lag = Lag::new(0);
        plays(&mut lag, 1..100, |_| 5);
        plays(&mut lag, 100..100 + 2 * LAG_WINDOW_TICKS, |_| 6 + LAG_GROWTH_TICKS);
        assert!(!lag.lags(100 + 2 * LAG_WINDOW_TICKS));
        plays(&mut lag, 10_000..20_000, |_| LAG_TICKS_MAX + 1);
        assert!(lag.lags(20_000));
    }

    #[test]
    fn who_hears_nothing_of_what_is_sent_is_silent_and_who_is_sent_nothing_is_not() {
        let mut lag = Lag::new(70_000);
        assert!(!lag.is_silent(90_000, 1200), "nothing moved, nothing was sent");
        lag.sent(90_000);
        assert!(!lag.is_silent(91_199, 1200) && lag.is_silent(91_200, 1200));
        // Words that say nothing new do not help; the low bits are of some ticks ago.
        lag.heard(70_000u32 as u16, 91_200);
        assert!(lag.is_silent(91_200, 1200));
        lag.heard(90_000u32 as u16, 91_200);
        assert!(!lag.is_silent(95_000, 1200));
        lag.sent(95_000);
        lag.heard(96_000u32 as u16, 95_001);
        assert_eq!((lag.ticks(), lag.is_silent(99_999, 1200)), (0, false), "the future");
    }

    #[test]
    fn who_begins_anew_with_an_older_keyframe_is_not_behind() {
        let mut lag = Lag::new(0);
        plays(&mut lag, 1..100, |_| 0);
        lag.sent(90);
        for low in [99, 90] {
            lag.heard(low, 120);
            assert_eq!((lag.ticks(), lag.is_silent(9000, 1200)), (0, false));
        }
        lag.sent(121);
        lag.heard(90, 125);
        assert_eq!(lag.ticks(), 31);
    }
}
