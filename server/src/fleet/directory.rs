//! One node's copy of the directory, and the node's part in it. A state machine: changes, answers and the time go in,
//! and [`Action`]s come out, so that it runs on a network and in a simulation alike.
//!
//! The rules are few. A node plays exactly the rooms whose entries name it. Entries change by compare-and-set alone, so
//! that of several nodes which want a room one gets it. A node renews its lease every [`RENEW_EVERY`]; its rooms
//! stand still [`HELD_FOR`] after a renewal was sent, and its entry is gone [`LEASE_TTL`] after the renewal was
//! written, so that no other node can begin before. The rooms of a node that is gone are claimed by the others.

mod connection;
mod lease;
mod missing;
mod placement;
mod rooms;
mod settle;
mod state;
mod terms;
#[cfg(test)]
mod tests;

pub use terms::*;

use super::entry::{Entry, Key, Owner, Revision, RoomCounts, RoomEntry, RoomFacts};
use state::{Connection, Held, Look, Membership, Missing, Operation, Peer, Phase};
use std::collections::{BTreeMap, BTreeSet};

/// One node's copy of the directory, and its part in it.
#[derive(Debug)]
pub struct Directory {
    node: NodeSettings,
    membership: Membership,
    connection: Connection,
    load: Load,
    nodes: BTreeMap<String, Peer>,
    entries: BTreeMap<String, (RoomEntry, Revision)>,
    /// The codes of these by owner.
    rooms_of: BTreeMap<Owner, BTreeSet<String>>,
    /// Rooms that were removed, as an answer told, and the newest revision of which watchers may still tell.
    removed: BTreeMap<String, Revision>,
    held: BTreeMap<String, Held>,
    operations: BTreeMap<String, Operation>,
    /// Looks that are on their way.
    looks: BTreeMap<Key, Look>,
    /// Owners of rooms that are not among the nodes.
    missing: BTreeMap<Owner, Missing>,
    /// Newer epochs that the records of rooms have than their entries.
    newer_epochs: BTreeMap<String, u64>,
    /// Rooms that are to be looked at again.
    unsettled: BTreeSet<String>,
    nodes_synced: bool,
    rooms_synced: bool,
    draining: bool,
    actions: Vec<Action>,
}

