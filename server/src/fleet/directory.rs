//! A node's copy of the directory, and the node's role in it. It is a state machine that takes changes, answers and the
//! time and produces [`Action`]s, so it can run both on a network and in a simulation.
//!
//! There are only a few rules. A node plays exactly the rooms whose entries name it. Entries change only by
//! compare-and-set, so that only one of several nodes that want a room gets it. A node renews its lease every
//! [`RENEW_EVERY`]. If renewals stop, its rooms pause [`HELD_FOR`] after the last renewal was sent, and its entry
//! expires [`LEASE_TTL`] after the last renewal was written, so no other node can start the rooms before they have
//! paused. When a node is gone, the others claim its rooms.

mod handover;
mod members;
mod membership;
mod placements;
mod terms;
#[cfg(test)]
mod tests;

pub use terms::*;

use super::entry::{Entry, Key, NodeEntry, Owner, Revision, RoomCounts, RoomEntry, RoomFacts};
use handover::{Handover, Operation, Surroundings};
use members::Members;
use placements::Placements;
use std::collections::BTreeSet;

/// A node's copy of the directory, and the node's role in it: which nodes are alive, which node plays each room, and
/// what this node does. Each event goes to the component that it concerns, and the resulting changes go to the others.
#[derive(Debug, Default)]
pub struct Directory {
    members: Members,
    placements: Placements,
    handover: Handover,
    requests: Requests,
    connection: u64,
}

impl Directory {
    /// Creates an empty directory.
    pub fn new(node: NodeSettings) -> Directory {
        let mut directory = Directory::default();
        directory.members.own.node = node;
        directory
    }

    /// Takes the actions that are due.
    pub fn take_actions(&mut self) -> Vec<Action> {
        std::mem::take(&mut self.requests.actions)
    }

    /// Called when a connection to the store has been made. Its watchers will report all entries, and requests on
    /// earlier connections will no longer be answered. `may_have_forgotten` means that the store may have lost
    /// acknowledged writes since the last connection: it may be a different store, or have lost its disk or, in a power
    /// failure, unsynced data.
    ///
    /// Two rules ensure that each room has only one owner. First, a node claims no other node's room until it has held
    /// its lease for [`LEASE_TTL`], since the others may be about to reconnect. Second, it renews its lease only once
    /// every room held under that lease has an entry naming the node; it rewrites the entries of rooms that it was
    /// still playing.
    pub fn connected(&mut self, may_have_forgotten: bool, now: Time) {
        self.connection += 1;
        self.requests.cancel();
        self.handover.connected(now);
        self.placements.synced = false;
        // A process that has just started knows nothing that the store could have forgotten.
        let may_have_forgotten = may_have_forgotten && self.connection > 1;
        self.members.connected(may_have_forgotten, now);
        if may_have_forgotten {
            let doubts_go_on = self.placements.is_doubtful(now);
            self.handover.doubt(self.members.own.leased(now), doubts_go_on);
            self.placements.doubt(self.members.own.claims_from);
        }
    }

    /// Number of the current connection, counted from 1; 0 before the first.
    pub fn connection(&self) -> u64 {
        self.connection
    }

    /// Applies a change to the directory. Changes must arrive in revision order.
    pub fn changed(&mut self, change: Change, now: Time) {
        match change {
            Change::Written(Key::Node(name), Entry::Node(entry), revision) => {
                self.heard_of(name, entry, revision, now);
            }
            Change::Written(Key::Room(code), Entry::Room(entry), revision) => {
                if self.placements.is_news(&code, revision) {
                    self.forget(&code);
                    self.placements.insert(code.clone(), entry, revision);
                    self.compare([code], now);
                }
            }
            Change::Gone(key, revision) => self.removed_by(key, revision, now),
            Change::Written(..) => {}
        }
    }

    fn removed_by(&mut self, key: Key, revision: Revision, now: Time) {
        self.requests.removed_by(&key, revision);
        match key {
            Key::Node(name) => {
                if self.members.revision(&name).is_some_and(|known| known < revision) {
                    self.node_is_gone(&name, now);
                }
            }
            Key::Room(code) => {
                if self.placements.removed_by(&code, revision) {
                    self.forget(&code);
                    let (handover, mut around) = self.handover(now);
                    handover.removed(&code, &mut around);
                }
            }
        }
    }

