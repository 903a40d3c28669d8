//! Metrics for operators: counters, gauges and histograms in base units, as text for Prometheus (OpenMetrics). No label
//! names a player, a room or an address, so there are few series, and none reveals a player's identity.

use crate::ops::process;
use crate::ops::reasons;
use jostle_room::Rate;
use prometheus_client::encoding::text::{encode_eof, encode_registry};
use prometheus_client::metrics::counter::{ConstCounter, Counter};
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Metric, Registry, Unit};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

type Label = [(&'static str, &'static str); 1];

/// All of a server's metrics. Handles are cheap to clone and can be used from any thread.
pub struct Metrics {
    registry: Registry,
    /// Metrics about ticks, across all rooms.
    pub ticks: Ticks,
    /// Snapshots by rate, in the order of [`Rate::ALL`].
    pub snapshots: [Snapshots; Rate::ALL.len()],
    /// Keyframes sent at a lower rate to sockets that were too far behind.
    pub late: Counter,
    /// Clients' lag in ticks; each client is observed once a second.
    pub lag: Histogram,
    /// Inputs dropped because of their sequence numbers.
    pub inputs_ignored: Counter,
    /// Rooms that panicked.
    pub rooms_failed: Counter,
    /// Failed calls to the Agones sidecar.
    pub agones_errors: Counter,
    /// Skipped snapshots, in the order of [`Skip`].
    skips: [Counter; 5],
    messages_ignored: Family<Label, Counter>,
    joins: Family<Label, Counter>,
    leaves: Family<Label, Counter>,
    refusals: Family<Label, Counter>,
}

/// Metrics about the rooms' threads, updated at each wakeup.
#[derive(Clone)]
pub struct Ticks {
    pub played: Counter,
    /// Ticks that were due but never played.
    pub missed: Counter,
    /// Number of seconds between when a tick was due and when it started.
    pub lateness: Histogram,
    /// Lateness, excluding the time during which the thread had no processor, if the system measures that.
    pub lateness_own: Histogram,
    /// Seconds spent emptying inboxes, playing, and handing out snapshots.
    pub phases: [Histogram; 3],
    /// Total time spent in these phases, in nanoseconds.
    busy: Arc<AtomicU64>,
    /// Ticks that were not played because another node may be playing the room.
    stood_still: Arc<AtomicU64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Late {
    /// Time between when a tick was due and when it started.
    pub raw: Duration,
    /// How long the thread has waited for a processor since the previous tick, if the system measures that.
    pub queued: Option<Duration>,
}

/// Snapshots sent to clients at one rate.
#[derive(Clone, Default)]
pub struct Snapshots {
    /// Messages queued for sockets.
    pub count: Counter,
    pub bytes: Counter,
}

/// The reason why a client did not get a snapshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skip {
    /// Nothing changed in the client's view.
    Quiet,
    /// The client's rate is 20 or 5 per second.
    Rate,
    /// The client's outbox is too full.
    Queue,
    /// The newest snapshot that the client acknowledged is too old.
    Lag,
    /// The budget of the client's address, or of the rooms with guests' scenes, is used up.
    Uplink,
}

/// Values at the time of a scrape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gauges {
    /// Number of open rooms.
    pub rooms: i64,
    /// Number of seats taken, across all rooms.
    pub players: i64,
    /// Number of spectators, across all rooms.
    pub spectators: i64,
    /// Number of bodies, across all rooms.
    pub bodies: i64,
    /// Seconds since the last wakeup of the room that has been asleep longest; 0 if there are no rooms.
    pub room_tick_age: f64,
    /// Bytes of replays written so far, and number of files given up.
    pub replays: Option<[u64; 2]>,
    /// Number of times that a room's file in the state directory was given up or could not be restored.
    pub state_errors: u64,
    /// Number of log lines dropped so far.
    pub log_drops: u64,
    /// This node's role in its fleet, if it is in one.
    pub fleet: Option<FleetGauges>,
}

/// A node's role in its fleet at the time of a scrape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FleetGauges {
    /// Number of registered nodes, including this one.
    pub nodes: i64,
    /// Number of rooms that this node holds.
    pub rooms: i64,
    /// Seconds for which the node's rooms may still be played if NATS stops answering.
    pub lease_left: f64,
}

