//! The words of the directory: its times, what goes in and comes out, and what it asks of its driver.

use crate::fleet::entry::{Entry, Key, Revision, RoomCounts, RoomEntry};
use std::collections::BTreeMap;
use std::time::Duration;

/// Time between two renewals of a lease.
pub const RENEW_EVERY: Duration = Duration::from_secs(2);
/// Time after which an entry that was not renewed is gone. Losing the leader of a cluster of three took up to seven
/// seconds.
pub const LEASE_TTL: Duration = Duration::from_secs(20);
/// Time after the last renewal that was answered was sent, after which a node's rooms stand still. The difference to
/// [`LEASE_TTL`] is for clocks that run unequally and for a tick that has begun.
pub const HELD_FOR: Duration = Duration::from_secs(15);
/// Time between the attempts of two nodes to claim a room, the nearer one first.
pub const CLAIM_STEP: Duration = Duration::from_millis(500);
/// Rooms of a draining node for each that is handed over at a time.
pub const ROOMS_PER_PARTING: usize = 16;
/// Wait before something that failed is tried again.
pub const RETRY: Duration = Duration::from_millis(500);
/// Nodes that look at first for one that is silent; they tell the others. Twice as many look after each [`RETRY`].
pub const LOOKERS: usize = 3;
/// Processor seconds a second that a room is taken to cost before its node has measured it.
pub const ROOM_COST: f64 = 0.03;

/// Time since the node started.
pub type Time = Duration;

/// Something for the driver to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Writes an entry if its revision is still this one; [`answered`](super::Directory::answered) takes the answer.
    Write(Key, Entry, Revision),
    /// Removes an entry likewise. With revision 0 there is none any more, and watchers are told so.
    Remove(Key, Revision),
    /// Reads an entry; [`looked`](super::Directory::looked) takes it, [`look_failed`](super::Directory::look_failed) that there is no answer.
    Look(Key),
    /// Opens a room from its records, or as a new one where there are none; then [`RoomEvent::Opened`].
    Open(String, RoomEntry),
    /// Has a room end with a last record of its whole state; then [`RoomEvent::Parted`].
    Part(String),
    /// Ends a room that another node plays; its players are told the address, if it is known.
    Stop(String, Option<String>),
    /// Goes on with a room under another incarnation of this node.
    Resume(String),
    /// The lease of this incarnation lasts until then.
    Lease(u64, Time),
}

/// News of a room that this node holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomEvent {
    /// The driver has opened it.
    Opened,
    /// It could not be opened here.
    OpenFailed,
    /// It is over, and its records are gone.
    Ended,
    /// It has ended here, and its last record is written.
    Parted,
    /// A write of its records was refused: another node has begun to play it, or this one has by a process that is
    /// gone.
    Fenced,
}

/// The answer to a conditional write or removal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Done; the entry's new revision.
    Done(Revision),
    /// The entry has another revision.
    Refused,
    /// No answer came: it may be done or not.
    Unknown,
}

/// A change of the directory.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// An entry was written.
    Written(Key, Entry, Revision),
    /// An entry was removed, by a write of this revision.
    Gone(Key, Revision),
}

/// The place of a room.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Located {
    /// This node plays it.
    Here,
    /// This node is about to open it, or to know who does.
    Soon,
    /// The node at this address plays it.
    At(String),
    /// Its node is gone or silent; another one will claim it.
    Lost,
    /// There is no such room.
    Unknown,
}

/// The reason why a room cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceError {
    /// No node has ticks left for another room.
    Full,
    /// There is such a room.
    Taken,
    /// This node has not heard of the others yet, or its lease is over.
    NotNow,
}

/// The measured load of this node, for its entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Load {
    /// Processor seconds a second that the rooms took.
    pub used: f64,
    /// Rooms that may still be opened.
    pub rooms_left: usize,
    /// Public rooms.
    pub rooms: Vec<RoomCounts>,
}

/// The settings of a node.
#[derive(Clone, Debug, Default)]
pub struct NodeSettings {
    /// Its name, which no other node of the fleet may have.
    pub name: String,
    /// Where players reach it.
    pub url: String,
    /// Processor seconds a second for its rooms.
    pub capacity: f64,
    /// A random number; the first incarnation.
    pub incarnation: u64,
    /// [`super::super::settings::FleetSettings::secret_mark`].
    pub secret_mark: u32,
}

/// What the directory asks of its driver, in the order in which it was decided: actions that this has not taken yet, and lookups that are not answered yet.
#[derive(Debug, Default)]
pub struct Requests {
    pub actions: Vec<Action>,
    lookups: BTreeMap<Key, Lookup>,
}

/// A lookup of an entry that is under way.
#[derive(Clone, Copy, Debug)]
pub struct Lookup {
    /// The entry's revision as it was known when the lookup was sent.
    pub known: Option<Revision>,
    /// Revision of the newest removal that was heard of since.
    pub removed_by: Revision,
}

impl Requests {
    /// Looks an entry up of which this revision is known; returns false if a lookup is under way already.
    pub fn look_up(&mut self, key: Key, known: Option<Revision>) -> bool {
        let is_new = !self.is_looking_up(&key);
        if is_new {
            self.lookups.insert(key.clone(), Lookup { known, removed_by: 0 });
            self.actions.push(Action::Look(key));
        }
        is_new
    }

    pub fn is_looking_up(&self, key: &Key) -> bool {
        self.lookups.contains_key(key)
    }

    /// An entry was removed: a lookup that is under way may still find what was there before.
    pub fn removed_by(&mut self, key: &Key, revision: Revision) {
        if let Some(lookup) = self.lookups.get_mut(key) {
            lookup.removed_by = revision;
        }
    }

    /// Ends a lookup.
    pub fn looked_up(&mut self, key: &Key) -> Option<Lookup> {
        self.lookups.remove(key)
    }

    /// Drops all requests to the store, which a lost connection leaves without an answer.
    pub fn cancel(&mut self) {
        let is_exchange = |action: &Action| {
            matches!(action, Action::Write(..) | Action::Remove(..) | Action::Look(_))
        };
        self.actions.retain(|action| !is_exchange(action));
        self.lookups.clear();
    }
}