    /// Called when every node that existed when watching began has been passed to [`Directory::changed`]. Previously
    /// known nodes that are not in `present` are gone.
    pub fn synced_nodes(&mut self, present: &BTreeSet<Key>, now: Time) {
        self.members.synced(present);
        self.compare_all(now);
    }

    /// Like [`Directory::synced_nodes`], for rooms.
    pub fn synced_rooms(&mut self, present: &BTreeSet<Key>, now: Time) {
        let absent = self.placements.absent(present);
        absent.iter().for_each(|code| self.forget(code));
        self.placements.synced(present, absent);
        self.compare_all(now);
    }

    /// Handles the answer to an [`Action::Write`] or [`Action::Remove`]. Called once per action.
    pub fn answered(&mut self, key: Key, answer: Answer, now: Time) {
        match key {
            Key::Node(name) if name == self.members.own.node.name => {
                let gone = self.members.answered(answer, &mut self.requests, now);
                self.claim_rooms_of(gone, now);
            }
            // Nothing to do: the watchers report the removal of another node.
            Key::Node(_) => {}
            Key::Room(code) => self.room_answered(code, answer, now),
        }
    }

    fn room_answered(&mut self, code: String, answer: Answer, now: Time) {
        let Some(operation) = self.handover.answered(&code) else { return };
        match (answer, operation) {
            (Answer::Done(revision), Operation::Change { to }) => {
                let written = Change::Written(Key::Room(code.clone()), Entry::Room(to), revision);
                self.changed(written, now);
                // A watcher may already have reported the change, but it had to wait for this answer.
                self.compare([code], now);
                if self.members.own.draining {
                    self.compare_held(now);
                }
            }
            // If this request did not remove the entry, a watcher has already reported its removal.
            (Answer::Done(_), Operation::Remove { revision }) => {
                self.found_removed(&code, revision, now);
            }
            (Answer::Done(_), Operation::Pause { .. }) => {}
            (Answer::Refused | Answer::Unknown, _) => {
                let (handover, mut around) = self.handover(now);
                handover.ask_again(&code, &mut around);
            }
        }
    }

    /// Looks up a room's entry, unless a lookup is already in progress.
    pub fn look(&mut self, code: &str) {
        self.placements.look_up(code, &mut self.requests);
    }

    /// Returns whether a lookup of a room's entry is in progress.
    pub fn looks_for(&self, code: &str) -> bool {
        self.requests.is_looking_up(&Key::Room(code.to_owned()))
    }

    /// Handles the answer to an [`Action::Look`]: the entry, or `None` if it does not exist.
    pub fn looked(&mut self, key: Key, found: Option<(Entry, Revision)>, now: Time) {
        let Some(lookup) = self.requests.looked_up(&key) else { return };
        // A watcher may have reported in the meantime that this entry was removed.
        let found = found.filter(|(_, revision)| *revision > lookup.removed_by);
        match (key, found) {
            (Key::Node(name), found) => {
                let found = found.and_then(|(entry, revision)| match entry {
                    Entry::Node(entry) => Some((entry, revision)),
                    Entry::Room(_) => None,
                });
                self.node_looked_up(name, found, lookup.known, now);
            }
            (key, Some((entry, revision))) => {
                self.changed(Change::Written(key, entry, revision), now);
            }
            (Key::Room(code), None) => {
                // A newer entry may have arrived since the lookup was sent.
                if let Some(revision) = lookup.known
                    && self.found_removed(&code, revision, now)
                {
                    self.placements.miss(code, now);
                }
            }
        }
    }

    fn node_looked_up(
        &mut self,
        name: String,
        found: Option<(NodeEntry, Revision)>,
        known: Option<Revision>,
        now: Time,
    ) {
        let incarnation = found.as_ref().map(|(entry, _)| entry.incarnation);
        let gone = self.members.decide_doubts(&name, incarnation, now);
        self.claim_rooms_of(gone, now);
        if self.members.own.looks_for(&name) {
            let before = self.members.own.owner();
            let gone = self.members.own_looked_up(found, &mut self.requests, now);
            if !self.members.own.is(&before) {
                self.handover.lease_lost();
            }
            self.claim_rooms_of(gone, now);
        } else if let Some((entry, revision)) = found {
            self.heard_of(name, entry, revision, now);
        } else if known.is_some() && self.members.revision(&name) == known {
            self.node_is_gone(&name, now);
            self.requests.actions.push(Action::Remove(Key::Node(name), 0));
        }
    }