/// A histogram from 50 microseconds to half a second, with finer buckets around the target values.
fn lateness() -> Histogram {
    let fine = [5e-5, 1e-4, 1.5e-4, 2e-4, 2.5e-4, 3.5e-4, 5e-4, 7.5e-4, 1e-3, 1.5e-3, 2.5e-3];
    let long = [5e-3, 1e-2, 1.67e-2, 2.5e-2, 5e-2, 0.1, 0.25, 0.5];
    Histogram::new(fine.into_iter().chain(long))
}

/// A histogram from 15 microseconds to half a second.
fn seconds() -> Histogram {
    Histogram::new(exponential_buckets(15.6e-6, 2.0, 16))
}

/// Registers a metric and returns it.
fn add<M: Metric + Clone>(registry: &mut Registry, name: &str, about: &str, metric: M) -> M {
    registry.register(name, about, metric.clone());
    metric
}

fn counter(registry: &mut Registry, name: &str, about: &str) -> Counter {
    add(registry, name, about, Counter::default())
}

/// A family of counters that differ in one label.
fn family(registry: &mut Registry, name: &str, about: &str) -> Family<Label, Counter> {
    add(registry, name, about, Family::default())
}

/// Like [`add`], with a unit that ends the name.
fn add_in<M: Metric + Clone>(
    unit: Unit,
    registry: &mut Registry,
    name: &str,
    about: &str,
    metric: M,
) -> M {
    registry.register_with_unit(name, about, unit, metric.clone());
    metric
}

impl Default for Metrics {
    fn default() -> Metrics {
        let mut registry = Registry::with_prefix("jostle");
        let r = &mut registry;
        let version = Info::new([("version", env!("CARGO_PKG_VERSION"))]);
        r.register("build", "The program that serves", version);
        let lag = Histogram::new(exponential_buckets(1.0, 2.0, 11));
        Metrics {
            ticks: Ticks::registered(r),
            snapshots: snapshots(r),
            skips: skips(r),
            late: counter(r, "sockets_late", "Sockets that were too far behind for deltas"),
            lag: add(
                r,
                "client_lag_ticks",
                "Ticks from the newest snapshot acknowledged to the newest sent, each client once a second",
                lag,
            ),
            inputs_ignored: counter(
                r,
                "inputs_ignored",
                "Inputs with old, repeated or far-future numbers",
            ),
            messages_ignored: family(
                r,
                "messages_ignored",
                "Messages without effect, beside inputs: emotes that came too soon, and what spectators may not send",
            ),
            joins: family(r, "joins", "Players who got a seat, resumed or new, and spectators"),
            leaves: family(r, "leaves", "Players who left, by cause, and spectators"),
            refusals: refusals(r),
            rooms_failed: counter(r, "rooms_failed", "Rooms ended by a panic"),
            agones_errors: counter(r, "agones_errors", "Calls of Agones' sidecar that failed"),
            registry,
        }
    }
}

impl Ticks {
    fn registered(r: &mut Registry) -> Ticks {
        let mut time = |name, about, histogram| add_in(Unit::Seconds, r, name, about, histogram);
        Ticks {
            lateness: time(
                "tick_lateness",
                "Time from when a tick was due to its start",
                lateness(),
            ),
            lateness_own: time(
                "tick_lateness_own",
                "Lateness without the wait for a processor",
                lateness(),
            ),
            phases: [
                time("tick_inputs", "Time of a wakeup spent on: inputs", seconds()),
                time("tick_play", "Time of a wakeup spent on: play", seconds()),
                time("tick_send", "Time of a wakeup spent on: send", seconds()),
            ],
            busy: Arc::default(),
            stood_still: Arc::default(),
            played: counter(r, "ticks", "Ticks played"),
            missed: counter(r, "ticks_missed", "Ticks due and never played"),
        }
    }
}

fn snapshots(r: &mut Registry) -> [Snapshots; Rate::ALL.len()] {
    let count = family(r, "snapshots", "Snapshots queued for sockets, by rate");
    let about = "Bytes of snapshots queued for sockets, by rate";
    let bytes = add_in(Unit::Bytes, r, "snapshots", about, Family::<Label, Counter>::default());
    ["60", "20", "5"].map(|hz| Snapshots {
        count: count.get_or_create(&[("hz", hz)]).clone(),
        bytes: bytes.get_or_create(&[("hz", hz)]).clone(),
    })
}

fn skips(r: &mut Registry) -> [Counter; 5] {
    let skips = family(r, "snapshots_skipped", "Snapshots not sent to a client, by reason");
    ["quiet", "rate", "queue", "lag", "uplink"]
        .map(|reason| skips.get_or_create(&[("reason", reason)]).clone())
}

