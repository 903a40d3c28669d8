//! Percentiles of durations. Memory use does not depend on how many there are.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Duration;

/// Durations in microseconds, to within 1 %.
#[derive(Clone, Debug)]
pub struct Durations(Histogram<u32>);

impl Default for Durations {
    fn default() -> Durations {
        Durations(Histogram::new(2).expect("two significant digits are allowed"))
    }
}

impl Durations {
    pub fn record(&mut self, duration: Duration) {
        let micros = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX >> 1);
        self.0.record(micros).expect("it grows with its largest value");
    }

    /// Adds all the durations from another histogram.
    pub fn merge(&mut self, other: &Durations) {
        self.0.add(&other.0).expect("it grows with its largest value");
    }

    /// The percentiles, in milliseconds.
    pub fn percentiles(&self) -> Percentiles {
        let millis = |micros: u64| micros as f64 * 1e-3;
        let [p50, p90, p99] = [0.5, 0.9, 0.99].map(|share| millis(self.0.value_at_quantile(share)));
        Percentiles { count: self.0.len(), p50, p90, p99, max: millis(self.0.max()) }
    }
}

/// Percentiles of durations, in milliseconds; all zero if nothing was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    pub count: u64,
    /// The median.
    pub p50: f64,
    pub p90: f64,
    /// The 99th percentile.
    pub p99: f64,
    pub max: f64,
}

impl fmt::Display for Percentiles {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Percentiles { count, p50, p90, p99, max } = self;
        write!(f, "p50 {p50:.2}, p90 {p90:.2}, p99 {p99:.2}, max {max:.2} ms of {count}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_durations() {
        let mut durations = Durations::default();
        assert_eq!(durations.percentiles(), Percentiles::default());
        (1..=1000).for_each(|millis| durations.record(Duration::from_millis(millis)));
        let found = durations.percentiles();
        let pairs = [(found.p50, 500.0), (found.p90, 900.0), (found.p99, 990.0), (found.max, 1e3)];
        for (found, right) in pairs {
            assert!((right..right * 1.01).contains(&found), "{found} for {right}");
        }
        durations.merge(&durations.clone());
        assert_eq!(durations.percentiles(), Percentiles { count: 2000, ..found });
        durations.record(Duration::MAX);
    }
}