    /// Called when an [`Action::Look`] goes unanswered.
    pub fn look_failed(&mut self, key: &Key, now: Time) {
        self.requests.looked_up(key);
        if let Key::Node(name) = key {
            self.members.look_failed(name, now);
        }
    }

    /// Does everything that is due: renewing the lease, looking for silent nodes and claiming rooms. Must be called
    /// about ten times a second.
    pub fn poll(&mut self, now: Time) {
        let may_renew = |incarnation| !self.handover.has_doubts(incarnation);
        let own = &self.members.own.node.name;
        let known = self.members.revision(own);
        self.members.own.poll(known, may_renew, &mut self.requests, now);
        self.placements.poll(now);
        if !self.has_synced() {
            return;
        }
        self.members.look_for_silent(&mut self.requests, now);
        let due = std::mem::take(&mut self.handover.due);
        self.compare(due, now);
    }

    /// Sets the measured load to report in the next renewal.
    pub fn measured(&mut self, load: Load) {
        self.members.own.load = load;
    }

    /// Hands over all rooms, and accepts no new ones.
    pub fn drain(&mut self, now: Time) {
        self.members.own.drain(now);
        self.compare_held(now);
    }

    /// Removes this node's entry, so that the others need not wait for it to expire. Any rooms that the node is still
    /// playing pause. The node does not register again.
    pub fn leave(&mut self) {
        self.members.own.leave(&mut self.requests);
    }

    /// Handles an event of a room that this node holds.
    pub fn room(&mut self, code: &str, event: RoomEvent, now: Time) {
        let (handover, mut around) = self.handover(now);
        handover.on(code, event, &mut around);
    }

    /// Called when this node is to open a room whose records already have a later epoch. If another node wrote them,
    /// that node's entry will arrive soon; otherwise the directory has forgotten the entry, and the room resumes in a
    /// higher epoch.
    pub fn outdated(&mut self, code: &str, epoch: u64, now: Time) {
        self.placements.has_records_of(code, epoch);
        self.room(code, RoomEvent::Fenced, now);
    }

    /// Places a new room. Once it is placed, [`Directory::locate`] returns its node.
    pub fn place(&mut self, code: &str, room: RoomFacts, now: Time) -> Result<(), PlaceError> {
        // A standing room has the same code as its predecessor, which another node may still be playing.
        if room.creator.is_none() && self.placements.is_doubtful(now) {
            return Err(PlaceError::NotNow);
        }
        self.place_at(code, room, |_| true)
    }

    /// Places a new room on this node.
    pub fn place_here(&mut self, code: &str, room: RoomFacts) -> Result<(), PlaceError> {
        let own = self.members.own.node.name.clone();
        self.place_at(code, room, |name| name == own)
    }

    fn place_at(
        &mut self,
        code: &str,
        room: RoomFacts,
        allowed: impl Fn(&str) -> bool,
    ) -> Result<(), PlaceError> {
        if self.has_room(code) || self.handover.is_busy_with(code) {
            return Err(PlaceError::Taken);
        }
        if !self.has_synced() || !self.is_registered() {
            return Err(PlaceError::NotNow);
        }
        let owner = self.members.roomiest(allowed).ok_or(PlaceError::Full)?;
        self.members.reserve(&owner);
        self.handover.write(code, RoomEntry { owner, epoch: 1, room }, 0, &mut self.requests);
        Ok(())
    }

    /// Returns whether this node is registered.
    pub fn is_registered(&self) -> bool {
        self.members.own.is_registered()
    }

    /// The incarnation of this node that a room's entry names; `None` if the entry names another node.
    pub fn owned_under(&self, code: &str) -> Option<u64> {
        let owner = self.placements.owner(code)?;
        (owner.node == self.members.own.node.name).then_some(owner.incarnation)
    }

