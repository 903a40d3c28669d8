//! Bots' measurements, individually and combined, including as text.

use super::histogram::{Durations, Percentiles};
use super::target::BotTarget;
use jostle_sim::{BodyId, TICKS_PER_SECOND};
use serde::Serialize;
use std::fmt;
use std::time::{Duration, Instant};

/// Maximum number of clients that are shown individually.
const SHOWN_MAX: usize = 16;

/// Kinds of messages, as named in the report.
const KINDS: [&str; 4] = ["deltas", "keyframes", "pongs", "others"];

/// A kind of message, in the order of [`KINDS`].
#[derive(Clone, Copy, Debug)]
enum MessageKind {
    /// A snapshot that contains the changes since the previous one.
    Delta,
    /// A snapshot that needs no baseline.
    Keyframe,
    /// The answer to a ping.
    Pong,
    /// Any other message except the welcome.
    Other,
}

/// One bot's measurements from the time when all bots were playing.
#[derive(Debug)]
pub struct ClientReport {
    index: u32,
    /// The bot's seat, once it has been welcomed.
    pub seat: Option<u16>,
    /// The error that ended the bot early.
    pub error: Option<String>,
    /// Ping stamps are counted from here.
    made_at: Instant,
    began_at: Option<Instant>,
    ended_at: Option<Instant>,
    counts: MessageCounts,
}

#[derive(Debug, Default)]
struct MessageCounts {
    /// Number of bytes received, by [`MessageKind`].
    bytes: [u64; KINDS.len()],
    snapshots: u64,
    gaps: u64,
    gap_ticks_max: u32,
    first: Option<(u32, Instant)>,
    last: Option<(u32, Instant)>,
    pings: Durations,
    jitter: Durations,
    ping_before: Option<Duration>,
    intervals: Durations,
    returns: ReturnCounts,
}

/// Returns after a lost socket, or to a room that moved.
#[derive(Debug, Default)]
struct ReturnCounts {
    times: Durations,
    outages: Durations,
    moves: u32,
    seats_lost: u32,
    heroes_lost: u32,
}

impl ClientReport {
    /// Creates a report with no measurements.
    pub fn new(index: u32) -> ClientReport {
        let (made_at, counts) = (Instant::now(), MessageCounts::default());
        let (seat, error, began_at, ended_at) = (None, None, None, None);
        ClientReport { index, seat, error, made_at, began_at, ended_at, counts }
    }

    pub fn begin(&mut self, now: Instant) {
        self.began_at = Some(now);
    }

    /// The start of the measurement, or the current time if it has not started.
    pub fn began(&self) -> Instant {
        self.began_at.unwrap_or_else(Instant::now)
    }

    pub fn end(&mut self, now: Instant) {
        self.ended_at = Some(now);
    }

    /// Counts a snapshot for `tick`, which arrived `ticks` ticks after the previous announced one.
    pub fn saw(&mut self, keyframe: bool, bytes: usize, tick: u32, ticks: u32, now: Instant) {
        if self.began_at.is_none() {
            return;
        }
        self.counts.snapshots += 1;
        let kind = if keyframe { MessageKind::Keyframe } else { MessageKind::Delta };
        self.counts.bytes[kind as usize] += bytes as u64;
        if let Some((_, before)) = self.counts.last {
            let skipped = ticks.saturating_sub(1);
            self.counts.gaps += u64::from(skipped > 0);
            self.counts.gap_ticks_max = self.counts.gap_ticks_max.max(skipped);
            self.counts.intervals.record(now - before);
        }
        self.counts.first.get_or_insert((tick, now));
        self.counts.last = Some((tick, now));
    }

    /// Counts a message of any other kind.
    pub fn count_other(&mut self, bytes: usize) {
        if self.began_at.is_some() {
            self.counts.bytes[MessageKind::Other as usize] += bytes as u64;
        }
    }

    /// A ping's stamp: microseconds, which wrap around after about an hour.
    pub fn stamp(&self, now: Instant) -> u32 {
        (now - self.made_at).as_micros() as u32
    }

    /// Counts the answer to a ping.
    pub fn ponged(&mut self, stamp: u32, bytes: usize, now: Instant) {
        if self.began_at.is_none() {
            return;
        }
        self.counts.bytes[MessageKind::Pong as usize] += bytes as u64;
        let ping = Duration::from_micros(self.stamp(now).wrapping_sub(stamp).into());
        self.counts.pings.record(ping);
        if let Some(before) = self.counts.ping_before.replace(ping) {
            self.counts.jitter.record(ping.abs_diff(before));
        }
    }

