//! One node's copy of the directory, and the node's part in it. A state machine: changes, answers and the time go in,
//! and [`Action`]s come out, so that it runs on a network and in a simulation alike.
//!
//! The rules are few. A node plays exactly the rooms whose entries name it. Entries change by compare-and-set alone, so
//! that of several nodes which want a room one gets it. A node renews its lease every [`RENEW_EVERY`]; its rooms
//! stand still [`HELD_FOR`] after a renewal was sent, and its entry is gone [`LEASE_TTL`] after the renewal was
//! written, so that no other node can begin before. The rooms of a node that is gone are claimed by the others.

mod lease;
mod placement;
mod rooms;
mod settle;
mod state;
mod terms;

pub use terms::*;

use super::entry::{Entry, Key, Owner, Revision, RoomCounts, RoomEntry, RoomFacts};
use state::{Held, Membership, Operation, Peer, Phase};
use std::collections::{BTreeMap, BTreeSet};

/// One node's copy of the directory, and its part in it.
#[derive(Debug)]
pub struct Directory {
    node: NodeSettings,
    membership: Membership,
    load: Load,
    nodes: BTreeMap<String, Peer>,
    entries: BTreeMap<String, (RoomEntry, Revision)>,
    held: BTreeMap<String, Held>,
    operations: BTreeMap<String, Operation>,
    /// Since when the owners of rooms are known to be gone.
    gone: BTreeMap<Owner, Time>,
    /// Rooms that are to be looked at again.
    unsettled: BTreeSet<String>,
    /// Entries that were asked for.
    looks: BTreeSet<Key>,
    has_synced: bool,
    draining: bool,
    actions: Vec<Action>,
}

impl Directory {
    /// A directory of which nothing is known yet.
    pub fn new(node: NodeSettings) -> Directory {
        Directory {
            membership: Membership::default(),
            node,
            load: Load::default(),
            nodes: BTreeMap::new(),
            entries: BTreeMap::new(),
            held: BTreeMap::new(),
            operations: BTreeMap::new(),
            gone: BTreeMap::new(),
            unsettled: BTreeSet::new(),
            looks: BTreeSet::new(),
            has_synced: false,
            draining: false,
            actions: Vec::new(),
        }
    }

    /// Takes the actions that are due.
    pub fn take_actions(&mut self) -> Vec<Action> {
        std::mem::take(&mut self.actions)
    }

    /// Takes a change of the directory, in the order of their revisions.
    pub fn changed(&mut self, change: Change, now: Time) {
        match change {
            Change::Written(Key::Node(name), Entry::Node(entry), revision) => {
                self.heard_of(name, entry, revision, now);
            }
            Change::Written(Key::Room(code), Entry::Room(entry), revision) => {
                // An answer may have told of it already, and of what came after it.
                if self.entries.get(&code).is_none_or(|(_, known)| *known < revision) {
                    self.entries.insert(code.clone(), (entry, revision));
                    self.settle(&code, now);
                }
            }
            Change::Gone(Key::Node(name)) => self.node_is_gone(&name, now),
            Change::Gone(Key::Room(code)) => {
                self.entries.remove(&code);
                self.settle(&code, now);
            }
            Change::Written(..) => {}
        }
    }

    /// All entries that there were when the node began to listen were passed to [`Directory::changed`]; those that it
    /// knew before and that are not among these codes and names are gone.
    pub fn synced(&mut self, present: &BTreeSet<Key>, now: Time) {
        let nodes = self.nodes.keys().cloned().map(Key::Node);
        let rooms = self.entries.keys().cloned().map(Key::Room);
        let gone: Vec<Key> = nodes.chain(rooms).filter(|key| !present.contains(key)).collect();
        for key in gone {
            self.changed(Change::Gone(key), now);
        }
        self.has_synced = true;
        self.settle_all(now);
    }

    /// Takes the answer to an [`Action::Write`] or [`Action::Remove`].
    pub fn answered(&mut self, key: Key, answer: Answer, now: Time) {
        match key {
            Key::Node(_) => self.lease_answered(answer, now),
            Key::Room(code) => self.room_answered(&code, answer, now),
        }
    }

    /// Asks for an entry, unless it was asked for already.
    pub fn look(&mut self, key: Key) {
        if self.looks.insert(key.clone()) {
            self.actions.push(Action::Look(key));
        }
    }

    /// Returns whether the entry of a room was asked for, and no answer has come yet.
    pub fn looks_for(&self, code: &str) -> bool {
        self.looks.contains(&Key::Room(code.to_owned()))
    }

