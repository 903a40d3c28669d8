//! What bots measured, one by one and together.

use super::Target;
use jostle_sim::TICKS_PER_SECOND;
use serde::Serialize;
use std::fmt;
use std::time::Instant;

/// What one bot measured.
#[derive(Debug)]
pub struct ClientReport {
    index: u32,
    /// Its seat, once welcomed.
    pub seat: Option<u16>,
    /// When it was welcomed.
    pub started_at: Option<Instant>,
    /// When it stopped, unless an error came first.
    pub ended_at: Option<Instant>,
    /// Bytes of messages that it got.
    pub bytes: u64,
    /// What ended it early.
    pub error: Option<String>,
    snapshots: u64,
    gaps: u64,
    gap_ticks_max: u32,
    first: Option<(u32, Instant)>,
    last: Option<(u32, Instant)>,
    pings_ms: Vec<f64>,
}

impl ClientReport {
    /// Nothing measured yet.
    pub fn new(index: u32) -> ClientReport {
        ClientReport {
            index,
            seat: None,
            started_at: None,
            ended_at: None,
            bytes: 0,
            error: None,
            snapshots: 0,
            gaps: 0,
            gap_ticks_max: 0,
            first: None,
            last: None,
            pings_ms: Vec::new(),
        }
    }

    /// A snapshot of this tick came; until `still_until` nothing had moved since the one before.
    pub fn saw(&mut self, tick: u32, still_until: Option<u32>, now: Instant) {
        self.snapshots += 1;
        if let Some((before, _)) = self.last {
            let before = still_until.unwrap_or(before);
            let skipped = tick.saturating_sub(before).saturating_sub(1);
            self.gaps += u64::from(skipped > 0);
            self.gap_ticks_max = self.gap_ticks_max.max(skipped);
        }
        self.first.get_or_insert((tick, now));
        self.last = Some((tick, now));
    }

    /// What a ping carries: microseconds since `started_at`, which wrap after an hour.
    pub fn stamp(&self, now: Instant) -> u32 {
        self.started_at.map_or(0, |started| (now - started).as_micros() as u32)
    }

    /// The answer to a ping came.
    pub fn ponged(&mut self, stamp: u32, now: Instant) {
        let elapsed_us = self.stamp(now).wrapping_sub(stamp);
        self.pings_ms.push(f64::from(elapsed_us) / 1e3);
    }

    fn seconds(&self) -> f64 {
        match (self.started_at, self.ended_at.or(self.last.map(|(_, at)| at))) {
            (Some(start), Some(end)) if end > start => (end - start).as_secs_f64(),
            _ => 0.0,
        }
    }

    /// Ticks that the wall clock had and the server did not, seen from here; jitter of the network
    /// adds or takes some.
    fn missed_ticks(&self) -> Option<f64> {
        let ((first, from), (last, to)) = (self.first?, self.last?);
        let due = (to - from).as_secs_f64() * f64::from(TICKS_PER_SECOND);
        Some(due - f64::from(last - first))
    }
}

/// Everything, as it is printed.
#[derive(Debug, Serialize)]
pub struct Report {
    room: String,
    clients: usize,
    failed: usize,
    bytes_per_second_mean: f64,
    bytes_per_second_max: f64,
    snapshots_per_second_mean: f64,
    snapshots_per_second_min: f64,
    ping_ms: Spread,
    /// Ticks that the server advanced, as the longest-playing client saw it.
    server_ticks: u32,
    /// Ticks that it should have advanced and did not: the least that any client saw, because
    /// delays of the network look the same.
    server_missed_ticks: u32,
    per_client: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct Entry {
    client: u32,
    seat: Option<u16>,
    seconds: f64,
    bytes: u64,
    bytes_per_second: f64,
    snapshots: u64,
    snapshots_per_second: f64,
    /// Times that a snapshot came more than one tick after the one before.
    gaps: u64,
    /// Most ticks between two snapshots that were left out.
    gap_ticks_max: u32,
    ping_ms: Spread,
    error: Option<String>,
}

/// Of a set of measurements; zeros of none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
struct Spread {
    p50: f64,
    p99: f64,
    max: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        let Some(last) = values.len().checked_sub(1) else {
            return Spread::default();
        };
        let rank = |share: f64| values[(last as f64 * share).round() as usize];
        Spread { p50: rank(0.5), p99: rank(0.99), max: values[last] }
    }
}