    /// Returns whether this node holds a room in this or a later epoch.
    pub fn holds_epoch(&self, code: &str, epoch: u64) -> bool {
        self.handover.holds_epoch(code, epoch)
    }

    /// Number of registered nodes, including this one.
    pub fn nodes(&self) -> usize {
        self.members.count()
    }

    /// Number of rooms that this node is playing, handing over or opening.
    pub fn holds(&self) -> usize {
        self.handover.rooms().len()
    }

    /// The addresses of the other nodes.
    pub fn urls(&self) -> impl Iterator<Item = &str> {
        self.members.others().map(|(_, entry)| entry.url.as_str())
    }

    /// Other nodes' listed rooms, with their facts.
    pub fn listed_elsewhere(&self) -> impl Iterator<Item = (&RoomCounts, &RoomFacts)> {
        let others = self.members.others();
        let counts = others.flat_map(|(name, node)| node.rooms.iter().map(move |c| (name, c)));
        counts.filter_map(|(name, counts)| {
            let (entry, _) = self.placements.get(&counts.code)?;
            (entry.owner.node == *name && !entry.room.private).then_some((counts, &entry.room))
        })
    }

    /// Returns whether a room with this code exists.
    pub fn has_room(&self, code: &str) -> bool {
        self.placements.get(code).is_some()
    }

    /// The entries of all rooms.
    pub fn rooms(&self) -> impl Iterator<Item = (&String, &RoomEntry)> {
        self.placements.rooms()
    }

    /// The node that plays a room.
    pub fn locate(&self, code: &str) -> Located {
        if self.handover.plays(code) {
            return Located::Here;
        }
        if self.handover.is_busy_with(code) {
            return Located::Soon;
        }
        let own = &self.members.own;
        match self.placements.owner(code) {
            Some(owner) if own.is(owner) => Located::Soon,
            Some(owner) => match self.members.entry_of(owner) {
                Some(entry) if owner.node != own.node.name => Located::At(entry.url.clone()),
                _ => Located::Lost,
            },
            None if self.placements.is_missed(code) => Located::Lost,
            None => Located::Unknown,
        }
    }

    fn has_synced(&self) -> bool {
        self.members.synced && self.placements.synced
    }

    fn heard_of(&mut self, name: String, entry: NodeEntry, revision: Revision, now: Time) {
        let gone = self.members.heard_of(name, entry, revision, now);
        self.claim_rooms_of(gone, now);
    }

    fn node_is_gone(&mut self, name: &str, now: Time) {
        let gone = self.members.remove(name);
        self.claim_rooms_of(gone, now);
    }

    /// Makes the rooms of owners that are gone claimable.
    fn claim_rooms_of(&mut self, gone: impl IntoIterator<Item = Owner>, now: Time) {
        for owner in gone {
            if let Some(codes) = self.placements.rooms_of(&owner).cloned() {
                self.members.is_gone(owner, now);
                self.compare(codes, now);
            }
        }
    }

    /// Removes a room's entry if it has this revision. Returns whether it did.
    fn found_removed(&mut self, code: &str, revision: Revision, now: Time) -> bool {
        let is_known = self.placements.found_removed(code, revision);
        if is_known {
            self.forget(code);
            self.compare([code.to_owned()], now);
        }
        is_known
    }

    fn forget(&mut self, code: &str) {
        if let Some(owner) = self.placements.forget(code) {
            self.members.has_no_rooms(&owner);
        }
    }

    fn compare_all(&mut self, now: Time) {
        let known = self.placements.rooms().map(|(code, _)| code);
        let codes: BTreeSet<String> = known.chain(self.handover.rooms()).cloned().collect();
        self.compare(codes, now);
    }

    fn compare_held(&mut self, now: Time) {
        let codes: Vec<String> = self.handover.rooms().cloned().collect();
        self.compare(codes, now);
    }

    fn compare(&mut self, codes: impl IntoIterator<Item = String>, now: Time) {
        let (handover, mut around) = self.handover(now);
        codes.into_iter().for_each(|code| handover.compare(&code, &mut around));
    }

    fn handover(&mut self, now: Time) -> (&mut Handover, Surroundings<'_>) {
        let Directory { members, placements, handover, requests, .. } = self;
        (handover, Surroundings { members, placements, requests, now })
    }
}
