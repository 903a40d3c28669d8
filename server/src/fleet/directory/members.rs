//! The live nodes and their load, and the room owners that are gone. An owner whose entry was seen and then
//! disappeared, or was looked up and not found, is gone permanently, since no node uses an incarnation twice.

use super::membership::Membership;
use super::terms::{Answer, LEASE_TTL, LOOKERS, RETRY, ROOM_COST, Requests, Time};
use crate::fleet::entry::{Key, NodeEntry, Owner, Revision};
use jostle_protocol::is_origin;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use tracing::info;

/// The nodes of the fleet.
#[derive(Debug, Default)]
pub struct Members {
    pub own: Membership,
    nodes: BTreeMap<String, Peer>,
    /// Room owners that are not among the nodes.
    missing: BTreeMap<Owner, Missing>,
    pub synced: bool,
}

/// A node, possibly this one, as described by its entry.
#[derive(Debug)]
struct Peer {
    /// The node's newest entry.
    entry: NodeEntry,
    /// The revision of the newest entry.
    revision: Revision,
    /// Time when the newest entry arrived.
    heard_at: Time,
    /// Time when the node was last looked up because it had been silent.
    looked_at: Time,
    /// Rooms that this node has placed on the node since its last report.
    placed: usize,
}

/// A room owner that is not among the nodes.
#[derive(Clone, Copy, Debug)]
enum Missing {
    /// The owner's entry may not have arrived yet, since nodes and rooms are reported in no common order; it must be
    /// looked up.
    Doubtful {
        /// Whether a lookup is in progress.
        asked: bool,
        /// Time of the next lookup.
        next_at: Time,
    },
    /// The owner has been known to be gone since this time.
    Gone(Time),
}

impl Members {
    /// Called when a connection has been made; its watchers will list all entries.
    pub fn connected(&mut self, may_have_forgotten: bool, now: Time) {
        self.missing.clear();
        self.synced = false;
        if may_have_forgotten {
            self.nodes.values_mut().for_each(|peer| peer.revision = 0);
        }
        self.own.connected(may_have_forgotten, now);
    }

    /// Called when the watchers have listed all nodes. Room owners that are not listed are looked up before their rooms
    /// are claimed.
    pub fn synced(&mut self, present: &BTreeSet<Key>) {
        self.nodes.retain(|name, _| present.contains(&Key::Node(name.clone())));
        self.synced = true;
    }

    /// Number of registered nodes, including this one.
    pub fn count(&self) -> usize {
        self.nodes.len()
    }

    /// The entries of the other nodes, by name.
    pub fn others(&self) -> impl Iterator<Item = (&String, &NodeEntry)> {
        let others = self.nodes.iter().filter(|(name, _)| **name != self.own.node.name);
        others.map(|(name, peer)| (name, &peer.entry))
    }

    /// The entry of an owner, unless the owner is gone.
    pub fn entry_of(&self, owner: &Owner) -> Option<&NodeEntry> {
        let entry = &self.nodes.get(&owner.node)?.entry;
        (entry.incarnation == owner.incarnation).then_some(entry)
    }

    pub fn revision(&self, name: &str) -> Option<Revision> {
        self.nodes.get(name).map(|peer| peer.revision)
    }

    /// Handles the answer to a write or removal of this node's entry. Returns the owner that this replaces.
    pub fn answered(&mut self, answer: Answer, out: &mut Requests, now: Time) -> Option<Owner> {
        let revision = self.own.answered(answer, out, now)?;
        match self.entry_of(&self.own.owner()) {
            Some(_) => None,
            None => self.heard_of(self.own.node.name.clone(), self.own.entry(), revision, now),
        }
    }

    /// Handles this node's entry as found in the store. Returns an owner that this shows to be gone.
    pub fn own_looked_up(
        &mut self,
        found: Option<(NodeEntry, Revision)>,
        out: &mut Requests,
        now: Time,
    ) -> Option<Owner> {
        if !self.own.looked_up(found.as_ref(), out, now) {
            return None;
        }
        let name = self.own.node.name.clone();
        match found {
            Some((entry, revision)) => self.heard_of(name, entry, revision, now),
            None => self.remove(&name),
        }
    }

    /// Handles a node's entry. Returns the owner that it replaces.
    pub fn heard_of(
        &mut self,
        name: String,
        entry: NodeEntry,
        revision: Revision,
        now: Time,
    ) -> Option<Owner> {
        let is_old = self.revision(&name).is_some_and(|known| known >= revision);
        // Clients must not be sent an invalid address.
        if is_old || !is_origin(&entry.url) {
            return None;
        }
        let incarnation = entry.incarnation;
        let peer = Peer { entry, revision, heard_at: now, looked_at: now, placed: 0 };
        let before = self.nodes.insert(name.clone(), peer)?.entry.incarnation;
        (before != incarnation).then_some(Owner { node: name, incarnation: before })
    }

    /// Called when a node's entry has left the directory. Returns the owner that is gone.
    pub fn remove(&mut self, name: &str) -> Option<Owner> {
        let Peer { entry, .. } = self.nodes.remove(name)?;
        if name != self.own.node.name {
            info!(node = %name, url = %entry.url, "a node is gone");
        }
        Some(Owner { node: name.to_owned(), incarnation: entry.incarnation })
    }

    /// Marks a room owner as gone.
    pub fn is_gone(&mut self, owner: Owner, now: Time) {
        self.missing.insert(owner, Missing::Gone(now));
    }

    /// Called when an owner has no rooms left, so that it no longer needs to be looked for.
    pub fn has_no_rooms(&mut self, owner: &Owner) {
        self.missing.remove(owner);
    }

