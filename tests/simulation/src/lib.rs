//! Simulates a fleet in one thread and in virtual time: real [`Directory`]s with a simulated store, network and clocks.
//! Messages are delayed or lost, nodes freeze and die, and the store fails. After each event, the required properties
//! of a fleet are checked. A seed determines the whole course of events, so that a violation can be reproduced.
//!
//! The store has two buckets, which are not ordered relative to each other: the nodes' entries, which expire silently,
//! and the rooms' entries. A node's watchers receive writes in order but with a delay, possibly without those that have
//! been overwritten since. Rooms also have records, which act as fences: an opened room appends to the newest record,
//! and an append is refused if another room has appended in the meantime.

mod check;
mod driver;
mod faults;
mod network;
mod node;
mod queue;
mod settings;
mod store;
#[cfg(test)]
mod tests;

pub use settings::{Faults, Flaws, Settings, Violation};
pub use store::{Bucket, Traffic};

use jostle_server::fleet::directory::Directory;
use jostle_sim::Rng;
use node::Node;
use queue::{Event, Process, Queue};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use store::Store;

/// Time between polls of a directory.
const POLL_EVERY: Duration = Duration::from_millis(100);
/// Time after which a request counts as unanswered.
const TIME_LIMIT: Duration = Duration::from_millis(1500);
/// Time between records of a room.
const RECORD_EVERY: Duration = Duration::from_secs(1);

#[derive(Debug)]
pub struct Simulation {
    settings: Settings,
    now: Duration,
    rng: Rng,
    queue: Queue,
    store: Store,
    /// When the store will respond again.
    store_back_at: Duration,
    nodes: Vec<Option<Node>>,
    /// Number of processes that each node has had so far.
    lives: Vec<u32>,
    /// The nodes at which each room is open.
    playing: BTreeMap<String, BTreeSet<usize>>,
    /// Rooms that have ended for good.
    ended: BTreeSet<String>,
    /// Epoch of each room's entry; 0 if the entry was removed.
    epochs: BTreeMap<String, u64>,
    /// Rooms for which the store has lost epochs that nodes may still know.
    forgotten: BTreeSet<String>,
    /// Number of requests and opened rooms so far.
    numbers: u64,
    /// Rooms without a node, and when they lost it.
    lost_at: BTreeMap<String, Duration>,
    /// How long each room was without a node.
    gaps: Vec<Duration>,
}

impl Simulation {
    /// Creates a fleet whose nodes are about to start.
    pub fn new(settings: Settings) -> Simulation {
        let mut simulation = Simulation {
            now: Duration::ZERO,
            rng: Rng::new(settings.seed, 0),
            queue: Queue::default(),
            store: Store::new(settings.flaws.clone()),
            store_back_at: Duration::ZERO,
            nodes: (0..settings.nodes).map(|_| None).collect(),
            lives: vec![0; settings.nodes],
            playing: BTreeMap::new(),
            ended: BTreeSet::new(),
            epochs: BTreeMap::new(),
            forgotten: BTreeSet::new(),
            numbers: 0,
            lost_at: BTreeMap::new(),
            gaps: Vec::new(),
            settings,
        };
        simulation.plan();
        simulation
    }

    /// Runs until the given time after the start. The error is the first violated property.
    pub fn run_until(&mut self, until: Duration) -> Result<(), Violation> {
        while let Some((at, event)) = self.queue.pop(until) {
            self.now = at;
            self.happens(event)?;
        }
        self.now = until;
        Ok(())
    }

    /// Runs the period with faults and then a minute without any, after which everything must be in order.
    pub fn run(settings: Settings) -> Result<Simulation, Violation> {
        let quiet_at = settings.faulty_for;
        let mut simulation = Simulation::new(settings);
        simulation.run_until(quiet_at)?;
        simulation.end_faults();
        simulation.run_until(quiet_at + Duration::from_secs(60))?;
        simulation.check_order()?;
        Ok(simulation)
    }

    /// Returns the time since the start.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// The traffic of a bucket so far.
    pub fn traffic(&self, bucket: Bucket) -> Traffic {
        self.store.traffic(bucket)
    }

    /// For each room that lost its node, how long it was without one.
    pub fn gaps(&self) -> &[Duration] {
        &self.gaps
    }

    /// Number of rooms that lost their node and are not being played again yet.
    pub fn waiting(&self) -> usize {
        self.lost_at.len()
    }

    /// Number of times that a room has changed nodes so far.
    pub fn moves(&self) -> u64 {
        self.epochs.values().map(|epoch| epoch.saturating_sub(1)).sum()
    }

    /// The directory of a running node.
    pub fn directory(&self, node: usize) -> Option<&Directory> {
        Some(&self.nodes[node].as_ref()?.directory)
    }

    fn happens(&mut self, event: Event) -> Result<(), Violation> {
        match event {
            Event::At(process, event) => return self.at_node(process, event),
            Event::Arrives(process, number, request) => {
                return self.arrives(process, number, request);
            }
            Event::Starts(node) => self.start(node),
            Event::CutEnds(process) => self.cut_ends(process),
            Event::GoesOn(process) => return self.goes_on(process),
            Event::Place(code) => return self.place(code),
            Event::End(code) => return self.end(code),
            Event::Fault(fault) => return self.fault(fault),
        }
        Ok(())
    }

    fn node(&mut self, process: Process) -> Option<&mut Node> {
        self.nodes[process.node].as_mut().filter(|node| node.process == process)
    }

    fn number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    fn chance(&mut self, of_a_thousand: u32) -> bool {
        self.rng.below(1000) < of_a_thousand
    }

    fn seconds(&mut self, low: f32, high: f32) -> Duration {
        Duration::from_secs_f32(self.rng.range(low, high))
    }
}