impl Directory {
    /// A directory of which nothing is known yet.
    pub fn new(node: NodeSettings) -> Directory {
        Directory {
            membership: Membership::default(),
            connection: Connection::default(),
            node,
            load: Load::default(),
            nodes: BTreeMap::new(),
            entries: BTreeMap::new(),
            rooms_of: BTreeMap::new(),
            removed: BTreeMap::new(),
            held: BTreeMap::new(),
            operations: BTreeMap::new(),
            looks: BTreeMap::new(),
            missing: BTreeMap::new(),
            newer_epochs: BTreeMap::new(),
            unsettled: BTreeSet::new(),
            nodes_synced: false,
            rooms_synced: false,
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
                self.heard_of_room(code, entry, revision, now);
            }
            Change::Gone(key, revision) => self.removed_by(key, revision, now),
            Change::Written(..) => {}
        }
    }

    fn removed_by(&mut self, key: Key, revision: Revision, now: Time) {
        if let Some(look) = self.looks.get_mut(&key) {
            look.removed_by = revision;
        }
        match key {
            Key::Node(name) => {
                if self.nodes.get(&name).is_some_and(|peer| peer.revision < revision) {
                    self.node_is_gone(&name, now);
                }
            }
            Key::Room(code) => {
                if self.removed.get(&code).is_some_and(|by| *by <= revision) {
                    self.removed.remove(&code);
                }
                if self.entries.get(&code).is_some_and(|(_, known)| *known < revision) {
                    self.forget(&code);
                    self.connection.missed.remove(&code);
                    self.newer_epochs.remove(&code);
                    self.stop_removed(&code);
                    self.settle(&code, now);
                }
            }
        }
    }

    /// All nodes that there were when their bucket began to be watched were passed to [`Directory::changed`]; those
    /// that were known before and are not among these are gone.
    pub fn synced_nodes(&mut self, present: &BTreeSet<Key>, now: Time) {
        // The owners of rooms among them are looked for before their rooms are claimed.
        self.nodes.retain(|name, _| present.contains(&Key::Node(name.clone())));
        self.nodes_synced = true;
        self.settle_all(now);
    }

    /// The same for rooms.
    pub fn synced_rooms(&mut self, present: &BTreeSet<Key>, now: Time) {
        let is_gone = |code: &String| !present.contains(&Key::Room(code.clone()));
        self.removed.retain(|code, _| !is_gone(code));
        let gone: Vec<String> = self.entries.keys().filter(|code| is_gone(code)).cloned().collect();
        gone.iter().for_each(|code| self.forget(code));
        self.rooms_synced = true;
        self.rooms_are_known(gone);
        self.settle_all(now);
    }

    fn has_synced(&self) -> bool {
        self.nodes_synced && self.rooms_synced
    }

    /// Takes the answer to an [`Action::Write`] or [`Action::Remove`], once for each.
    pub fn answered(&mut self, key: Key, answer: Answer, now: Time) {
        match key {
            Key::Node(name) if name == self.node.name => self.lease_answered(answer, now),
            // The others were told that a node is gone.
            Key::Node(_) => {}
            Key::Room(code) => self.room_answered(&code, answer, now),
        }
    }

    /// Returns whether the entry of a room was asked for, and no answer has come yet.
    pub fn looks_for(&self, code: &str) -> bool {
        self.looks.contains_key(&Key::Room(code.to_owned()))
    }

    /// Takes the answer to an [`Action::Look`]: the entry, `None` if there is none.
    pub fn looked(&mut self, key: Key, found: Option<(Entry, Revision)>, now: Time) {
        let Some(Look { known, removed_by }) = self.looks.remove(&key) else { return };
        // A watcher may have told since that what was found is gone.
        let found = found.filter(|(_, revision)| *revision > removed_by);
        match (key, found) {
            (Key::Node(name), found) => {
                let found = found.and_then(|(entry, revision)| match entry {
                    Entry::Node(entry) => Some((entry, revision)),
                    Entry::Room(_) => None,
                });
                self.node_looked_up(name, found, known, now);
            }
            (key, Some((entry, revision))) => {
                self.changed(Change::Written(key, entry, revision), now);
            }
            (Key::Room(code), None) => {
                // There may be another since the look was sent.
                let entry = self.entries.get(&code).map(|(_, revision)| *revision);
                if let Some(revision) = entry
                    && known == entry
                {
                    self.removed.insert(code.clone(), revision);
                    self.forget(&code);
                    if now < self.connection.doubtful_until {
                        self.connection.missed.insert(code.clone());
                    }
                    self.settle(&code, now);
                }
            }
        }
    }

    /// No answer came to an [`Action::Look`].
    pub fn look_failed(&mut self, key: &Key, now: Time) {
        self.looks.remove(key);
        if let Key::Node(name) = key {
            self.lease_look_failed(name, now);
            self.still_doubtful(name, now);
        }
    }

    /// Does what is due at this time: renews the lease, looks for silent nodes, claims rooms. To be called some ten
    /// times a second.
    pub fn poll(&mut self, now: Time) {
        self.poll_lease(now);
        if now >= self.connection.doubtful_until {
            self.connection.missed.clear();
        }
        if !self.has_synced() {
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
        self.settle_held_rooms(now);
    }

    fn settle_held_rooms(&mut self, now: Time) {
        for code in self.held.keys().cloned().collect::<Vec<_>>() {
            self.settle(&code, now);
        }
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
            (None, Some((entry, _))) if self.is_me(&entry.owner) => Located::Soon,
            (None, Some((entry, _))) => match self.peer_of(&entry.owner) {
                Some(peer) if entry.owner.node != self.node.name => {
                    Located::At(peer.entry.url.clone())
                }
                _ => Located::Lost,
            },
            (None, None) if self.connection.missed.contains(code) => Located::Lost,
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

    fn heard_of_room(&mut self, code: String, entry: RoomEntry, revision: Revision, now: Time) {
        // An answer may have told of it already, and of what came after it.
        let known = self.entries.get(&code).map(|(_, known)| *known);
        if known.max(self.removed.get(&code).copied()) >= Some(revision) {
            return;
        }
        self.forget(&code);
        self.removed.remove(&code);
        self.connection.missed.remove(&code);
        if self.newer_epochs.get(&code).is_some_and(|newer| *newer < entry.epoch) {
            self.newer_epochs.remove(&code);
        }
        self.rooms_of.entry(entry.owner.clone()).or_default().insert(code.clone());
        self.entries.insert(code.clone(), (entry, revision));
        self.settle(&code, now);
    }

    fn forget(&mut self, code: &str) {
        let Some((entry, _)) = self.entries.remove(code) else { return };
        let codes = self.rooms_of.get_mut(&entry.owner).expect("each entry is in it");
        codes.remove(code);
        if codes.is_empty() {
            self.rooms_of.remove(&entry.owner);
            self.missing.remove(&entry.owner);
        }
    }

    /// Asks for an entry, unless it was asked for already; returns whether it was not.
    pub fn look(&mut self, key: Key) -> bool {
        if self.looks.contains_key(&key) {
            return false;
        }
        let known = match &key {
            Key::Node(name) => self.nodes.get(name).map(|peer| peer.revision),
            Key::Room(code) => self.entries.get(code).map(|(_, revision)| *revision),
        };
        self.looks.insert(key.clone(), Look { known, removed_by: 0 });
        self.actions.push(Action::Look(key));
        true
    }

    fn settle_all(&mut self, now: Time) {
        let codes: BTreeSet<String> =
            self.entries.keys().chain(self.held.keys()).cloned().collect();
        for code in codes {
            self.settle(&code, now);
        }
    }
}