    /// The time since when this owner has been known to be gone. While that is in doubt, the owner is looked up.
    pub fn gone_since(&mut self, owner: &Owner, out: &mut Requests, now: Time) -> Option<Time> {
        let known = self.revision(&owner.node);
        let first = Missing::Doubtful { asked: false, next_at: now };
        let missing = self.missing.entry(owner.clone()).or_insert(first);
        match *missing {
            Missing::Gone(since) => return Some(since),
            Missing::Doubtful { asked: false, next_at } if now >= next_at => {
                // A lookup that is already in progress may have been answered before the owner registered.
                if out.look_up(Key::Node(owner.node.clone()), known) {
                    *missing = Missing::Doubtful { asked: true, next_at: now };
                }
            }
            Missing::Doubtful { .. } => {}
        }
        None
    }

    /// Handles a lookup that found this incarnation of a node, or none. Returns the owners that this shows to be gone.
    pub fn decide_doubts(&mut self, name: &str, found: Option<u64>, now: Time) -> Vec<Owner> {
        let mut gone = Vec::new();
        for (owner, missing) in self.looked_for(name) {
            if Some(owner.incarnation) == found {
                *missing = Missing::Doubtful { asked: false, next_at: now + RETRY };
            } else {
                gone.push(owner.clone());
            }
        }
        gone
    }

    /// Called when a lookup of a node goes unanswered.
    pub fn look_failed(&mut self, name: &str, now: Time) {
        if self.own.looks_for(name) {
            self.own.look_failed(now);
        }
        for (_, missing) in self.looked_for(name) {
            *missing = Missing::Doubtful { asked: false, next_at: now + RETRY };
        }
    }

    /// The owners with this name that are waiting for a lookup in progress.
    fn looked_for(&mut self, name: &str) -> impl Iterator<Item = (&Owner, &mut Missing)> {
        let all = self.missing.range_mut(Owner { node: name.to_owned(), incarnation: 0 }..);
        let all = all.take_while(move |(owner, _)| owner.node == name);
        all.filter(|(_, missing)| matches!(missing, Missing::Doubtful { asked: true, .. }))
    }

    /// Watchers do not report expired entries, so silent nodes are looked up, first by the nodes nearest to them.
    pub fn look_for_silent(&mut self, out: &mut Requests, now: Time) {
        let is_due = |silent: Time, looked_at: Time| silent > LEASE_TTL && now >= looked_at + RETRY;
        let silent = self.nodes.iter().filter_map(|(name, peer)| {
            let silent = now.saturating_sub(peer.heard_at);
            (*name != self.own.node.name && is_due(silent, peer.looked_at))
                .then_some((name, silent))
        });
        let near = silent.filter(|(name, silent)| {
            let doublings = (*silent - LEASE_TTL).as_millis() / RETRY.as_millis();
            self.is_nearest_of(name, LOOKERS << doublings.min(20), |_| true)
        });
        let names: Vec<String> = near.map(|(name, _)| name.clone()).collect();
        for name in names {
            let peer = self.nodes.get_mut(&name).expect("just seen");
            peer.looked_at = now;
            out.look_up(Key::Node(name), Some(peer.revision));
        }
    }

    /// The node with the most spare processor time, if any has enough for a room.
    pub fn roomiest(&self, allowed: impl Fn(&str) -> bool) -> Option<Owner> {
        let fitting = self.nodes.iter().filter(|(name, peer)| allowed(name) && has_room(peer));
        // This node wins ties, since its players then need not move.
        let best = fitting.max_by(|(a, left), (b, right)| {
            let own = |name: &String| *name == self.own.node.name;
            free(left).total_cmp(&free(right)).then(own(a).cmp(&own(b)))
        });
        best.map(|(name, peer)| Owner { node: name.clone(), incarnation: peer.entry.incarnation })
    }

    /// Like [`Members::roomiest`], among the other nodes.
    pub fn roomiest_other(&self) -> Option<Owner> {
        self.roomiest(|name| name != self.own.node.name)
    }

    /// Counts a room as placed on a node until that node reports it.
    pub fn reserve(&mut self, owner: &Owner) {
        if let Some(peer) = self.nodes.get_mut(&owner.node) {
            peer.placed += 1;
        }
    }

    /// Returns whether this node is among the nearest ones with capacity, which may claim a room whose node is gone.
    /// Nodes that know of the same nodes agree on this.
    pub fn may_claim(&self, code: &str, count: usize) -> bool {
        self.nodes.get(&self.own.node.name).is_some_and(has_room)
            && self.is_nearest_of(code, count, has_room)
    }

    /// Returns whether this node is among the `count` nodes nearest to another node or to a room.
    fn is_nearest_of(&self, to: &str, count: usize, counts: impl Fn(&Peer) -> bool) -> bool {
        let own_name = &self.own.node.name;
        let own = distance(to, own_name);
        let is_nearer = |(name, peer): &(&String, &Peer)| {
            *name != own_name && *name != to && distance(to, name) < own && counts(peer)
        };
        // Usually one of the first few is nearer, so the search ends early.
        self.nodes.iter().filter(is_nearer).nth(count - 1).is_none()
    }
}

/// A node's spare processor time, in seconds per second.
fn free(peer: &Peer) -> f64 {
    peer.entry.capacity - peer.entry.used - peer.placed as f64 * ROOM_COST
}

fn has_room(peer: &Peer) -> bool {
    !peer.entry.draining && peer.entry.rooms_left > peer.placed && free(peer) >= ROOM_COST
}

/// Spreads a node's rooms evenly over the others. If two versions hash differently, they merely disagree about who
/// tries first.
fn distance(code: &str, node: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    (code, node).hash(&mut hasher);
    hasher.finish()
}
