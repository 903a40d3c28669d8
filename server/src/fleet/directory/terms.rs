//! The words of the directory: its times, what goes in and comes out, and what it asks of its driver.

use crate::fleet::entry::{Entry, Key, Revision, RoomCounts, RoomEntry};
use std::collections::BTreeMap;
use std::time::Duration;

/// Time between two renewals of a lease.
pub const RENEW_EVERY: Duration = Duration::from_secs(2);
/// Time after which an entry that was not renewed is gone. Losing the leader of a cluster of three took up to seven
/// seconds.
pub const LEASE_TTL: Duration = Duration::from_secs(20);
/// Time since the last answered renewal was sent after which a node's rooms pause. The difference to [`LEASE_TTL`]
/// allows for clocks that run at different speeds, and for a tick that has already started.
pub const HELD_FOR: Duration = Duration::from_secs(15);
/// Time between the attempts of two nodes to claim a room, the nearer one first.
pub const CLAIM_STEP: Duration = Duration::from_millis(500);
/// A draining node hands over one of this many rooms at a time.
pub const ROOMS_PER_PARTING: usize = 16;
/// Wait before a failed operation is tried again.
pub const RETRY: Duration = Duration::from_millis(500);
/// Number of nodes that look up a silent node first, and inform the others. It doubles after each [`RETRY`].
pub const LOOKERS: usize = 3;
/// Processor time that a room is assumed to take until its node has measured it, in seconds per second.
pub const ROOM_COST: f64 = 0.03;

/// Time since the node started.
pub type Time = Duration;

/// An action for the driver.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Writes an entry if it still has this revision; the answer goes to [`answered`](super::Directory::answered).
    Write(Key, Entry, Revision),
    /// Removes an entry in the same way. Revision 0 means that the entry has expired, and that watchers should be
    /// notified.
    Remove(Key, Revision),
    /// Reads an entry. The result goes to [`looked`](super::Directory::looked), a failure to
    /// [`look_failed`](super::Directory::look_failed).
    Look(Key),
    /// Opens a room from its records, or as a new room without any. [`RoomEvent::Opened`] follows.
    Open(String, RoomEntry),
    /// Ends a room with a last record of its whole state. [`RoomEvent::Parted`] follows.
    Part(String),
    /// Ends a room that another node plays; players get that node's address, if known.
    Stop(String, Option<String>),
    /// Continues a room under another incarnation of this node.
    Resume(String),
    /// The lease of this incarnation is valid until this time.
    Lease(u64, Time),
}

/// An event of a room that this node holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomEvent {
    /// The driver has opened the room.
    Opened,
    /// The room could not be opened on this node.
    OpenFailed,
    /// The room is over, and its records have been removed.
    Ended,
    /// The room has ended on this node, and its last record is written.
    Parted,
    /// A write of the room's records was refused. Another node has begun to play it, or an earlier process of this node
    /// did.
    Fenced,
}

/// The answer to a conditional write or removal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The operation was done; holds the entry's new revision.
    Done(Revision),
    /// The entry has another revision.
    Refused,
    /// No answer came, so that the outcome is unknown.
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

/// The location of a room.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Located {
    /// This node plays it.
    Here,
    /// This node will soon open the room, or know who does.
    Soon,
    /// The node at this address plays it.
    At(String),
    /// The room's node is gone or silent; another will claim it.
    Lost,
    /// The room does not exist.
    Unknown,
}

/// The reason why a room cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceError {
    /// No node has capacity for another room.
    Full,
    /// A room with this code exists.
    Taken,
    /// This node does not know the others yet, or its lease has expired.
    NotNow,
}

/// The measured load of this node, for its entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Load {
    /// Processor time that the rooms took, in seconds per second.
    pub used: f64,
    /// Number of rooms that may still be opened.
    pub rooms_left: usize,
    /// The public rooms.
    pub rooms: Vec<RoomCounts>,
}

/// The settings of a node.
#[derive(Clone, Debug, Default)]
pub struct NodeSettings {
    /// The node's name, unique in the fleet.
    pub name: String,
    /// Address at which players reach the node.
    pub url: String,
    /// Processor time for the node's rooms, in seconds per second.
    pub capacity: f64,
    /// The first incarnation, a random number.
    pub incarnation: u64,
    /// The mark of the fleet's secret. See [`super::super::settings::FleetSettings::secret_mark`].
    pub secret_mark: u32,
}

/// What the directory asks of its driver, in the order in which it was decided: actions that this has not taken yet, and lookups that are not answered yet.
#[derive(Debug, Default)]
pub struct Requests {
    pub actions: Vec<Action>,
    lookups: BTreeMap<Key, Lookup>,
}

/// A lookup of an entry that is in progress.
#[derive(Clone, Copy, Debug)]
pub struct Lookup {
    /// The entry's known revision when the lookup was sent.
    pub known: Option<Revision>,
    /// Revision of the newest removal reported since.
    pub removed_by: Revision,
}

impl Requests {
    /// Looks up an entry of which this revision is known. Returns false if a lookup is already in progress.
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

    /// Called when an entry was removed: a lookup in progress may still find the old entry.
    pub fn removed_by(&mut self, key: &Key, revision: Revision) {
        if let Some(lookup) = self.lookups.get_mut(key) {
            lookup.removed_by = revision;
        }
    }

    /// Ends a lookup.
    pub fn looked_up(&mut self, key: &Key) -> Option<Lookup> {
        self.lookups.remove(key)
    }

    /// Drops all requests to the store that a lost connection leaves unanswered.
    pub fn cancel(&mut self) {
        let is_exchange = |action: &Action| {
            matches!(action, Action::Write(..) | Action::Remove(..) | Action::Look(_))
        };
        self.actions.retain(|action| !is_exchange(action));
        self.lookups.clear();
    }
}
