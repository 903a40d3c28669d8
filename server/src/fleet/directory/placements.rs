//! The node that plays each room, as far as this node knows.

use super::terms::{Requests, Time};
use crate::fleet::entry::{Key, Owner, Revision, RoomEntry};
use std::collections::{BTreeMap, BTreeSet};
use tracing::warn;

/// A copy of all rooms' entries.
#[derive(Debug, Default)]
pub struct Placements {
    entries: BTreeMap<String, (RoomEntry, Revision)>,
    /// Room codes by owner.
    rooms_of: BTreeMap<Owner, BTreeSet<String>>,
    /// Rooms known from an answer to be removed, each with the newest revision that watchers may still report.
    pub(super) removed: BTreeMap<String, Revision>,
    /// Epochs of rooms whose records are newer than their entries.
    newer_epochs: BTreeMap<String, u64>,
    /// Rooms that existed before and are now missing from the store.
    missed: BTreeSet<String>,
    /// Time until which the store may have forgotten a room's owner.
    doubtful_until: Time,
    /// The newest revision of any room's entry when the rooms were first listed by a store that may have forgotten
    /// writes; `Revision::MAX` until they are listed.
    known_revision: Revision,
    pub synced: bool,
}

impl Placements {
    /// Called when the store may have forgotten entries. No node claims another's room before `until`.
    pub fn doubt(&mut self, until: Time) {
        self.doubtful_until = until;
        self.known_revision = Revision::MAX;
        self.removed.clear();
        self.entries.values_mut().for_each(|(_, revision)| *revision = 0);
    }

    /// Returns whether the store may have forgotten a room's owner.
    pub fn is_doubtful(&self, now: Time) -> bool {
        now < self.doubtful_until
    }

    /// Clears the missed rooms once the doubt is over.
    pub fn poll(&mut self, now: Time) {
        if !self.is_doubtful(now) {
            self.missed.clear();
        }
    }

    /// The known rooms that are not in `present`.
    pub fn absent(&self, present: &BTreeSet<Key>) -> Vec<String> {
        let is_absent = |code: &&String| !present.contains(&Key::Room((*code).clone()));
        self.entries.keys().filter(is_absent).cloned().collect()
    }

    /// Called when the watchers have listed the rooms in `present`. The rooms in `absent` were previously known and
    /// have been dropped.
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

    /// Returns whether an entry was written after the time when the store may have forgotten writes.
    pub fn is_newer_than_known(&self, revision: Revision) -> bool {
        revision > self.known_revision
    }

    /// A room's entry and its revision.
    pub fn get(&self, code: &str) -> Option<&(RoomEntry, Revision)> {
        self.entries.get(code)
    }

    /// The node that should play a room.
    pub fn owner(&self, code: &str) -> Option<&Owner> {
        self.entries.get(code).map(|(entry, _)| &entry.owner)
    }

    pub fn revision(&self, code: &str) -> Option<Revision> {
        self.entries.get(code).map(|(_, revision)| *revision)
    }

    /// The entries of all rooms.
    pub fn rooms(&self) -> impl Iterator<Item = (&String, &RoomEntry)> {
        self.entries.iter().map(|(code, (entry, _))| (code, entry))
    }

    /// An owner's rooms, if it has any.
    pub fn rooms_of(&self, owner: &Owner) -> Option<&BTreeSet<String>> {
        self.rooms_of.get(owner)
    }

    /// Returns whether the store has forgotten a room that the room's node may still write back.
    pub fn is_missed(&self, code: &str) -> bool {
        self.missed.contains(code)
    }

    /// Looks up a room's entry, unless a lookup is already in progress.
    pub fn look_up(&self, code: &str, requests: &mut Requests) {
        requests.look_up(Key::Room(code.to_owned()), self.revision(code));
    }

    /// Returns whether an entry is newer than the room's known state. An answer may already have reported it, along
    /// with later changes.
    pub fn is_news(&self, code: &str, revision: Revision) -> bool {
        self.revision(code).max(self.removed.get(code).copied()) < Some(revision)
    }

    /// Stores a room's newest entry.
    pub fn insert(&mut self, code: String, entry: RoomEntry, revision: Revision) {
        self.removed.remove(&code);
        self.missed.remove(&code);
        if self.newer_epochs.get(&code).is_some_and(|newer| *newer < entry.epoch) {
            self.newer_epochs.remove(&code);
        }
        self.rooms_of.entry(entry.owner.clone()).or_default().insert(code.clone());
        self.entries.insert(code, (entry, revision));
    }

    /// Removes a room's entry. Returns the owner if that was its last room.
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

    /// Handles a removal that a watcher reported with this revision. Returns whether it removes the known entry.
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

    /// Handles an answer saying that the entry with this revision was removed. Returns whether that is the known entry.
    pub fn found_removed(&mut self, code: &str, revision: Revision) -> bool {
        let is_known = self.revision(code) == Some(revision);
        if is_known {
            self.removed.insert(code.to_owned(), revision);
        }
        is_known
    }

    /// Notes that a missing room may be one that the store forgot.
    pub fn miss(&mut self, code: String, now: Time) {
        if self.is_doubtful(now) {
            self.missed.insert(code);
        }
    }

    /// Notes that a room's records have this epoch.
    pub fn has_records_of(&mut self, code: &str, epoch: u64) {
        let newest = self.newer_epochs.entry(code.to_owned()).or_default();
        *newest = epoch.max(*newest);
    }

    /// Returns whether a room's records have a later epoch than this.
    pub fn is_outdated(&self, code: &str, epoch: u64) -> bool {
        self.newer_epochs.get(code).is_some_and(|newer| *newer > epoch)
    }

    /// The epoch for a room's next entry: later than all known epochs and `held`.
    pub fn next_epoch(&self, code: &str, held: u64) -> u64 {
        let known = self.entries.get(code).map_or(0, |(entry, _)| entry.epoch);
        let newer = self.newer_epochs.get(code).copied().unwrap_or(0);
        known.max(held).max(newer) + 1
    }
}
