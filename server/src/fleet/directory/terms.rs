//! The directory's vocabulary: its time constants, its inputs and outputs, and what it asks of its driver.

use crate::fleet::entry::{Entry, Key, Revision, RoomCounts, RoomEntry};
use std::collections::BTreeMap;
use std::time::Duration;

/// Interval between lease renewals.
pub const RENEW_EVERY: Duration = Duration::from_secs(2);
/// Time after which an entry that was not renewed expires. In a cluster of three, replacing a lost leader took up to
/// seven seconds.
pub const LEASE_TTL: Duration = Duration::from_secs(20);
/// How long after sending the last answered renewal a node's rooms pause. The margin below [`LEASE_TTL`] allows for
/// clocks that run at different speeds and for a tick that has already started.
pub const HELD_FOR: Duration = Duration::from_secs(15);
/// Delay between successive nodes' attempts to claim a room; the nearest node goes first.
pub const CLAIM_STEP: Duration = Duration::from_millis(500);
/// A draining node hands over up to one in this many of its rooms at once, and at least one.
pub const ROOMS_PER_PARTING: usize = 16;
/// Delay before a failed operation is retried.
pub const RETRY: Duration = Duration::from_millis(500);
/// Number of nodes that are the first to look up a silent node. It doubles after each [`RETRY`].
pub const LOOKERS: usize = 3;
/// Processor time that a room is assumed to need until its node has measured it, in seconds per second.
pub const ROOM_COST: f64 = 0.03;

/// Time since the node's start.
pub type Time = Duration;

/// An action for the driver.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Writes an entry if it still has this revision; the answer goes to [`answered`](super::Directory::answered).
    Write(Key, Entry, Revision),
    /// Removes an entry in the same way. Revision 0 means that the entry has expired and that watchers should be
    /// notified.
    Remove(Key, Revision),
    /// Reads an entry. The result goes to [`looked`](super::Directory::looked), a failure to
    /// [`look_failed`](super::Directory::look_failed).
    Look(Key),
    /// Opens a room from its records, or as a new room if it has none. [`RoomEvent::Opened`] follows.
    Open(String, RoomEntry),
    /// Ends a room with a final record of its whole state. [`RoomEvent::Parted`] follows.
    Part(String),
    /// Ends a room that another node plays; players are given that node's address, if known.
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
    /// The room is over and its records have been removed.
    Ended,
    /// The room has ended on this node and its final record has been written.
    Parted,
    /// A write of the room's records was refused because another node, or an earlier process of this node, has begun to
    /// play the room.
    Fenced,
}

/// The answer to a conditional write or removal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The operation succeeded; holds the entry's new revision.
    Done(Revision),
    /// The entry has a different revision.
    Refused,
    /// No answer came, so the outcome is unknown.
    Unknown,
}

/// A change to the directory.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// An entry was written.
    Written(Key, Entry, Revision),
    /// An entry was removed by a write with this revision.
    Gone(Key, Revision),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Located {
    /// This node plays the room.
    Here,
    /// This node will soon open the room, or find out who plays it.
    Soon,
    /// The node at this address plays the room.
    At(String),
    /// The room's node is gone or silent; another node will claim the room.
    Lost,
    /// The room does not exist.
    Unknown,
}

/// The reason why a room could not be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceError {
    /// No node has capacity for another room.
    Full,
    /// A room with this code exists.
    Taken,
    /// This node does not know the other nodes yet, or its lease has expired.
    NotNow,
}

/// The measured load of this node, for the node's entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Load {
    /// Processor time that the rooms use, in seconds per second.
    pub used: f64,
    /// Number of rooms that can still be opened.
    pub rooms_left: usize,
    pub rooms: Vec<RoomCounts>,
}

#[derive(Clone, Debug, Default)]
pub struct NodeSettings {
    /// The node's name, unique in the fleet.
    pub name: String,
    /// Address at which players reach the node.
    pub url: String,
    /// Processor time available to the node's rooms, in seconds per second.
    pub capacity: f64,
    /// The node's first incarnation, a random number.
    pub incarnation: u64,
    /// A mark derived from the fleet's secret. See [`super::super::settings::FleetSettings::secret_mark`].
    pub secret_mark: u32,
}

/// What the directory asks of its driver, in order of decision: actions that the driver has not taken yet, and lookups
/// that have not been answered yet.
#[derive(Debug, Default)]
pub struct Requests {
    pub actions: Vec<Action>,
    lookups: BTreeMap<Key, Lookup>,
}

/// A lookup of an entry in progress.
#[derive(Clone, Copy, Debug)]
pub struct Lookup {
    /// The entry's known revision when the lookup was sent.
    pub known: Option<Revision>,
    /// The revision of the newest removal reported since then.
    pub removed_by: Revision,
}

impl Requests {
    /// Looks up an entry whose known revision is this. Returns false if a lookup is already in progress.
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

    /// Called when an entry has been removed, since a lookup in progress may still find the old entry.
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