    /// Takes the answer to an [`Action::Look`]: the entry, `None` if there is none. Without an answer,
    /// [`Directory::look_failed`] is to be called instead.
    pub fn looked(&mut self, key: Key, found: Option<(Entry, Revision)>, now: Time) {
        self.looks.remove(&key);
        match (key, found) {
            (Key::Node(name), found) if name == self.node.name => {
                let found = found.and_then(|(entry, revision)| match entry {
                    Entry::Node(entry) => Some((entry, revision)),
                    Entry::Room(_) => None,
                });
                self.lease_looked_up(found, now);
            }
            (key, Some((entry, revision))) => {
                self.changed(Change::Written(key, entry, revision), now);
            }
            (key, None) => self.changed(Change::Gone(key), now),
        }
    }

    /// Does what is due at this time: renews the lease, looks for silent nodes, claims rooms. To be called some ten
    /// times a second.
    pub fn poll(&mut self, now: Time) {
        self.poll_lease(now);
        if !self.has_synced {
            return;
        }
        self.look_for_silent_nodes(now);
        for code in std::mem::take(&mut self.unsettled) {
            self.settle(&code, now);
        }
    }

    /// Takes the measured load for the next renewal.
    pub fn measured(&mut self, load: Load) {
        self.load = load;
    }

    /// Hands all rooms over, and takes no other.
    pub fn drain(&mut self, now: Time) {
        self.draining = true;
        self.renew_at(now);
        self.settle_all(now);
    }

    /// The incarnation of this node that a room's entry names; `None` if it names another node.
    pub fn owned_under(&self, code: &str) -> Option<u64> {
        let (entry, _) = self.entries.get(code)?;
        (entry.owner.node == self.node.name).then_some(entry.owner.incarnation)
    }

    /// Returns whether this node holds a room in this epoch of it, or in a later one.
    pub fn holds_epoch(&self, code: &str, epoch: u64) -> bool {
        self.held.get(code).is_some_and(|held| held.epoch >= epoch)
    }

    /// The names of all entries of nodes.
    pub fn node_keys(&self) -> impl Iterator<Item = Key> {
        self.nodes.keys().cloned().map(Key::Node)
    }

    /// The names of all entries of rooms.
    pub fn room_keys(&self) -> impl Iterator<Item = Key> {
        self.entries.keys().cloned().map(Key::Room)
    }

    /// The nodes that are registered, this one among them.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// The rooms that this node plays, hands over or opens.
    pub fn holds(&self) -> usize {
        self.held.len()
    }

    /// The other nodes' addresses.
    pub fn urls(&self) -> impl Iterator<Item = &str> {
        let others = self.nodes.iter().filter(|(name, _)| **name != self.node.name);
        others.map(|(_, peer)| peer.entry.url.as_str())
    }

    /// The rooms of other nodes that they list, and their facts.
    pub fn listed_elsewhere(&self) -> impl Iterator<Item = (&RoomCounts, &RoomFacts)> {
        let others = self.nodes.iter().filter(|(name, _)| **name != self.node.name);
        let counts =
            others.flat_map(|(name, peer)| peer.entry.rooms.iter().map(move |c| (name, c)));
        counts.filter_map(|(name, counts)| {
            let (entry, _) = self.entries.get(&counts.code)?;
            (entry.owner.node == *name && !entry.room.private).then_some((counts, &entry.room))
        })
    }

    /// Returns whether there is a room of this code.
    pub fn has_room(&self, code: &str) -> bool {
        self.entries.contains_key(code)
    }

    /// The facts of all rooms.
    pub fn rooms(&self) -> impl Iterator<Item = (&str, &RoomEntry)> {
        self.entries.iter().map(|(code, (entry, _))| (code.as_str(), entry))
    }

    /// The place of a room.
    pub fn locate(&self, code: &str) -> Located {
        match (self.held.get(code), self.entries.get(code)) {
            (Some(Held { phase: Phase::Playing, .. }), _) => Located::Here,
            (Some(_), _) => Located::Soon,
            (None, _) if self.operations.contains_key(code) => Located::Soon,
            (None, Some((entry, _))) => match self.peer_of(&entry.owner) {
                Some(peer) if entry.owner.node != self.node.name => {
                    Located::At(peer.entry.url.clone())
                }
                _ => Located::Lost,
            },
            (None, None) => Located::Unknown,
        }
    }

    fn me(&self) -> Owner {
        Owner { node: self.node.name.clone(), incarnation: self.node.incarnation }
    }

    fn is_me(&self, owner: &Owner) -> bool {
        owner.node == self.node.name && owner.incarnation == self.node.incarnation
    }

    /// The entry of an owner that is not gone.
    fn peer_of(&self, owner: &Owner) -> Option<&Peer> {
        let peer = self.nodes.get(&owner.node)?;
        (peer.entry.incarnation == owner.incarnation).then_some(peer)
    }

    fn settle_all(&mut self, now: Time) {
        let owners: BTreeSet<&Owner> =
            self.entries.values().map(|(entry, _)| &entry.owner).collect();
        self.gone.retain(|owner, _| owners.contains(owner));
        let codes: BTreeSet<String> =
            self.entries.keys().chain(self.held.keys()).cloned().collect();
        for code in codes {
            self.settle(&code, now);
        }
    }
}