impl Entry {
    fn of(client: &ClientReport) -> Entry {
        let seconds = client.seconds();
        let rate = |count: u64| if seconds > 0.0 { count as f64 / seconds } else { 0.0 };
        Entry {
            client: client.index,
            seat: client.seat,
            seconds,
            bytes: client.bytes,
            bytes_per_second: rate(client.bytes),
            snapshots: client.snapshots,
            snapshots_per_second: rate(client.snapshots),
            gaps: client.gaps,
            gap_ticks_max: client.gap_ticks_max,
            ping_ms: Spread::of(client.pings_ms.clone()),
            error: client.error.clone(),
        }
    }
}

impl Report {
    /// Puts together what `clients` measured.
    pub fn new(target: &Target, clients: Vec<ClientReport>) -> Report {
        let per_client: Vec<_> = clients.iter().map(Entry::of).collect();
        let pings = clients.iter().flat_map(|client| client.pings_ms.iter().copied()).collect();
        let bytes = per_client.iter().map(|entry| entry.bytes_per_second);
        let snapshots = per_client.iter().map(|entry| entry.snapshots_per_second);
        let count = clients.len() as f64;
        let advanced = |client: &ClientReport| Some(client.last?.0 - client.first?.0);
        let missed = clients.iter().filter_map(ClientReport::missed_ticks);
        Report {
            room: target.room.clone(),
            clients: clients.len(),
            failed: clients.iter().filter(|client| client.error.is_some()).count(),
            bytes_per_second_mean: bytes.clone().sum::<f64>() / count,
            bytes_per_second_max: bytes.fold(0.0, f64::max),
            snapshots_per_second_mean: snapshots.clone().sum::<f64>() / count,
            snapshots_per_second_min: snapshots.fold(f64::INFINITY, f64::min),
            ping_ms: Spread::of(pings),
            server_ticks: clients.iter().filter_map(advanced).max().unwrap_or(0),
            server_missed_ticks: missed.reduce(f64::min).map_or(0, |least| least.round() as u32),
            per_client,
        }
    }

    /// How many clients met an error, and the first one's.
    pub fn failure(&self) -> Option<String> {
        let error = self.per_client.iter().find_map(|entry| entry.error.as_deref())?;
        Some(format!("{} of {} clients failed: {error}", self.failed, self.clients))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for entry in &self.per_client {
            write!(
                f,
                "bot {:>3}: {:>8.0} bytes/s, {:>5.1} snapshots/s, {:>3} gaps (at most {} ticks), \
                 ping {:.1} / {:.1} / {:.1} ms",
                entry.client + 1,
                entry.bytes_per_second,
                entry.snapshots_per_second,
                entry.gaps,
                entry.gap_ticks_max,
                entry.ping_ms.p50,
                entry.ping_ms.p99,
                entry.ping_ms.max
            )?;
            match &entry.error {
                Some(error) => writeln!(f, ", {error}")?,
                None => writeln!(f)?,
            }
        }
        write!(
            f,
            "{} clients in {}: {:.0} bytes/s each, {:.1} snapshots/s, ping p50 {:.1}, p99 {:.1}, \
             max {:.1} ms; {} ticks, {} missed; {} failed",
            self.clients,
            self.room,
            self.bytes_per_second_mean,
            self.snapshots_per_second_mean,
            self.ping_ms.p50,
            self.ping_ms.p99,
            self.ping_ms.max,
            self.server_ticks,
            self.server_missed_ticks,
            self.failed
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn gaps_and_missed_ticks_are_told_apart() {
        let start = Instant::now();
        let mut client = ClientReport::new(0);
        client.started_at = Some(start);
        // One second in which the server played 50 ticks, and one snapshot stood for three.
        for tick in (100..=150).filter(|tick| ![120, 121].contains(tick)) {
            let at = start + Duration::from_millis(20) * (tick - 100);
            client.saw(tick, None, at);
        }
        client.ended_at = Some(start + Duration::from_secs(1));
        let target = Target { authority: "h:80".into(), room: "arena".into() };
        let report = Report::new(&target, vec![client]);
        let entry = &report.per_client[0];
        assert_eq!((entry.snapshots, entry.gaps, entry.gap_ticks_max), (49, 1, 2));
        assert_eq!((report.server_ticks, report.server_missed_ticks), (50, 10));
    }

    #[test]
    fn a_spread_of_nothing_is_zero_and_of_one_is_that() {
        assert_eq!(Spread::of(Vec::new()), Spread::default());
        assert_eq!(Spread::of(vec![3.0]), Spread { p50: 3.0, p99: 3.0, max: 3.0 });
    }
}
