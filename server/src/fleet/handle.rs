//! The fleet as sessions and requests see it: where a room is, and where a new one goes.

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

/// Time for which a session waits until it is known where its room is.
const FLEET_FIND: Duration = Duration::from_secs(4);
/// Wait of a node that cannot place a room yet.
const FLEET_PLACE_RETRY: Duration = Duration::from_millis(50);
/// Addresses of nodes, present and past, whose pages may play here.
const FLEET_SITES_MAX: usize = 1000;

/// This node's part in its fleet. Nothing here waits for the network, but for [`Fleet::find`] and [`Fleet::place`],
/// which wait until the directory tells.
pub struct Fleet {
    start: Instant,
    state: Mutex<FleetState>,
    due: Notify,
    /// Counts changes of the directory.
    changed: watch::Sender<()>,
    lease: Arc<Lease>,
    incarnation: u64,
    secret_mark: u32,
}

struct FleetState {
    directory: Directory,
    /// Origins of all nodes that were heard of, whose pages may play here.
    sites: BTreeSet<String>,
    /// Nodes with another secret, which the log has named.
    strangers: BTreeSet<String>,
}

impl FleetState {
    /// Names a node with another secret in the log, once: its players would lose their seats here, and those from here theirs.
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
    /// A node that is not registered yet. `incarnation` is random.
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

    /// The lease of this node.
    pub fn lease(&self) -> &Arc<Lease> {
        &self.lease
    }

    /// The time that is left of the lease.
    pub fn lease_left(&self) -> Duration {
        self.lease.left(Instant::now())
    }

    /// Passes something to the directory, and wakes the driver and all that wait for a change.
    pub fn tell<R>(&self, event: impl FnOnce(&mut Directory, Time) -> R) -> R {
        let result = event(&mut self.lock().directory, self.start.elapsed());
        self.due.notify_one();
        self.changed.send_replace(());
        result
    }

    /// Passes on an answer that came over the connection of this number, if that is still the present one.
    pub fn tell_over(&self, connection: u64, event: impl FnOnce(&mut Directory, Time)) {
        self.tell(|directory, now| {
            if directory.connection() == connection {
                event(directory, now);
            }
        });
    }

    /// Looks something up in the directory.
    pub fn ask<R>(&self, question: impl FnOnce(&Directory) -> R) -> R {
        question(&self.lock().directory)
    }

    /// Waits until the directory has something to do, and takes it, with the number of the connection that it is for.
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

    /// Passes on a change that was heard of, and remembers where nodes are reached.
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

    /// Measures the load: `used` is in processor seconds a second.
    pub fn measured(&self, used: f64, rooms_left: usize, rooms: Vec<RoomCounts>) {
        self.lock().directory.measured(Load { used, rooms_left, rooms });
    }

    /// Returns whether a page of this origin belongs to a node.
    pub fn is_site(&self, origin: &str) -> bool {
        self.lock().sites.contains(origin)
    }

    /// Waits until it is known where a room is, [`FLEET_FIND`] at most. What this node has heard may be out of
    /// date, so that it asks for the entry of a room that it does not play itself.
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

    /// Places a new room, and waits until its node is known.
    pub async fn place(&self, code: &str, facts: RoomFacts) -> Result<Located, PlaceError> {
        self.place_by(code, |directory, now| directory.place(code, facts.clone(), now)).await
    }

    /// The same for a room that only this node can open.
    pub async fn place_here(&self, code: &str, facts: RoomFacts) -> Result<Located, PlaceError> {
        self.place_by(code, |directory, _| directory.place_here(code, facts.clone())).await
    }

    async fn place_by(
        &self,
        code: &str,
        place: impl Fn(&mut Directory, Time) -> Result<(), PlaceError>,
    ) -> Result<Located, PlaceError> {
        let until = tokio::time::Instant::now() + FLEET_FIND;
        // A node that has just started does not know the others yet.
        while let Err(error) = self.tell(&place) {
            if error != PlaceError::NotNow || tokio::time::Instant::now() >= until {
                return Err(error);
            }
            sleep(FLEET_PLACE_RETRY).await;
        }
        Ok(self.find(code).await)
    }

    /// Hands the rooms of this node over, as far as that is done by this time.
    pub async fn hand_over(&self, until: tokio::time::Instant) {
        self.tell(|directory, now| directory.drain(now));
        self.wait_for(until, |directory| directory.holds() == 0).await;
    }

    /// Removes the entry of this node, so that the others need not wait for its end.
    pub async fn leave(&self, until: tokio::time::Instant) {
        self.tell(|directory, _| directory.leave());
        self.wait_for(until, |directory| !directory.is_registered()).await;
    }

    async fn wait_for(&self, until: tokio::time::Instant, is_done: impl Fn(&Directory) -> bool) {
        let mut changes = self.changed.subscribe();
        let done = async { while !self.ask(&is_done) && changes.changed().await.is_ok() {} };
        let _ = timeout_at(until, done).await;
    }

    /// The incarnation with which this node began.
    pub fn first_incarnation(&self) -> u64 {
        self.incarnation
    }

    /// Ignores poisoning: what is left halfway is mended by the next change.
    fn lock(&self) -> MutexGuard<'_, FleetState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
