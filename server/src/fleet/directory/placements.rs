//! Which node plays which room, as far as this node has heard.

use super::terms::{Requests, Time};
use crate::fleet::entry::{Key, Owner, Revision, RoomEntry};
use std::collections::{BTreeMap, BTreeSet};
use tracing::warn;

/// A copy of the entries of all rooms.
#[derive(Debug, Default)]
pub struct Placements {
    entries: BTreeMap<String, (RoomEntry, Revision)>,
    /// The codes of these by owner.
    rooms_of: BTreeMap<Owner, BTreeSet<String>>,
    /// Rooms that an answer said were removed, and the newest revision that watchers may still report of them.
    pub(super) removed: BTreeMap<String, Revision>,
    /// Newer epochs that the records of rooms have than their entries.
    newer_epochs: BTreeMap<String, u64>,
    /// Rooms that there were before, and of which the store knows nothing.
    missed: BTreeSet<String>,
    /// Until then, the store may have forgotten who plays a room that is played.
    doubtful_until: Time,
    /// The newest revision of a room's entry when the rooms were first known in a store that may have forgotten.
    /// Until that, the greatest there is.
    known_revision: Revision,
    pub synced: bool,
}

impl Placements {
    /// The store may have forgotten entries, and no node claims a room of another before this time.
    pub fn doubt(&mut self, until: Time) {
        self.doubtful_until = until;
        self.known_revision = Revision::MAX;
        self.removed.clear();
        self.entries.values_mut().for_each(|(_, revision)| *revision = 0);
    }

    /// Returns whether the store may have forgotten who plays a room.
    pub fn is_doubtful(&self, now: Time) -> bool {
        now < self.doubtful_until
    }

    /// Ends the doubts that are over.
    pub fn poll(&mut self, now: Time) {
        if !self.is_doubtful(now) {
            self.missed.clear();
        }
    }

    /// Rooms that are known and are not among these entries.
    pub fn absent(&self, present: &BTreeSet<Key>) -> Vec<String> {
        let is_absent = |code: &&String| !present.contains(&Key::Room((*code).clone()));
        self.entries.keys().filter(is_absent).cloned().collect()
    }

    /// The watchers have listed these entries of rooms; `absent` were known before, and are forgotten.
    pub fn synced(&mut self, present: &BTreeSet<Key>, absent: Vec<String>) {
        self.removed.retain(|code, _| present.contains(&Key::Room(code.clone())));
        self.synced = true;
        if self.known_revision != Revision::MAX {
            return;
        }
        let revisions = self.entries.values().map(|(_, revision)| *revision);
        self.known_revision = revisions.max().unwrap_or(0);
        if !absent.is_empty() {
            warn!(
                rooms = absent.len(),
                "the directory has forgotten rooms; those that are played are written again"
            );
        }
        self.missed = absent.into_iter().collect();
    }

    /// Returns whether an entry was written since the store may have forgotten.
    pub fn is_newer_than_known(&self, revision: Revision) -> bool {
        revision > self.known_revision
    }

    /// The entry of a room, and its revision.
    pub fn get(&self, code: &str) -> Option<&(RoomEntry, Revision)> {
        self.entries.get(code)
    }

    /// The node that is to play a room.
    pub fn owner(&self, code: &str) -> Option<&Owner> {
        self.entries.get(code).map(|(entry, _)| &entry.owner)
    }

    pub fn revision(&self, code: &str) -> Option<Revision> {
        self.entries.get(code).map(|(_, revision)| *revision)
    }

    /// The facts of all rooms.
    pub fn rooms(&self) -> impl Iterator<Item = (&String, &RoomEntry)> {
        self.entries.iter().map(|(code, (entry, _))| (code, entry))
    }

    /// The rooms of an owner, if it has any.
    pub fn rooms_of(&self, owner: &Owner) -> Option<&BTreeSet<String>> {
        self.rooms_of.get(owner)
    }

    /// Returns whether the store has forgotten a room that its node may write again.
    pub fn is_missed(&self, code: &str) -> bool {
        self.missed.contains(code)
    }

    /// Asks for the entry of a room, unless it was asked for already.
    pub fn look_up(&self, code: &str, requests: &mut Requests) {
        requests.look_up(Key::Room(code.to_owned()), self.revision(code));
    }

    /// Returns whether an entry is newer than what is known of the room. An answer may have told of it already, and
    /// of what came after it.
    pub fn is_news(&self, code: &str, revision: Revision) -> bool {
        self.revision(code).max(self.removed.get(code).copied()) < Some(revision)
    }

    /// Takes the newest entry of a room; the one before is forgotten.
    pub fn insert(&mut self, code: String, entry: RoomEntry, revision: Revision) {
        self.removed.remove(&code);
        self.missed.remove(&code);
        if self.newer_epochs.get(&code).is_some_and(|newer| *newer < entry.epoch) {
            self.newer_epochs.remove(&code);
        }
        self.rooms_of.entry(entry.owner.clone()).or_default().insert(code.clone());
        self.entries.insert(code, (entry, revision));
    }

    /// Forgets the entry of a room; returns its owner if that has no other room.
    pub fn forget(&mut self, code: &str) -> Option<Owner> {
        let (entry, _) = self.entries.remove(code)?;
        let codes = self.rooms_of.get_mut(&entry.owner).expect("each entry is in it");
        codes.remove(code);
        if !codes.is_empty() {
            return None;
        }
        self.rooms_of.remove(&entry.owner);
        Some(entry.owner)
    }

    /// A watcher reports a removal by a write of this revision; returns whether it is that of the known entry.
    pub fn removed_by(&mut self, code: &str, revision: Revision) -> bool {
        if self.removed.get(code).is_some_and(|by| *by <= revision) {
            self.removed.remove(code);
        }
        let is_removed = self.revision(code).is_some_and(|known| known < revision);
        if is_removed {
            self.missed.remove(code);
            self.newer_epochs.remove(code);
        }
        is_removed
    }

    /// An answer says that the entry of this revision is removed; returns whether that is the known one.
    pub fn found_removed(&mut self, code: &str, revision: Revision) -> bool {
        let is_known = self.revision(code) == Some(revision);
        if is_known {
            self.removed.insert(code.to_owned(), revision);
        }
        is_known
    }

    /// A removed room may be one that the store has forgotten.
    pub fn miss(&mut self, code: String, now: Time) {
        if self.is_doubtful(now) {
            self.missed.insert(code);
        }
    }

    /// The records of a room are of this epoch.
    pub fn has_records_of(&mut self, code: &str, epoch: u64) {
        let newest = self.newer_epochs.entry(code.to_owned()).or_default();
        *newest = epoch.max(*newest);
    }

    /// Returns whether the records of a room are of a later epoch than this one.
    pub fn is_outdated(&self, code: &str, epoch: u64) -> bool {
        self.newer_epochs.get(code).is_some_and(|newer| *newer > epoch)
    }

    /// The epoch of the next entry of a room, after all that are known and this one.
    pub fn next_epoch(&self, code: &str, held: u64) -> u64 {
        let known = self.entries.get(code).map_or(0, |(entry, _)| entry.epoch);
        let newer = self.newer_epochs.get(code).copied().unwrap_or(0);
        known.max(held).max(newer) + 1
    }
}
