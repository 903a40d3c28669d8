//! Metrics for operators: counters, gauges and histograms in base units, as text for Prometheus
//! (OpenMetrics). No label names a player, a room or an address: there are few series, and none reveals
//! who plays.

use crate::ops::process;
use jostle_protocol::Refusal;
use jostle_room::Rate;
use prometheus_client::encoding::text::{encode_eof, encode_registry};
use prometheus_client::metrics::counter::{ConstCounter, Counter};
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::{ConstGauge, Gauge};
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};
use std::time::Duration;

type Label = [(&'static str, &'static str); 1];

/// All metrics of a server. Handles are cheap to clone and to use from any thread.
pub struct Metrics {
    registry: Registry,
    /// Metrics of ticks, over all rooms.
    pub ticks: Ticks,
    /// By rate, in the order of [`Rate::ALL`].
    pub snapshots: [Snapshots; Rate::ALL.len()],
    /// Keyframes at a lower rate, for sockets that were too far behind.
    pub late: Counter,
    /// Lag of clients in ticks, each observed once a second.
    pub lag: Histogram,
    /// Inputs dropped because of their sequence numbers.
    pub inputs_ignored: Counter,
    /// Rooms that panicked.
    pub rooms_failed: Counter,
    /// In the order of [`Skip`].
    skips: [Counter; 4],
    joins: Family<Label, Counter>,
    leaves: Family<Label, Counter>,
    refusals: Family<Label, Counter>,
    rooms: Gauge,
    players: Gauge,
    bodies: Gauge,
    replay_bytes: Counter,
    replay_errors: Counter,
    log_drops: Counter,
}

/// Metrics of the rooms' threads, updated at each wakeup.
#[derive(Clone)]
pub struct Ticks {
    /// Ticks played.
    pub played: Counter,
    /// Ticks that were due and never played.
    pub missed: Counter,
    /// Seconds from when a tick was due to its beginning.
    pub lateness: Histogram,
    /// The same without the time in which the thread had no processor, where the system counts it.
    pub lateness_own: Histogram,
    /// Seconds of emptying inboxes, of playing, and of handing out snapshots.
    pub phases: [Histogram; 3],
}

/// The lateness of a wakeup.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Late {
    /// From when a tick was due to its beginning.
    pub raw: Duration,
    /// Time in which the thread waited for a processor since the tick before, if the system counts it.
    pub queued: Option<Duration>,
}

/// Snapshots sent to clients of one rate.
#[derive(Clone, Default)]
pub struct Snapshots {
    /// Messages that were queued for sockets.
    pub count: Counter,
    /// Their bytes.
    pub bytes: Counter,
}

/// The reason why a client was not sent a snapshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skip {
    /// Nothing changed in its view.
    Quiet,
    /// Its rate is 20 or 5 a second.
    Rate,
    /// Its outbox is too full.
    Queue,
    /// The newest snapshot that it acknowledged is too old.
    Lag,
}

/// Values at the moment of a scrape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gauges {
    /// Open rooms.
    pub rooms: i64,
    /// Seats taken in all of them.
    pub players: i64,
    /// Bodies in all of them.
    pub bodies: i64,
    /// Bytes of replays written so far, and files given up.
    pub replays: Option<[u64; 2]>,
    /// Log lines dropped so far.
    pub log_drops: u64,
}

/// A histogram from 50 microseconds to half a second, fine where the goals are.
fn lateness() -> Histogram {
    let fine = [5e-5, 1e-4, 1.5e-4, 2e-4, 2.5e-4, 3.5e-4, 5e-4, 7.5e-4, 1e-3, 1.5e-3, 2.5e-3];
    let long = [5e-3, 1e-2, 1.67e-2, 2.5e-2, 5e-2, 0.1, 0.25, 0.5];
    Histogram::new(fine.into_iter().chain(long))
}

/// A histogram from 15 microseconds to half a second.
fn seconds() -> Histogram {
    Histogram::new(exponential_buckets(15.6e-6, 2.0, 16))
}

