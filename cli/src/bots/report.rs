//! The measurements of bots, one by one and together.

use super::histogram::{Durations, Percentiles};
use super::target::Target;
use jostle_sim::{BodyId, TICKS_PER_SECOND};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Bytes of messages, by kind.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Bytes {
    /// Snapshots that say what changed.
    pub deltas: u64,
    /// Snapshots that start from nothing.
    pub keyframes: u64,
    /// Answers to pings.
    pub pongs: u64,
    /// All others but the welcome.
    pub others: u64,
}

/// The measurements of one bot while all of them played.
#[derive(Debug)]
pub struct ClientReport {
    index: u32,
    /// Its seat, once welcomed.
    pub seat: Option<u16>,
    /// The error that ended it early.
    pub error: Option<String>,
    /// Before the play stamps count from here.
    made_at: Instant,
    began_at: Option<Instant>,
    ended_at: Option<Instant>,
    bytes: Bytes,
    snapshots: u64,
    gaps: u64,
    gap_ticks_max: u32,
    first: Option<(u32, Instant)>,
    last: Option<(u32, Instant)>,
    pings: Durations,
    jitter: Durations,
    ping_before: Option<Duration>,
    intervals: Durations,
    returns: Durations,
    seats_lost: u32,
    heroes_lost: u32,
}

impl ClientReport {
    /// Nothing measured yet.
    pub fn new(index: u32) -> ClientReport {
        ClientReport {
            index,
            seat: None,
            error: None,
            made_at: Instant::now(),
            began_at: None,
            ended_at: None,
            bytes: Bytes::default(),
            snapshots: 0,
            gaps: 0,
            gap_ticks_max: 0,
            first: None,
            last: None,
            pings: Durations::default(),
            jitter: Durations::default(),
            ping_before: None,
            intervals: Durations::default(),
            returns: Durations::default(),
            seats_lost: 0,
            heroes_lost: 0,
        }
    }

    /// From now on everything counts.
    pub fn begin(&mut self, now: Instant) {
        self.began_at = Some(now);
    }

    /// When that was; now if it was not yet.
    pub fn began(&self) -> Instant {
        self.began_at.unwrap_or_else(Instant::now)
    }

    /// And from now on nothing does.
    pub fn end(&mut self, now: Instant) {
        self.ended_at = Some(now);
    }

    /// A snapshot of this tick came, this many ticks after the last that was announced.
    pub fn saw(&mut self, keyframe: bool, bytes: usize, tick: u32, ticks: u32, now: Instant) {
        if self.began_at.is_none() {
            return;
        }
        self.snapshots += 1;
        *(if keyframe { &mut self.bytes.keyframes } else { &mut self.bytes.deltas }) +=
            bytes as u64;
        if let Some((_, before)) = self.last {
            let skipped = ticks.saturating_sub(1);
            self.gaps += u64::from(skipped > 0);
            self.gap_ticks_max = self.gap_ticks_max.max(skipped);
            self.intervals.record(now - before);
        }
        self.first.get_or_insert((tick, now));
        self.last = Some((tick, now));
    }

    /// Another message came.
    pub fn heard_other(&mut self, bytes: usize) {
        if self.began_at.is_some() {
            self.bytes.others += bytes as u64;
        }
    }

    /// The stamp of a ping: microseconds, which wrap after an hour.
    pub fn stamp(&self, now: Instant) -> u32 {
        (now - self.made_at).as_micros() as u32
    }

    /// The answer to a ping came.
    pub fn ponged(&mut self, stamp: u32, bytes: usize, now: Instant) {
        if self.began_at.is_none() {
            return;
        }
        self.bytes.pongs += bytes as u64;
        let ping = Duration::from_micros(self.stamp(now).wrapping_sub(stamp).into());
        self.pings.record(ping);
        if let Some(before) = self.ping_before.replace(ping) {
            self.jitter.record(ping.abs_diff(before));
        }
    }

    /// It came back after its socket was lost: to the same seat or another, the same hero or another.
    pub fn returned(
        &mut self,
        took: Duration,
        same_seat: bool,
        before: Option<BodyId>,
        hero: Option<BodyId>,
    ) {
        self.returns.record(took);
        self.seats_lost += u32::from(!same_seat);
        self.heroes_lost += u32::from(hero != before);
        // What came in between is no gap between two snapshots of a socket.
        self.last = None;
    }