/// The counters for all reasons, starting at zero.
fn refusals(r: &mut Registry) -> Family<Label, Counter> {
    let refusals = family(r, "refusals", "Requests and sessions refused or ended, by reason");
    reasons::all().for_each(|reason| drop(refusals.get_or_create(&[("reason", reason)])));
    refusals
}

/// Metrics that are counted elsewhere, with their values at the time of a scrape.
fn counted_elsewhere(gauges: Gauges) -> Registry {
    let mut registry = Registry::with_prefix("jostle");
    registry.register("rooms", "Open rooms", ConstGauge::new(gauges.rooms));
    registry.register("players", "Seats taken", ConstGauge::new(gauges.players));
    registry.register("spectators", "Spectators", ConstGauge::new(gauges.spectators));
    registry.register("bodies", "Bodies in all rooms", ConstGauge::new(gauges.bodies));
    let about = "Time since the last tick of the room whose last tick is oldest";
    let age = ConstGauge::new(gauges.room_tick_age);
    registry.register_with_unit("room_tick_age", about, Unit::Seconds, age);
    let [bytes, errors] = gauges.replays.unwrap_or_default().map(ConstCounter::new);
    registry.register_with_unit("replay", "Replays written", Unit::Bytes, bytes);
    registry.register("replay_errors", "Replay files abandoned after an error", errors);
    let about = "Files of rooms in the state directory abandoned after an error, or not restored";
    registry.register("state_errors", about, ConstCounter::new(gauges.state_errors));
    let about = "Log lines dropped because the log was read too slowly";
    registry.register("log_dropped", about, ConstCounter::new(gauges.log_drops));
    if let Some(fleet) = gauges.fleet {
        let about = "Nodes that are registered in the fleet";
        registry.register("fleet_nodes", about, ConstGauge::new(fleet.nodes));
        let about = "Rooms that the fleet's directory gives to this node";
        registry.register("fleet_rooms", about, ConstGauge::new(fleet.rooms));
        let about = "Time for which this node's rooms may be played if NATS does not answer";
        let left = ConstGauge::new(fleet.lease_left);
        registry.register_with_unit("fleet_lease_left", about, Unit::Seconds, left);
    }
    registry
}

/// Metrics about the process, under their conventional names.
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

impl Metrics {
    /// Counts a snapshot queued for a socket.
    pub fn sent(&self, rate: Rate, bytes: usize) {
        let snapshots = &self.snapshots[rate as usize];
        snapshots.count.inc();
        snapshots.bytes.inc_by(bytes as u64);
    }

    /// Counts a player who got a seat, which is either `new` or a former one (`resumed`), or a `spectator`.
    pub fn joined(&self, how: &'static str) {
        self.joins.get_or_create(&[("how", how)]).inc();
    }

    /// Counts a message that had no effect: an `emote` or a `look` that came too soon, or any message from a `spectator`.
    pub fn ignored(&self, kind: &'static str) {
        self.messages_ignored.get_or_create(&[("kind", kind)]).inc();
    }

    /// Counts snapshots that a client did not get.
    pub fn skipped(&self, why: Skip, count: usize) {
        self.skips[why as usize].inc_by(count as u64);
    }

    /// Counts a player who `left` on purpose, `lost` the socket or was `kicked`, a held seat that was `displaced` by a
    /// newcomer, or a `spectator` who left.
    pub fn left(&self, how: &'static str) {
        self.leaves.get_or_create(&[("how", how)]).inc();
    }

    /// Counts a refused connection, request or session.
    pub fn refused(&self, reason: &'static str) {
        debug_assert!(reasons::all().any(|known| known == reason), "{reason} is in no list");
        self.refusals.get_or_create(&[("reason", reason)]).inc();
    }

    /// Encodes all metrics as text, with these gauges.
    pub fn text(&self, gauges: Gauges) -> String {
        let mut text = String::new();
        for registry in [&self.registry, &counted_elsewhere(gauges), &of_process()] {
            encode_registry(&mut text, registry).expect("a String takes everything");
        }
        encode_eof(&mut text).expect("a String takes everything");
        text
    }
}

