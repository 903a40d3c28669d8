//! The server's metrics, read from its operators' port before and after a part.

use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Time limit for a response.
const ANSWER_WAIT: Duration = Duration::from_secs(20);
/// Maximum length of a response in bytes.
const ANSWER_BYTES_MAX: u64 = 1 << 20;

/// Address of the operators' port, as `host:port`.
#[derive(Clone, Debug)]
pub struct Operators(pub String);

/// The values of all series at one moment.
#[derive(Clone, Debug, Default)]
pub struct Scrape(BTreeMap<String, f64>);

/// The server's work between two scrapes.
#[derive(Clone, Debug, Serialize)]
pub struct ServerReport {
    /// Number of ticks played in all rooms.
    pub ticks: u64,
    /// Number of ticks that were due but never played.
    pub ticks_missed: u64,
    /// Delay from when ticks were due until they began, in milliseconds: p50, p90, p99 and maximum, each rounded up to
    /// its bucket's upper bound.
    pub late_ms: Option<[f64; 4]>,
    /// Lateness of ticks excluding waits for a processor, in the same form.
    pub late_own_ms: Option<[f64; 4]>,
    /// Mean time per wakeup spent reading inputs, playing and sending, in milliseconds.
    pub phases_ms: [f64; 3],
    /// Number of times that a socket fell too far behind to receive deltas.
    pub sockets_late: u64,
    /// Processor time in seconds.
    pub cpu_seconds: Option<f64>,
    /// Physical memory before and after, in bytes.
    pub resident_bytes: Option<[u64; 2]>,
    /// Number of open descriptors before and after.
    pub descriptors: Option<[u64; 2]>,
}

impl Operators {
    /// Reads the metrics once.
    pub fn scrape(&self) -> Result<Scrape> {
        self.answer()
            .map(|answer| Scrape::parse(&answer))
            .with_context(|| format!("operators' port {}", self.0))
    }

    fn answer(&self) -> std::io::Result<String> {
        let mut stream = TcpStream::connect(&self.0)?;
        stream.set_read_timeout(Some(ANSWER_WAIT))?;
        let request =
            format!("GET /metrics HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.0);
        stream.write_all(request.as_bytes())?;
        let mut answer = String::new();
        stream.take(ANSWER_BYTES_MAX).read_to_string(&mut answer)?;
        Ok(answer)
    }
}

impl Scrape {
    /// Parses lines that consist of a name with labels and a number, and ignores all others.
    fn parse(text: &str) -> Scrape {
        let series = text.lines().filter(|line| !line.starts_with('#')).filter_map(|line| {
            let (name, value) = line.rsplit_once(' ')?;
            Some((name.to_owned(), value.parse().ok()?))
        });
        Scrape(series.collect())
    }

    /// The server's physical memory in bytes.
    pub fn resident_bytes(&self) -> Option<f64> {
        self.value("process_resident_memory_bytes")
    }

    fn value(&self, name: &str) -> Option<f64> {
        self.0.get(name).copied()
    }

    /// The upper bounds of a histogram's buckets in seconds, with cumulative counts.
    fn buckets(&self, name: &str) -> Vec<(f64, f64)> {
        let start = format!("{name}_bucket{{le=\"");
        let of_it = self.0.range(start.clone()..).take_while(|(key, _)| key.starts_with(&start));
        let mut buckets: Vec<_> = of_it
            .filter_map(|(key, &count)| {
                let end = key[start.len()..].strip_suffix("\"}")?;
                Some((if end == "+Inf" { f64::INFINITY } else { end.parse().ok()? }, count))
            })
            .collect();
        buckets.sort_by(|a, b| a.0.total_cmp(&b.0));
        buckets
    }
}

impl ServerReport {
    /// Returns the differences between two scrapes.
    pub fn between(before: &Scrape, after: &Scrape) -> ServerReport {
        let grown =
            |name: &str| after.value(name).unwrap_or(0.0) - before.value(name).unwrap_or(0.0);
        let mean_ms = |phase: &str| {
            let count = grown(&format!("jostle_tick_{phase}_seconds_count"));
            1e3 * grown(&format!("jostle_tick_{phase}_seconds_sum")) / count.max(1.0)
        };
        let both = |name: &str| Some([before.value(name)? as u64, after.value(name)? as u64]);
        ServerReport {
            ticks: grown("jostle_ticks_total") as u64,
            ticks_missed: grown("jostle_ticks_missed_total") as u64,
            late_ms: percentiles(before, after, "jostle_tick_lateness_seconds"),
            late_own_ms: percentiles(before, after, "jostle_tick_lateness_own_seconds"),
            phases_ms: ["inputs", "play", "send"].map(mean_ms),
            sockets_late: grown("jostle_sockets_late_total") as u64,
            cpu_seconds: after
                .value("process_cpu_seconds_total")
                .map(|_| grown("process_cpu_seconds_total")),
            resident_bytes: both("process_resident_memory_bytes"),
            descriptors: both("process_open_fds"),
        }
    }
}

/// p50, p90, p99 and maximum, milliseconds, each as the upper bound of its bucket.
fn percentiles(before: &Scrape, after: &Scrape, name: &str) -> Option<[f64; 4]> {
    let (old, mut buckets) = (before.buckets(name), after.buckets(name));
    for (bucket, old) in buckets.iter_mut().zip(old) {
        bucket.1 -= old.1;
    }
    let count = buckets.last()?.1;
    let at = |share: f64| {
        let found = buckets.iter().find(|bucket| bucket.1 >= count * share);
        found.map_or(f64::INFINITY, |bucket| bucket.0 * 1e3)
    };
    (count > 0.0).then(|| [0.5, 0.9, 0.99, 1.0].map(at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_differences_between_two_scrapes_are_reported() {
        let text = |few: u32, all: u32, ticks: u32| {
            format!(
                "HTTP/1.1 200 OK\r\n\r\n# HELP x\njostle_ticks_total {ticks}\n\
                 jostle_tick_lateness_seconds_bucket{{le=\"0.0001\"}} {few}\n\
                 jostle_tick_lateness_seconds_bucket{{le=\"0.5\"}} {all}\n\
                 jostle_tick_lateness_seconds_bucket{{le=\"+Inf\"}} {all}\n\
                 jostle_tick_play_seconds_sum {}\njostle_tick_play_seconds_count {all}\n\
                 process_open_fds 9.0\n# EOF\n",
                f64::from(all) * 0.002
            )
        };
        let [before, after] =
            [text(10, 10, 5), text(108, 110, 105)].map(|text| Scrape::parse(&text));
        let report = ServerReport::between(&before, &after);
        assert_eq!((report.ticks, report.ticks_missed), (100, 0));
        assert_eq!(report.late_ms, Some([0.1, 0.1, 500.0, 500.0]));
        assert_eq!((report.late_own_ms, report.cpu_seconds), (None, None));
        assert!((report.phases_ms[1] - 2.0).abs() < 1e-9);
        assert_eq!(report.descriptors, Some([9, 9]));
    }
}
