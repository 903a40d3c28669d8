//! What a node keeps of itself, of the others and of the rooms that it holds.

use super::terms::Time;
use crate::fleet::entry::{NodeEntry, Revision, RoomEntry, RoomFacts};
use std::collections::BTreeSet;
use std::time::Duration;

/// This node's membership of the fleet.
#[derive(Debug)]
pub struct Membership {
    /// Revision of its entry; `None` while it has none.
    pub revision: Option<Revision>,
    /// While it has none, revision of the entry that it may write over: none, or that of an incarnation before.
    pub replaces: Revision,
    /// Whether a write of the present incarnation was not answered.
    pub may_be_written: bool,
    /// Incarnations that this process had before.
    pub lost: u64,
    /// Whether the revision may be another by now.
    pub unsure: bool,
    /// When the write or look that is on its way was sent.
    pub asked_at: Option<Time>,
    /// Whether that is a look.
    pub is_looking: bool,
    /// When the next one is due.
    pub next_at: Time,
    /// When the lease ends.
    pub held_until: Time,
    /// Whether it was logged that the name is taken.
    pub said_taken: bool,
    /// Whether it leaves for good.
    pub has_left: bool,
}

impl Default for Membership {
    fn default() -> Membership {
        Membership {
            revision: None,
            replaces: 0,
            may_be_written: false,
            lost: 0,
            unsure: false,
            asked_at: None,
            is_looking: false,
            next_at: Duration::ZERO,
            held_until: Duration::ZERO,
            said_taken: false,
            has_left: false,
        }
    }
}

/// The present connection to the store.
#[derive(Debug, Default)]
pub struct Connection {
    /// Number of the connection, from 1; 0 before the first.
    pub number: u64,
    /// Time from which rooms of other nodes may be claimed.
    pub claims_from: Time,
    /// Until then, the store may have forgotten who plays a room that is played.
    pub doubtful_until: Time,
    /// The newest revision of a room's entry when the rooms were first known in a store that may have forgotten.
    /// Until that, the greatest there is.
    pub known_revision: Revision,
    /// Whether the present incarnation of this node was registered since.
    pub has_registered: bool,
    /// Rooms that there were before, and of which the store knows nothing.
    pub missed: BTreeSet<String>,
}

/// A node, this one among them, as its entry says.
#[derive(Clone, Debug)]
pub struct Peer {
    /// Its newest entry.
    pub entry: NodeEntry,
    /// The revision of that.
    pub revision: Revision,
    /// When that was heard of.
    pub heard_at: Time,
    /// When it was last asked for, after it had been silent.
    pub looked_at: Time,
    /// Rooms that this node has placed there since its last report.
    pub placed: usize,
}

/// A look that is on its way.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// The entry's revision as it was known when the look was sent.
    pub known: Option<Revision>,
    /// Revision of the newest removal that was heard of since.
    pub removed_by: Revision,
}

/// An owner of rooms that is not among the nodes.
#[derive(Clone, Copy, Debug)]
pub enum Missing {
    /// Its entry may not have been heard of yet, since nodes and rooms have no order in common: it has to be looked
    /// for.
    Doubtful {
        /// Whether a look for it is on its way.
        asked: bool,
        /// When the next one is due.
        next_at: Time,
    },
    /// It is gone for good, which is known since then.
    Gone(Time),
}

/// A room whose entry names this node.
#[derive(Clone, Debug)]
pub struct Held {
    /// Epoch of its entry.
    pub epoch: u64,
    /// How far it is.
    pub phase: Phase,
    /// What its entry says of the room.
    pub room: RoomFacts,
    /// The incarnation of this node under which it is held.
    pub incarnation: u64,
    /// Whether the store may have forgotten that this node holds it.
    pub doubt: Doubt,
}

/// A doubt whether a held room is still this node's, after the store may have forgotten writes. It ends with an entry
/// that names this node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    None,
    /// The lease lasted when the store was back: no other node has claimed the room, so its entry is written again.
    Kept,
    /// The lease was over: another node may play the room, and the store may have forgotten that.
    Lapsed,
}

/// The phase of a held room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The driver reads its records and starts its thread.
    Opening,
    /// It could not be opened; another node is to try after this time.
    Failed(Time),
    /// It is played, or stands still without a lease.
    Playing,
    /// It is about to end here, with a last record of its state.
    Parting,
    /// Its last record is written; its entry is to name another node.
    Parted,
    /// It is over; its entry is to be removed.
    Over,
}

/// A write of a room's entry that is on its way.
#[derive(Clone, Debug)]
pub enum Operation {
    /// A new entry, or one that names another owner: a claim, or a room that is handed over.
    Change { to: RoomEntry },
    /// The room is over.
    Remove {
        /// The revision of its entry.
        revision: Revision,
    },
    /// None, until this time: one before failed.
    Pause {
        /// When the next attempt is due.
        until: Time,
    },
}