impl Ticks {
    /// Observes one wakeup: the ticks played and missed, its lateness, and the time spent in each phase.
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
        let busy: Duration = phases.iter().sum();
        self.busy.fetch_add(busy.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Counts a wakeup of a room that is paused because it has no lease.
    pub fn stood_still(&self) {
        self.stood_still.fetch_add(1, Ordering::Relaxed);
    }

    /// Increases as long as some room's thread wakes on time, whether it plays or is paused.
    pub fn signs_of_life(&self) -> u64 {
        self.played.get() + self.stood_still.load(Ordering::Relaxed)
    }

    /// The processing time that all rooms have used so far.
    pub fn busy(&self) -> Duration {
        Duration::from_nanos(self.busy.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::path::{Path, PathBuf};

    /// Metrics and gauges in which every value is set.
    fn counted() -> (Metrics, Gauges) {
        let metrics = Metrics::default();
        metrics.joined("new");
        metrics.joined("resumed");
        metrics.left("left");
        metrics.ignored("emote");
        metrics.skipped(Skip::Queue, 3);
        metrics.lag.observe(5.0);
        metrics.refused("flood");
        metrics.refused("foreign_page");
        metrics.snapshots[1].bytes.inc_by(700);
        let phases = [10, 300, 20].map(Duration::from_micros);
        let [raw, queued] = [380, 340].map(Duration::from_micros);
        metrics.ticks.woke(2, 1, Late { raw, queued: Some(queued) }, phases);
        metrics.ticks.woke(0, 0, Late { raw, queued: None }, phases);
        let gauges = Gauges {
            rooms: 1,
            players: 2,
            spectators: 4,
            bodies: 30,
            room_tick_age: 12.5,
            replays: Some([4000, 1]),
            state_errors: 3,
            log_drops: 9,
            fleet: Some(FleetGauges { nodes: 3, rooms: 7, lease_left: 14.5 }),
        };
        (metrics, gauges)
    }

    #[test]
    fn the_text_has_every_metric() {
        let (metrics, gauges) = counted();
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
            "jostle_messages_ignored_total{kind=\"emote\"} 1",
            "jostle_rooms_failed_total 0",
            "jostle_agones_errors_total 0",
            "jostle_leaves_total{how=\"left\"} 1",
            "jostle_refusals_total{reason=\"flood\"} 1",
            "jostle_refusals_total{reason=\"foreign_page\"} 1",
            "jostle_refusals_total{reason=\"cannot_accept\"} 0",
            "jostle_refusals_total{reason=\"server_full\"} 0",
            "jostle_snapshots_skipped_total{reason=\"queue\"} 3",
            "jostle_client_lag_ticks_bucket{le=\"8.0\"} 1",
            "jostle_bodies 30",
            "jostle_room_tick_age_seconds 12.5",
            "jostle_spectators 4",
            "jostle_replay_bytes_total 4000",
            "jostle_state_errors_total 3",
            "jostle_log_dropped_total 9",
        ] {
            assert!(text.lines().any(|found| found == line), "{line} is missing in\n{text}");
        }
        assert!(text.ends_with("# EOF\n"));
        // A counter does not grow if it is scraped again.
        assert!(metrics.text(gauges).contains("jostle_replay_bytes_total 4000"));
    }

    /// Files that operators install, and the metrics that each one mentions.
    fn installed() -> Vec<(String, Vec<String>)> {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy");
        let paths =
            fs::read_dir(dir).expect("a directory").map(|entry| entry.expect("an entry").path());
        let read = |path: PathBuf| {
            let text = fs::read_to_string(&path).expect("text");
            let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            // Process metrics are available only on Linux.
            let named = words.filter(|word| {
                word.starts_with("jostle_")
                    || cfg!(target_os = "linux") && word.starts_with("process_")
            });
            let named = named.map(str::to_owned).collect();
            (path.file_name().expect("a name").to_string_lossy().into_owned(), named)
        };
        let is_read =
            |path: &PathBuf| path.extension().is_some_and(|end| end == "yaml" || end == "json");
        paths.filter(is_read).map(read).collect()
    }

    #[test]
    fn what_operators_install_names_only_metrics_that_exist() {
        let (metrics, gauges) = counted();
        let text = metrics.text(gauges);
        let exported: Vec<&str> =
            text.lines().filter_map(|line| line.split(['{', ' ']).next()).collect();
        let installed = installed();
        for file in ["alerts.yaml", "dashboard.json"] {
            let named =
                installed.iter().find(|(name, _)| name == file).map(|(_, named)| named.len());
            assert!(named > Some(0), "{file} names {named:?} metrics");
        }
        for (file, named) in &installed {
            for name in named {
                assert!(exported.contains(&name.as_str()), "{file}: no metric {name} in\n{text}");
            }
        }
    }
}