    fn seconds(&self) -> f64 {
        match (self.began_at, self.ended_at.or(self.last.map(|(_, at)| at))) {
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

    fn bytes_in_all(&self) -> u64 {
        let Bytes { deltas, keyframes, pongs, others } = self.bytes;
        deltas + keyframes + pongs + others
    }
}

/// Everything, as it is printed.
#[derive(Debug, Serialize)]
pub struct Report {
    pub(super) rooms: Vec<String>,
    /// Number of bots.
    pub clients: usize,
    /// Those that decoded every snapshot.
    pub(super) decoders: u32,
    pub(super) failed: usize,
    /// Length of the play.
    pub seconds: f64,
    pub(super) bytes_per_second_mean: f64,
    bytes_per_second_max: f64,
    /// The mean by kind of message.
    pub(super) bytes_per_second: [(&'static str, f64); 4],
    pub(super) snapshots_per_second_mean: f64,
    snapshots_per_second_min: f64,
    pub(super) ping_ms: Percentiles,
    /// Between one ping and the next of the same client.
    pub(super) jitter_ms: Percentiles,
    /// From one snapshot to the next of the same socket.
    pub(super) interval_ms: Percentiles,
    /// Snapshots that came more than one tick after the last announced one.
    pub(super) gaps: u64,
    pub(super) gap_ticks_max: u32,
    /// Ticks that the server advanced, as the longest-playing client saw it.
    pub(super) server_ticks: u32,
    /// Ticks that it should have advanced and did not: the least that any client saw, because
    /// delays of the network look the same.
    pub(super) server_missed_ticks: u32,
    #[serde(flatten)]
    pub(super) returns: Returns,
    pub(super) per_client: Vec<Entry>,
}

/// Returns after the loss of a socket.
#[derive(Debug, Serialize)]
pub(super) struct Returns {
    /// From the loss to the keyframe on the next socket.
    pub return_ms: Percentiles,
    /// Returns to another seat.
    pub seats_lost: u32,
    /// Returns to another hero.
    pub heroes_lost: u32,
}

/// One bot of the report.
#[derive(Debug, Serialize)]
pub(super) struct Entry {
    pub client: u32,
    seat: Option<u16>,
    seconds: f64,
    bytes: u64,
    pub bytes_per_second: f64,
    snapshots: u64,
    pub snapshots_per_second: f64,
    pub gaps: u64,
    pub gap_ticks_max: u32,
    pub ping_ms: Percentiles,
    pub error: Option<String>,
}

impl Entry {
    fn of(client: &ClientReport) -> Entry {
        let seconds = client.seconds();
        let rate = |count: u64| if seconds > 0.0 { count as f64 / seconds } else { 0.0 };
        Entry {
            client: client.index,
            seat: client.seat,
            seconds,
            bytes: client.bytes_in_all(),
            bytes_per_second: rate(client.bytes_in_all()),
            snapshots: client.snapshots,
            snapshots_per_second: rate(client.snapshots),
            gaps: client.gaps,
            gap_ticks_max: client.gap_ticks_max,
            ping_ms: client.pings.percentiles(),
            error: client.error.clone(),
        }
    }
}

impl Report {
    /// Puts together the measurements of all clients.
    pub fn new(targets: &[Target], decoders: u32, clients: Vec<ClientReport>) -> Report {
        let per_client: Vec<_> = clients.iter().map(Entry::of).collect();
        let all = |tally: fn(&ClientReport) -> &Durations| {
            let mut sum = Durations::default();
            clients.iter().for_each(|client| sum.merge(tally(client)));
            sum.percentiles()
        };
        let count = clients.len() as f64;
        let bytes = per_client.iter().map(|entry| entry.bytes_per_second);
        let snapshots = per_client.iter().map(|entry| entry.snapshots_per_second);
        let advanced = |client: &ClientReport| Some(client.last?.0.saturating_sub(client.first?.0));
        let missed = clients.iter().filter_map(ClientReport::missed_ticks);
        let seconds = clients.iter().map(ClientReport::seconds).fold(0.0, f64::max);
        Report {
            rooms: targets.iter().map(|target| target.room.clone()).collect(),
            clients: clients.len(),
            decoders,
            failed: clients.iter().filter(|client| client.error.is_some()).count(),
            seconds,
            bytes_per_second_mean: bytes.clone().sum::<f64>() / count,
            bytes_per_second_max: bytes.fold(0.0, f64::max),
            bytes_per_second: by_kind(&clients, count * seconds.max(1e-9)),
            snapshots_per_second_mean: snapshots.clone().sum::<f64>() / count,
            snapshots_per_second_min: snapshots.fold(f64::INFINITY, f64::min),
            ping_ms: all(|client| &client.pings),
            jitter_ms: all(|client| &client.jitter),
            interval_ms: all(|client| &client.intervals),
            gaps: clients.iter().map(|client| client.gaps).sum(),
            gap_ticks_max: clients.iter().map(|client| client.gap_ticks_max).max().unwrap_or(0),
            server_ticks: clients.iter().filter_map(advanced).max().unwrap_or(0),
            server_missed_ticks: missed.reduce(f64::min).map_or(0, |least| least.round() as u32),
            returns: Returns {
                return_ms: all(|client| &client.returns),
                seats_lost: clients.iter().map(|client| client.seats_lost).sum(),
                heroes_lost: clients.iter().map(|client| client.heroes_lost).sum(),
            },
            per_client,
        }
    }

    /// The first thing that went wrong with clients.
    pub fn failure(&self) -> Option<String> {
        let error = self.per_client.iter().find_map(|entry| entry.error.as_deref());
        if let Some(error) = error {
            return Some(format!("{} of {} clients failed: {error}", self.failed, self.clients));
        }
        let lost = self.returns.seats_lost;
        (lost > 0).then(|| format!("{lost} returns to another seat"))
    }
}

fn by_kind(clients: &[ClientReport], client_seconds: f64) -> [(&'static str, f64); 4] {
    let sum = |kind: fn(&Bytes) -> u64| {
        clients.iter().map(|client| kind(&client.bytes)).sum::<u64>() as f64 / client_seconds
    };
    [
        ("deltas", sum(|bytes| bytes.deltas)),
        ("keyframes", sum(|bytes| bytes.keyframes)),
        ("pongs", sum(|bytes| bytes.pongs)),
        ("others", sum(|bytes| bytes.others)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(client: ClientReport) -> Report {
        Report::new(&[], 1, vec![client])
    }

    #[test]
    fn gaps_and_missed_ticks_are_counted_apart() {
        let start = Instant::now();
        let mut client = ClientReport::new(0);
        client.begin(start);
        // One second in which the server played 50 ticks, and one snapshot stood for three.
        let mut before = 99;
        for tick in (100..=150).filter(|tick| ![120, 121].contains(tick)) {
            let at = start + Duration::from_millis(20) * (tick - 100);
            client.saw(false, 10, tick, tick - before, at);
            before = tick;
        }
        client.end(start + Duration::from_secs(1));
        let report = report(client);
        let entry = &report.per_client[0];
        assert_eq!((entry.snapshots, entry.gaps, entry.gap_ticks_max), (49, 1, 2));
        assert_eq!((report.server_ticks, report.server_missed_ticks), (50, 10));
        assert_eq!(report.bytes_per_second[0], ("deltas", 490.0));
        assert!((60.0..60.6).contains(&report.interval_ms.max));
    }

    #[test]
    fn a_return_to_another_seat_is_a_failure_and_another_hero_is_counted() {
        let mut client = ClientReport::new(0);
        client.begin(Instant::now());
        client.returned(Duration::from_millis(30), true, None, None);
        let hero = Some(BodyId { index: 1, generation: 0 });
        client.returned(Duration::from_millis(30), false, None, hero);
        let report = report(client);
        assert_eq!((report.returns.return_ms.count, report.returns.seats_lost), (2, 1));
        assert_eq!(report.returns.heroes_lost, 1);
        assert!(report.failure().is_some_and(|text| text.contains("another seat")));
    }
}
