//! A token bucket: a rate limit with a burst.

use std::time::Instant;

/// A token bucket. The time is passed in.
#[derive(Debug)]
pub struct TokenBucket {
    per_second: f64,
    burst: f64,
    tokens: f64,
    filled_at: Instant,
}

impl TokenBucket {
    /// Creates a full bucket.
    pub fn new(per_second: impl Into<f64>, burst: u32, now: Instant) -> TokenBucket {
        let burst = f64::from(burst);
        TokenBucket { per_second: per_second.into(), burst, tokens: burst, filled_at: now }
    }

    /// Returns whether the bucket is full.
    pub fn is_full(&self, now: Instant) -> bool {
        self.tokens + self.gained(now) >= self.burst
    }

    /// Takes one token; `false` if none is left.
    pub fn take(&mut self, now: Instant) -> bool {
        self.take_many(1, now)
    }

    /// Takes `count` tokens. If fewer are left, takes none and returns `false`.
    pub fn take_many(&mut self, count: usize, now: Instant) -> bool {
        let count = count as f64;
        self.refill(now);
        let allowed = self.tokens >= count;
        if allowed {
            self.tokens -= count;
        }
        allowed
    }

    /// Takes `count` tokens, going into debt if fewer are left. The debt is limited to one burst.
    pub fn charge(&mut self, count: usize, now: Instant) {
        self.refill(now);
        self.tokens = (self.tokens - count as f64).max(-self.burst);
    }

    /// The fraction of the burst that is left; negative if tokens are owed.
    pub fn fill(&mut self, now: Instant) -> f64 {
        self.refill(now);
        self.tokens / self.burst
    }

    /// Changes the rate and the burst.
    pub fn set_rate(&mut self, per_second: u32, burst: u32, now: Instant) {
        self.refill(now);
        (self.per_second, self.burst) = (per_second.into(), f64::from(burst).max(1.0));
        self.tokens = self.tokens.clamp(-self.burst, self.burst);
    }

    fn refill(&mut self, now: Instant) {
        self.tokens = (self.tokens + self.gained(now)).min(self.burst);
        self.filled_at = now;
    }

    fn gained(&self, now: Instant) -> f64 {
        now.saturating_duration_since(self.filled_at).as_secs_f64() * self.per_second
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_burst_is_allowed_once_and_the_rate_for_good() {
        let mut now = Instant::now();
        let mut bucket = TokenBucket::new(120, 240, now);
        assert_eq!((0..500).filter(|_| bucket.take(now)).count(), 240);
        for _ in 0..1000 {
            now += Duration::from_micros(8_334);
            assert!(bucket.take(now), "120 a second");
        }
        let faster = (0..1000).filter(|_| {
            now += Duration::from_millis(4);
            bucket.take(now)
        });
        let allowed = faster.count();
        assert!((470..=490).contains(&allowed), "250 a second: {allowed} of 1000 in 4 s");
    }
}