    /// Counts the room's move to another server.
    pub fn moved(&mut self) {
        self.counts.returns.moves += u32::from(self.began_at.is_some());
    }

    /// Counts a return at `now`, this long after a move or a lost socket, and whether the seat and hero are the same as
    /// before.
    pub fn returned(
        &mut self,
        took: Duration,
        same_seat: bool,
        [before, hero]: [Option<BodyId>; 2],
        now: Instant,
    ) {
        let returns = &mut self.counts.returns;
        returns.times.record(took);
        returns.seats_lost += u32::from(!same_seat);
        returns.heroes_lost += u32::from(hero != before);
        // Time without a socket does not count as an interval between snapshots.
        if let Some((_, last)) = self.counts.last.take() {
            returns.outages.record(now - last);
        }
    }

    fn seconds(&self) -> f64 {
        match (self.began_at, self.ended_at.or(self.counts.last.map(|(_, at)| at))) {
            (Some(start), Some(end)) if end > start => (end - start).as_secs_f64(),
            _ => 0.0,
        }
    }

    /// Ticks of wall time that the server did not play, as seen by this client. Network jitter distorts the count.
    fn missed_ticks(&self) -> Option<f64> {
        let ((first, from), (last, to)) = (self.counts.first?, self.counts.last?);
        let due = (to - from).as_secs_f64() * f64::from(TICKS_PER_SECOND);
        Some(due - f64::from(last - first))
    }
}

/// All bots' measurements combined.
#[derive(Debug, Serialize)]
pub struct Report {
    pub(super) rooms: Vec<String>,
    pub clients: usize,
    /// Number of bots that decoded every snapshot.
    pub(super) decoders: u32,
    pub(super) failed: usize,
    /// Length of the measurement, in seconds.
    pub seconds: f64,
    #[serde(flatten)]
    pub(super) rates: Rates,
    pub ping_ms: Percentiles,
    /// Difference between consecutive pings of the same client.
    pub(super) jitter_ms: Percentiles,
    /// Time between consecutive snapshots on the same socket.
    pub interval_ms: Percentiles,
    /// Number of snapshots that arrived more than one tick after the previous announced one.
    pub gaps: u64,
    pub gap_ticks_max: u32,
    #[serde(flatten)]
    pub(super) server: ServerTicks,
    #[serde(flatten)]
    pub(super) returns: Returns,
    pub(super) per_client: Vec<ClientEntry>,
}

