//! Where rooms go: to the node with the most ticks left.

use super::state::{Operation, Peer};
use super::{Action, Directory, PlaceError, ROOM_COST, Time};
use crate::fleet::entry::{Entry, Key, Owner, RoomEntry, RoomFacts};
use std::hash::{DefaultHasher, Hash, Hasher};

impl Directory {
    /// Places a room that there is not yet. [`Directory::locate`] tells where, once it is placed.
    pub fn place(&mut self, code: &str, room: RoomFacts, now: Time) -> Result<(), PlaceError> {
        // A standing room has the code of the one before it, which another node may play.
        if room.creator.is_none() && now < self.connection.doubtful_until {
            return Err(PlaceError::NotNow);
        }
        self.place_at(code, room, |_| true)
    }

    /// Places such a room at this node.
    pub fn place_here(&mut self, code: &str, room: RoomFacts) -> Result<(), PlaceError> {
        let own = self.node.name.clone();
        self.place_at(code, room, |name| name == own)
    }

    fn place_at(
        &mut self,
        code: &str,
        room: RoomFacts,
        allowed: impl Fn(&str) -> bool,
    ) -> Result<(), PlaceError> {
        let is_held = self.held.contains_key(code);
        if is_held || self.entries.contains_key(code) || self.operations.contains_key(code) {
            return Err(PlaceError::Taken);
        }
        if !self.has_synced() || !self.is_registered() {
            return Err(PlaceError::NotNow);
        }
        let owner = self.roomiest(allowed).ok_or(PlaceError::Full)?;
        if let Some(peer) = self.nodes.get_mut(&owner.node) {
            peer.placed += 1;
        }
        let entry = RoomEntry { owner, epoch: 1, room };
        self.operations.insert(code.to_owned(), Operation::Change { to: entry.clone() });
        self.actions.push(Action::Write(Key::Room(code.to_owned()), Entry::Room(entry), 0));
        Ok(())
    }

    /// The node with the most ticks left, if any has enough for a room.
    pub(super) fn roomiest(&self, allowed: impl Fn(&str) -> bool) -> Option<Owner> {
        let fitting = self.nodes.iter().filter(|(name, peer)| allowed(name) && has_room(peer));
        // Of equals this one: its players need not go elsewhere.
        let best = fitting.max_by(|(a, left), (b, right)| {
            let own = |name: &String| *name == self.node.name;
            free(left).total_cmp(&free(right)).then(own(a).cmp(&own(b)))
        });
        best.map(|(name, peer)| owner(name, peer))
    }

    /// Returns whether this node is among the nearest with room, which may claim a room whose node is gone; all agree
    /// on that as long as they know of each other.
    pub(super) fn may_claim(&self, code: &str, count: usize) -> bool {
        self.nodes.get(&self.node.name).is_some_and(has_room)
            && self.is_nearest_of(code, count, has_room)
    }

    /// Returns whether this node is among this many that are nearest to another node.
    pub(super) fn is_among_nearest(&self, node: &str, count: usize) -> bool {
        self.is_nearest_of(node, count, |_| true)
    }

    fn is_nearest_of(&self, to: &str, count: usize, counts: impl Fn(&Peer) -> bool) -> bool {
        let own = distance(to, &self.node.name);
        let is_nearer = |(name, peer): &(&String, &Peer)| {
            **name != self.node.name && *name != to && distance(to, name) < own && counts(peer)
        };
        // As a rule there is one among the first few.
        self.nodes.iter().filter(is_nearer).nth(count - 1).is_none()
    }
}

fn owner(name: &str, peer: &Peer) -> Owner {
    Owner { node: name.to_owned(), incarnation: peer.entry.incarnation }
}

/// Processor seconds a second that a node has left.
fn free(peer: &Peer) -> f64 {
    peer.entry.capacity - peer.entry.used - peer.placed as f64 * ROOM_COST
}

fn has_room(peer: &Peer) -> bool {
    !peer.entry.draining && peer.entry.rooms_left > peer.placed && free(peer) >= ROOM_COST
}

/// Spreads the rooms of a node evenly over the others. If two versions hash differently they only disagree on who
/// tries first.
fn distance(code: &str, node: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    (code, node).hash(&mut hasher);
    hasher.finish()
}