impl Default for Metrics {
    /// Metrics at zero.
    fn default() -> Metrics {
        let mut registry = Registry::with_prefix("jostle");
        let version = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        registry.register("build", "The program that serves", version);
        let metrics = Metrics {
            ticks: Ticks::registered(&mut registry),
            snapshots: snapshots(&mut registry),
            late: Counter::default(),
            lag: Histogram::new(exponential_buckets(1.0, 2.0, 11)),
            skips: skips(&mut registry),
            inputs_ignored: Counter::default(),
            rooms_failed: Counter::default(),
            joins: Family::default(),
            leaves: Family::default(),
            refusals: Family::default(),
            rooms: Gauge::default(),
            players: Gauge::default(),
            bodies: Gauge::default(),
            replay_bytes: Counter::default(),
            replay_errors: Counter::default(),
            log_drops: Counter::default(),
            registry: Registry::default(),
        };
        let late = metrics.late.clone();
        registry.register("sockets_late", "Sockets that were too far behind for deltas", late);
        let about = "Ticks from the newest snapshot acknowledged to the newest sent, each client once a second";
        registry.register("client_lag_ticks", about, metrics.lag.clone());
        let ignored = metrics.inputs_ignored.clone();
        let about = "Inputs with old, repeated or far-future numbers";
        registry.register("inputs_ignored", about, ignored);
        registry.register("joins", "Players who got a seat, resumed or new", metrics.joins.clone());
        registry.register("leaves", "Players who left, by cause", metrics.leaves.clone());
        registry.register(
            "refusals",
            "Requests and sessions refused or ended, by reason",
            metrics.refusals.clone(),
        );
        registry.register("rooms", "Open rooms", metrics.rooms.clone());
        let failed = metrics.rooms_failed.clone();
        registry.register("rooms_failed", "Rooms ended by a panic", failed);
        registry.register("players", "Seats taken", metrics.players.clone());
        registry.register("bodies", "Bodies in all rooms", metrics.bodies.clone());
        let written = metrics.replay_bytes.clone();
        registry.register_with_unit("replay", "Replays written", Unit::Bytes, written);
        let failed = metrics.replay_errors.clone();
        registry.register("replay_errors", "Replay files abandoned after an error", failed);
        let dropped = metrics.log_drops.clone();
        registry.register(
            "log_dropped",
            "Log lines dropped because the log was read too slowly",
            dropped,
        );
        Metrics { registry, ..metrics }
    }
}

impl Ticks {
    fn registered(registry: &mut Registry) -> Ticks {
        let ticks = Ticks {
            played: Counter::default(),
            missed: Counter::default(),
            lateness: lateness(),
            lateness_own: lateness(),
            phases: [seconds(), seconds(), seconds()],
        };
        registry.register("ticks", "Ticks played", ticks.played.clone());
        registry.register("ticks_missed", "Ticks due and never played", ticks.missed.clone());
        let lateness = ticks.lateness.clone();
        let about = "Time from when a tick was due to its start";
        registry.register_with_unit("tick_lateness", about, Unit::Seconds, lateness);
        let own = ticks.lateness_own.clone();
        let about = "Lateness without the wait for a processor";
        registry.register_with_unit("tick_lateness_own", about, Unit::Seconds, own);
        for (phase, histogram) in ["inputs", "play", "send"].into_iter().zip(&ticks.phases) {
            let about = format!("Time of a wakeup spent on: {phase}");
            let name = format!("tick_{phase}");
            registry.register_with_unit(name, about, Unit::Seconds, histogram.clone());
        }
        ticks
    }
}

fn snapshots(registry: &mut Registry) -> [Snapshots; Rate::ALL.len()] {
    let (count, bytes) = (Family::<Label, Counter>::default(), Family::<Label, Counter>::default());
    registry.register("snapshots", "Snapshots queued for sockets, by rate", count.clone());
    let about = "Bytes of snapshots queued for sockets, by rate";
    registry.register_with_unit("snapshots", about, Unit::Bytes, bytes.clone());
    Rate::ALL.map(|rate| {
        let label = [("hz", hz(rate))];
        Snapshots {
            count: count.get_or_create(&label).clone(),
            bytes: bytes.get_or_create(&label).clone(),
        }
    })
}

/// Metrics of the process, under their usual names.
fn of_process() -> Registry {
    let mut registry = Registry::default();
    let gauge = |value: u64| ConstGauge::new(value as f64);
    if let Some(bytes) = process::resident_bytes() {
        let about = "Physical memory in use";
        registry.register_with_unit("process_resident_memory", about, Unit::Bytes, gauge(bytes));
    }
    if let Some(count) = process::open_descriptors() {
        registry.register("process_open_fds", "Open descriptors", gauge(count));
    }
    if let Some(seconds) = process::cpu_seconds() {
        let cpu = ConstCounter::new(seconds);
        registry.register_with_unit("process_cpu", "Processor time used", Unit::Seconds, cpu);
    }
    registry
}

fn skips(registry: &mut Registry) -> [Counter; 4] {
    let skips = Family::<Label, Counter>::default();
    let about = "Snapshots not sent to a client, by reason";
    registry.register("snapshots_skipped", about, skips.clone());
    ["quiet", "rate", "queue", "lag"]
        .map(|reason| skips.get_or_create(&[("reason", reason)]).clone())
}

fn hz(rate: Rate) -> &'static str {
    match rate {
        Rate::Full => "60",
        Rate::Third => "20",
        Rate::Twelfth => "5",
    }
}

/// Raises a counter to a value counted elsewhere.
fn raise(counter: &Counter, count: u64) {
    counter.inc_by(count.saturating_sub(counter.get()));
}

/// Snake-case names of refusals, as values of a label.
pub fn reason(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::Version => "version",
        Refusal::RoomFull => "room_full",
        Refusal::NoSuchRoom => "no_such_room",
        Refusal::ServerFull => "server_full",
        Refusal::BadHello => "bad_hello",
        Refusal::BadMessage => "bad_message",
        Refusal::Flood => "flood",
        Refusal::TooManySockets => "too_many_sockets",
        Refusal::Silent => "silent",
        Refusal::Replaced => "replaced",
        Refusal::Closing => "closing",
        Refusal::RoomFailed => "room_failed",
        Refusal::BadToken => "bad_token",
        Refusal::Kicked => "kicked",
        Refusal::RoomClosed => "room_closed",
    }
}