/// How much the clients received per second.
#[derive(Debug, Serialize)]
pub(super) struct Rates {
    pub bytes_per_second_mean: f64,
    bytes_per_second_max: f64,
    /// The mean for each message kind.
    pub bytes_per_second: [(&'static str, f64); 4],
    pub snapshots_per_second_mean: f64,
    snapshots_per_second_min: f64,
}

/// The server's ticks, as seen by clients.
#[derive(Debug, Serialize)]
pub(super) struct ServerTicks {
    /// Number of ticks that the server advanced, as seen by the client that played longest.
    pub server_ticks: u32,
    /// Number of ticks that the server should have advanced but did not. The lowest count among all clients is used,
    /// because network delays look the same.
    pub server_missed_ticks: u32,
}

/// Returns after a lost socket, or to a room that moved to another server.
#[derive(Debug, Serialize)]
pub(super) struct Returns {
    /// Time from the loss of a socket to the keyframe on the next one.
    pub return_ms: Percentiles,
    /// Number of moves to another server that the bots followed.
    pub moves: u32,
    /// Time from the last snapshot before a move or a lost socket to the first one after it.
    pub outage_ms: Percentiles,
    /// Number of returns to a different seat, or with a token that was refused.
    pub seats_lost: u32,
    /// Number of returns to a different hero.
    pub heroes_lost: u32,
}

/// A bot in the report.
#[derive(Debug, Serialize)]
pub(super) struct ClientEntry {
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

impl ClientEntry {
    fn of(client: &ClientReport) -> ClientEntry {
        let seconds = client.seconds();
        let rate = |count: u64| if seconds > 0.0 { count as f64 / seconds } else { 0.0 };
        let bytes = client.counts.bytes.iter().sum();
        ClientEntry {
            client: client.index,
            seat: client.seat,
            seconds,
            bytes,
            bytes_per_second: rate(bytes),
            snapshots: client.counts.snapshots,
            snapshots_per_second: rate(client.counts.snapshots),
            gaps: client.counts.gaps,
            gap_ticks_max: client.counts.gap_ticks_max,
            ping_ms: client.counts.pings.percentiles(),
            error: client.error.clone(),
        }
    }
}

impl Rates {
    fn of(entries: &[ClientEntry], clients: &[ClientReport], seconds: f64) -> Rates {
        let count = clients.len() as f64;
        let bytes = entries.iter().map(|entry| entry.bytes_per_second);
        let snapshots = entries.iter().map(|entry| entry.snapshots_per_second);
        Rates {
            bytes_per_second_mean: bytes.clone().sum::<f64>() / count,
            bytes_per_second_max: bytes.fold(0.0, f64::max),
            bytes_per_second: [0, 1, 2, 3].map(|kind| {
                let bytes: u64 = clients.iter().map(|client| client.counts.bytes[kind]).sum();
                (KINDS[kind], bytes as f64 / (count * seconds.max(1e-9)))
            }),
            snapshots_per_second_mean: snapshots.clone().sum::<f64>() / count,
            snapshots_per_second_min: snapshots.fold(f64::INFINITY, f64::min),
        }
    }
}

impl Report {
    /// Mean number of bytes received per snapshot, with the few other messages included.
    pub fn message_bytes(&self) -> usize {
        let Rates { bytes_per_second_mean, snapshots_per_second_mean, .. } = self.rates;
        (bytes_per_second_mean / snapshots_per_second_mean.max(1.0)) as usize
    }

    /// Combines all clients' measurements.
    pub fn new(targets: &[BotTarget], decoders: u32, clients: Vec<ClientReport>) -> Report {
        let per_client: Vec<_> = clients.iter().map(ClientEntry::of).collect();
        let all = |tally: fn(&ClientReport) -> &Durations| {
            let mut sum = Durations::default();
            clients.iter().for_each(|client| sum.merge(tally(client)));
            sum.percentiles()
        };
        let sum = |count: fn(&ReturnCounts) -> u32| {
            clients.iter().map(|client| count(&client.counts.returns)).sum()
        };
        let advanced = |client: &ClientReport| {
            Some(client.counts.last?.0.saturating_sub(client.counts.first?.0))
        };
        let missed = clients.iter().filter_map(ClientReport::missed_ticks);
        let seconds = clients.iter().map(ClientReport::seconds).fold(0.0, f64::max);
        Report {
            rooms: targets.iter().map(|target| target.room.clone()).collect(),
            clients: clients.len(),
            decoders,
            failed: clients.iter().filter(|client| client.error.is_some()).count(),
            seconds,
            rates: Rates::of(&per_client, &clients, seconds),
            ping_ms: all(|client| &client.counts.pings),
            jitter_ms: all(|client| &client.counts.jitter),
            interval_ms: all(|client| &client.counts.intervals),
            gaps: clients.iter().map(|client| client.counts.gaps).sum(),
            gap_ticks_max: clients
                .iter()
                .map(|client| client.counts.gap_ticks_max)
                .max()
                .unwrap_or(0),
            server: ServerTicks {
                server_ticks: clients.iter().filter_map(advanced).max().unwrap_or(0),
                server_missed_ticks: missed
                    .reduce(f64::min)
                    .map_or(0, |least| least.round() as u32),
            },
            returns: Returns {
                return_ms: all(|client| &client.counts.returns.times),
                moves: sum(|returns| returns.moves),
                outage_ms: all(|client| &client.counts.returns.outages),
                seats_lost: sum(|returns| returns.seats_lost),
                heroes_lost: sum(|returns| returns.heroes_lost),
            },
            per_client,
        }
    }

    /// Number of snapshots that all clients received.
    pub fn snapshots(&self) -> f64 {
        self.per_client.iter().map(|entry| entry.snapshots as f64).sum()
    }

    /// The first failure of any client.
    pub fn failure(&self) -> Option<String> {
        let error = self.per_client.iter().find_map(|entry| entry.error.as_deref());
        if let Some(error) = error {
            return Some(format!("{} of {} clients failed: {error}", self.failed, self.clients));
        }
        let lost = self.returns.seats_lost;
        (lost > 0).then(|| format!("{lost} returns to another seat"))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.clients <= SHOWN_MAX {
            self.per_client.iter().try_for_each(|entry| show_client(f, entry))?;
        }
        writeln!(f, "ping {}", self.ping_ms)?;
        writeln!(f, "jitter {}", self.jitter_ms)?;
        writeln!(
            f,
            "snapshots {:.1}/s, one after another {}; {} gaps, at most {} ticks",
            self.rates.snapshots_per_second_mean, self.interval_ms, self.gaps, self.gap_ticks_max
        )?;
        write!(f, "bytes/s each:")?;
        for (kind, bytes) in &self.rates.bytes_per_second {
            write!(f, " {kind} {bytes:.0}")?;
        }
        writeln!(f)?;
        if self.returns.return_ms.count > 0 {
            let (seats, heroes) = (self.returns.seats_lost, self.returns.heroes_lost);
            writeln!(
                f,
                "returns {}; {seats} to another seat, {heroes} to another hero",
                self.returns.return_ms
            )?;
            let (moves, outages) = (self.returns.moves, self.returns.outage_ms);
            writeln!(f, "moves followed {moves}; without snapshots {outages}")?;
        }
        write!(
            f,
            "{} clients in {} for {:.0} s, {} of them decode everything: {:.0} bytes/s each; {} ticks, \
             {} missed; {} failed",
            self.clients,
            self.rooms.join(", "),
            self.seconds,
            self.decoders,
            self.rates.bytes_per_second_mean,
            self.server.server_ticks,
            self.server.server_missed_ticks,
            self.failed
        )
    }
}

fn show_client(f: &mut fmt::Formatter, entry: &ClientEntry) -> fmt::Result {
    write!(
        f,
        "bot {:>3}: {:>8.0} bytes/s, {:>5.1} snapshots/s, {:>3} gaps (at most {} ticks), ping {}",
        entry.client + 1,
        entry.bytes_per_second,
        entry.snapshots_per_second,
        entry.gaps,
        entry.gap_ticks_max,
        entry.ping_ms,
    )?;
    match &entry.error {
        Some(error) => writeln!(f, ", {error}"),
        None => writeln!(f),
    }
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
        // In this second the server played 50 ticks, and one snapshot covered three of them.
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
        assert_eq!((report.server.server_ticks, report.server.server_missed_ticks), (50, 10));
        assert_eq!(report.rates.bytes_per_second[0], ("deltas", 490.0));
        assert!((60.0..60.6).contains(&report.interval_ms.max));
    }

    #[test]
    fn a_move_is_counted_with_the_time_without_snapshots() {
        let start = Instant::now();
        let mut client = ClientReport::new(0);
        client.moved();
        client.begin(start);
        client.saw(false, 10, 100, 1, start);
        client.moved();
        let back = start + Duration::from_millis(120);
        client.returned(Duration::from_millis(100), true, [None, None], back);
        client.saw(false, 10, 104, 1, back);
        let report = report(client);
        assert_eq!(report.returns.moves, 1, "before the measurement none count");
        assert!((120.0..121.5).contains(&report.returns.outage_ms.max));
        assert_eq!((report.returns.outage_ms.count, report.interval_ms.count), (1, 0));
        assert_eq!(report.failure(), None);
        let text = report.to_string();
        assert!(text.contains("moves followed 1; without snapshots p50 120"), "{text}");
        let value = serde_json::to_value(&report).expect("a report is JSON");
        assert_eq!((&value["moves"], &value["seats_lost"]), (&1.into(), &0.into()));
        assert_eq!(value["outage_ms"]["count"], 1);
    }

    #[test]
    fn a_return_to_another_seat_is_a_failure_and_another_hero_is_counted() {
        let mut client = ClientReport::new(0);
        client.begin(Instant::now());
        let now = Instant::now();
        client.returned(Duration::from_millis(30), true, [None, None], now);
        let hero = Some(BodyId { index: 1, generation: 0 });
        client.returned(Duration::from_millis(30), false, [None, hero], now);
        let report = report(client);
        assert_eq!((report.returns.return_ms.count, report.returns.seats_lost), (2, 1));
        assert_eq!(report.returns.heroes_lost, 1);
        assert!(report.failure().is_some_and(|text| text.contains("another seat")));
    }
}
