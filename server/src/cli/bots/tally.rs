//! Percentiles of millions of durations in little memory: a count for each range of 3 %.

use serde::Serialize;
use std::time::Duration;

/// Ranges for each doubling: 32 of them.
const FINE_BITS: u32 = 5;
/// Ranges in all: up to an hour in microseconds.
const RANGES: usize = 28 << FINE_BITS;

/// How many durations fell into which range.
#[derive(Clone, Debug)]
pub struct Tally {
    counts: Vec<u32>,
    count: u64,
    max_us: u64,
}

/// Of a tally, milliseconds; zeros of an empty one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// How many durations.
    pub count: u64,
    /// Half of them are at most this.
    pub p50: f64,
    /// Nine in ten.
    pub p90: f64,
    /// 99 of a hundred.
    pub p99: f64,
    /// All of them.
    pub max: f64,
}

impl Default for Tally {
    fn default() -> Tally {
        Tally { counts: vec![0; RANGES], count: 0, max_us: 0 }
    }
}

impl Tally {
    /// One more.
    pub fn add(&mut self, duration: Duration) {
        let micros = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX);
        self.counts[range_of(micros)] += 1;
        self.count += 1;
        self.max_us = self.max_us.max(micros);
    }

    /// All of another.
    pub fn merge(&mut self, other: &Tally) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(own, other)| *own += other);
        self.count += other.count;
        self.max_us = self.max_us.max(other.max_us);
    }

    /// The percentiles.
    pub fn spread(&self) -> Spread {
        let [p50, p90, p99] = [0.5, 0.9, 0.99].map(|share| self.at(share));
        Spread { count: self.count, p50, p90, p99, max: self.max_us as f64 * 1e-3 }
    }

    /// What this share of all is at most, milliseconds.
    fn at(&self, share: f64) -> f64 {
        let rank = (self.count as f64 * share).ceil() as u64;
        let mut seen = 0;
        let found = self.counts.iter().position(|&count| {
            seen += u64::from(count);
            seen >= rank
        });
        found.map_or(0, |range| end_of(range).min(self.max_us)) as f64 * 1e-3
    }
}

/// Small numbers have a range each; of larger ones the highest bits count.
fn range_of(micros: u64) -> usize {
    let doublings = (u64::BITS - (micros >> FINE_BITS).leading_zeros()).saturating_sub(1);
    let range = ((u64::from(doublings) << FINE_BITS) + (micros >> doublings)) as usize;
    range.min(RANGES - 1)
}

/// The largest number of a range.
fn end_of(range: usize) -> u64 {
    let (range, fine) = (range as u64, 1 << FINE_BITS);
    let doublings = (range >> FINE_BITS).saturating_sub(1);
    let high = range - (doublings << FINE_BITS);
    debug_assert!(high < 2 * fine, "the high bits of a number");
    ((high + 1) << doublings) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_in_its_range() {
        for micros in (0..5000).chain([100_000, 1 << 24, 3_000_000_000]) {
            let range = range_of(micros);
            assert!(micros <= end_of(range), "{micros}");
            assert!(range == 0 || micros > end_of(range - 1), "{micros}");
            assert!(end_of(range) <= micros + micros / 32, "{micros}");
        }
    }

    #[test]
    fn percentiles_are_those_of_the_numbers() {
        let mut tally = Tally::default();
        assert_eq!(tally.spread(), Spread::default());
        (1..=1000).for_each(|millis| tally.add(Duration::from_millis(millis)));
        let spread = tally.spread();
        for (found, right) in [(spread.p50, 500.0), (spread.p90, 900.0), (spread.p99, 990.0)] {
            assert!((right..right * 1.04).contains(&found), "{found} for {right}");
        }
        assert_eq!((spread.count, spread.max), (1000, 1000.0));
        let mut both = tally.clone();
        both.merge(&tally);
        assert_eq!(Spread { count: 1000, ..both.spread() }, spread);
    }
}
