//! The fleet as seen by sessions and requests. It locates rooms and places new ones.

use super::directory::{Action, Load};
use super::directory::{Change, Directory, Located, NodeSettings, PlaceError, Time};
use super::entry::{Entry, Key, NodeEntry, RoomCounts, RoomFacts};
use super::lease::Lease;
use super::settings::FleetSettings;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{Notify, watch};
use tokio::time::{sleep, timeout, timeout_at};
use tracing::error;

/// Maximum time that a session waits for its room's location.
const FLEET_FIND: Duration = Duration::from_secs(4);
/// Delay before a node retries placing a room.
const FLEET_PLACE_RETRY: Duration = Duration::from_millis(50);
/// Maximum number of node addresses, present and past, whose pages may play here.
const FLEET_SITES_MAX: usize = 1000;

/// This node's role in its fleet. Only [`Fleet::find`] and [`Fleet::place`] wait for the network, until the directory
/// has an answer.
pub struct Fleet {
    start: Instant,
    state: Mutex<FleetState>,
    due: Notify,
    /// Notified of every change to the directory.
    changed: watch::Sender<()>,
    lease: Arc<Lease>,
    incarnation: u64,
    secret_mark: u32,
}

struct FleetState {
    directory: Directory,
    /// Origins of all known nodes, whose pages may play here.
    sites: BTreeSet<String>,
    /// Nodes with a different secret that the log has already mentioned.
    strangers: BTreeSet<String>,
}

impl FleetState {
    /// Logs a node with a different secret, once per node. Players who move between that node and this one would lose
    /// their seats.
    fn compare_secret(&mut self, name: &str, node: &NodeEntry, mark: u32) {
        if node.secret_mark.is_none_or(|other| other == mark) {
            self.strangers.remove(name);
        } else if self.strangers.insert(name.to_owned()) {
            error!(
                node = %name, url = %node.url,
                "this node has another secret: players who come from there, or go there, lose their seats; \
                 give all nodes of a fleet the same --secret"
            );
        }
    }
}

impl Fleet {
    /// Creates the handle for a node that is not registered yet. `incarnation` is random.
    pub fn new(settings: &FleetSettings, incarnation: u64) -> Fleet {
        let start = Instant::now();
        let node = NodeSettings {
            name: settings.node.clone(),
            url: settings.url.clone(),
            capacity: settings.capacity,
            incarnation,
            secret_mark: settings.secret_mark(),
        };
        let state = FleetState {
            directory: Directory::new(node),
            sites: BTreeSet::new(),
            strangers: BTreeSet::new(),
        };
        Fleet {
            start,
            state: Mutex::new(state),
            due: Notify::new(),
            changed: watch::Sender::new(()),
            lease: Arc::new(Lease::new(start)),
            incarnation,
            secret_mark: settings.secret_mark(),
        }
    }

    pub fn lease(&self) -> &Arc<Lease> {
        &self.lease
    }

    /// Time left on the lease.
    pub fn lease_left(&self) -> Duration {
        self.lease.left(Instant::now())
    }

    /// Passes an event to the directory, and wakes the driver and everything waiting for a change.
    pub fn tell<R>(&self, event: impl FnOnce(&mut Directory, Time) -> R) -> R {
        let result = event(&mut self.lock().directory, self.start.elapsed());
        self.due.notify_one();
        self.changed.send_replace(());
        result
    }

    /// Passes on an answer that arrived over the connection with this number, if that connection is still the current
    /// one.
    pub fn tell_over(&self, connection: u64, event: impl FnOnce(&mut Directory, Time)) {
        self.tell(|directory, now| {
            if directory.connection() == connection {
                event(directory, now);
            }
        });
    }

    pub fn ask<R>(&self, question: impl FnOnce(&Directory) -> R) -> R {
        question(&self.lock().directory)
    }

    /// Waits until the directory has actions, then takes them, along with the number of the connection for which they
    /// are meant.
    pub async fn actions(&self) -> (u64, Vec<Action>) {
        loop {
            let taken = {
                let directory = &mut self.lock().directory;
                (directory.connection(), directory.take_actions())
            };
            if !taken.1.is_empty() {
                return taken;
            }
            self.due.notified().await;
        }
    }