impl Metrics {
    /// Counts a snapshot queued for a socket.
    pub fn sent(&self, rate: Rate, bytes: usize) {
        let snapshots = &self.snapshots[rate as usize];
        snapshots.count.inc();
        snapshots.bytes.inc_by(bytes as u64);
    }

    /// Counts a player who got a seat: the old one, or a new one.
    pub fn joined(&self, resumed: bool) {
        let how = if resumed { "resumed" } else { "new" };
        self.joins.get_or_create(&[("how", how)]).inc();
    }

    /// Counts snapshots that were not sent to a client.
    pub fn skipped(&self, why: Skip, count: usize) {
        self.skips[why as usize].inc_by(count as u64);
    }

    /// Counts a player who `left` on purpose, `lost` the socket or was `kicked`, or a held seat
    /// `displaced` by a newcomer.
    pub fn left(&self, how: &'static str) {
        self.leaves.get_or_create(&[("how", how)]).inc();
    }

    /// Counts a refused connection, request or session.
    pub fn refused(&self, reason: &'static str) {
        self.refusals.get_or_create(&[("reason", reason)]).inc();
    }

    /// Encodes all metrics as text, with these gauges.
    pub fn text(&self, gauges: Gauges) -> String {
        self.rooms.set(gauges.rooms);
        self.players.set(gauges.players);
        self.bodies.set(gauges.bodies);
        if let Some([bytes, errors]) = gauges.replays {
            raise(&self.replay_bytes, bytes);
            raise(&self.replay_errors, errors);
        }
        raise(&self.log_drops, gauges.log_drops);
        let mut text = String::new();
        encode_registry(&mut text, &self.registry).expect("a String takes everything");
        encode_registry(&mut text, &of_process()).expect("a String takes everything");
        encode_eof(&mut text).expect("a String takes everything");
        text
    }
}

impl Ticks {
    /// Observes one wakeup: ticks played and missed, its lateness, and the time of each phase.
    pub fn woke(&self, played: u32, missed: u64, late: Late, phases: [Duration; 3]) {
        self.played.inc_by(u64::from(played));
        self.missed.inc_by(missed);
        self.lateness.observe(late.raw.as_secs_f64());
        if let Some(queued) = late.queued {
            self.lateness_own.observe(late.raw.saturating_sub(queued).as_secs_f64());
        }
        for (histogram, time) in self.phases.iter().zip(phases) {
            histogram.observe(time.as_secs_f64());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_has_every_metric() {
        let metrics = Metrics::default();
        metrics.joined(false);
        metrics.joined(true);
        metrics.left("left");
        metrics.skipped(Skip::Queue, 3);
        metrics.lag.observe(5.0);
        metrics.refused(reason(Refusal::Flood));
        metrics.refused("foreign_page");
        metrics.snapshots[1].bytes.inc_by(700);
        let phases = [10, 300, 20].map(Duration::from_micros);
        let [raw, queued] = [380, 340].map(Duration::from_micros);
        metrics.ticks.woke(2, 1, Late { raw, queued: Some(queued) }, phases);
        metrics.ticks.woke(0, 0, Late { raw, queued: None }, phases);
        let gauges =
            Gauges { rooms: 1, players: 2, bodies: 30, replays: Some([4000, 1]), log_drops: 9 };
        let text = metrics.text(gauges);
        for line in [
            "jostle_ticks_total 2",
            "jostle_ticks_missed_total 1",
            "jostle_tick_play_seconds_count 2",
            "jostle_tick_lateness_seconds_bucket{le=\"0.00035\"} 0",
            "jostle_tick_lateness_seconds_bucket{le=\"0.0005\"} 2",
            "jostle_tick_lateness_own_seconds_bucket{le=\"0.00005\"} 1",
            "jostle_snapshots_bytes_total{hz=\"20\"} 700",
            "jostle_joins_total{how=\"new\"} 1",
            "jostle_joins_total{how=\"resumed\"} 1",
            "jostle_inputs_ignored_total 0",
            "jostle_rooms_failed_total 0",
            "jostle_leaves_total{how=\"left\"} 1",
            "jostle_refusals_total{reason=\"flood\"} 1",
            "jostle_refusals_total{reason=\"foreign_page\"} 1",
            "jostle_snapshots_skipped_total{reason=\"queue\"} 3",
            "jostle_client_lag_ticks_bucket{le=\"8.0\"} 1",
            "jostle_bodies 30",
            "jostle_replay_bytes_total 4000",
            "jostle_log_dropped_total 9",
        ] {
            assert!(text.lines().any(|found| found == line), "{line} is missing in\n{text}");
        }
        assert!(text.ends_with("# EOF\n"));
        // Scraped again, a counter does not grow by itself.
        assert!(metrics.text(gauges).contains("jostle_replay_bytes_total 4000"));
    }
}