    /// Passes on a reported change, and remembers nodes' addresses.
    pub fn heard(&self, change: Change) {
        if let Change::Written(Key::Node(name), Entry::Node(node), _) = &change {
            let mut state = self.lock();
            if state.sites.len() < FLEET_SITES_MAX {
                state.sites.insert(node.url.clone());
            }
            state.compare_secret(name, node, self.secret_mark);
        }
        self.tell(|directory, now| directory.changed(change, now));
    }

    /// Sets the measured load. `used` is processor time in seconds per second.
    pub fn measured(&self, used: f64, rooms_left: usize, rooms: Vec<RoomCounts>) {
        self.lock().directory.measured(Load { used, rooms_left, rooms });
    }

    /// Returns whether a page with this origin belongs to a node.
    pub fn is_site(&self, origin: &str) -> bool {
        self.lock().sites.contains(origin)
    }

    /// Waits until a room's location is known, for at most [`FLEET_FIND`]. This node's information may be out of date,
    /// so it looks up the entry of any room that it does not play itself.
    pub async fn find(&self, code: &str) -> Located {
        let mut changes = self.changed.subscribe();
        if self.ask(|directory| directory.locate(code)) == Located::Here {
            return Located::Here;
        }
        self.tell(|directory, _| directory.look(code));
        let known = async {
            loop {
                let located = self.ask(|directory| match directory.looks_for(code) {
                    true => Located::Soon,
                    false => directory.locate(code),
                });
                if located != Located::Soon || changes.changed().await.is_err() {
                    return located;
                }
            }
        };
        timeout(FLEET_FIND, known).await.unwrap_or(Located::Soon)
    }

    /// Places a new room, and waits until the room's node is known.
    pub async fn place(&self, code: &str, facts: RoomFacts) -> Result<Located, PlaceError> {
        self.place_by(code, |directory, now| directory.place(code, facts.clone(), now)).await
    }

    /// Like [`Fleet::place`], for a room that only this node can open.
    pub async fn place_here(&self, code: &str, facts: RoomFacts) -> Result<Located, PlaceError> {
        self.place_by(code, |directory, _| directory.place_here(code, facts.clone())).await
    }

    async fn place_by(
        &self,
        code: &str,
        place: impl Fn(&mut Directory, Time) -> Result<(), PlaceError>,
    ) -> Result<Located, PlaceError> {
        let until = tokio::time::Instant::now() + FLEET_FIND;
        // A node that has just started does not know the other nodes yet.
        while let Err(error) = self.tell(&place) {
            if error != PlaceError::NotNow || tokio::time::Instant::now() >= until {
                return Err(error);
            }
            sleep(FLEET_PLACE_RETRY).await;
        }
        Ok(self.find(code).await)
    }

    /// Hands over this node's rooms, or as many as possible by the deadline.
    pub async fn hand_over(&self, until: tokio::time::Instant) {
        self.tell(|directory, now| directory.drain(now));
        self.wait_for(until, |directory| directory.holds() == 0).await;
    }

    /// Removes this node's entry, so that the others need not wait for it to expire.
    pub async fn leave(&self, until: tokio::time::Instant) {
        self.tell(|directory, _| directory.leave());
        self.wait_for(until, |directory| !directory.is_registered()).await;
    }

    async fn wait_for(&self, until: tokio::time::Instant, is_done: impl Fn(&Directory) -> bool) {
        let mut changes = self.changed.subscribe();
        let done = async { while !self.ask(&is_done) && changes.changed().await.is_ok() {} };
        let _ = timeout_at(until, done).await;
    }

    /// The incarnation with which this node started.
    pub fn first_incarnation(&self) -> u64 {
        self.incarnation
    }

    /// Ignores poisoning: the next change repairs an incomplete one.
    fn lock(&self) -> MutexGuard<'_, FleetState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
