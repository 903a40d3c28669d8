//! The rooms that this node holds, and its writes that are on their way.

use super::state::{Doubt, Operation, Phase};
use super::{Action, Answer, Change, Directory, RETRY, Time};
use crate::fleet::entry::{Entry, Key, Owner, RoomEntry};

impl Directory {
    /// The driver has opened a room that this node holds.
    pub fn opened(&mut self, code: &str, now: Time) {
        if let Some(held) = self.held.get_mut(code)
            && held.phase == Phase::Opening
        {
            held.phase = Phase::Playing;
            self.settle(code, now);
        }
    }

    /// A room could not be opened here.
    pub fn open_failed(&mut self, code: &str, now: Time) {
        if let Some(held) = self.held.get_mut(code) {
            held.phase = Phase::Failed(now + 10 * RETRY);
            self.settle(code, now);
        }
    }

    /// A room that this node played is over, and its records are gone.
    pub fn ended(&mut self, code: &str, now: Time) {
        if let Some(held) = self.held.get_mut(code) {
            held.phase = Phase::Over;
            self.settle(code, now);
        }
    }

    /// A room has ended here, and the last record is written.
    pub fn parted(&mut self, code: &str, now: Time) {
        if let Some(held) = self.held.get_mut(code)
            && held.phase == Phase::Parting
        {
            held.phase = Phase::Parted;
            self.settle(code, now);
        }
    }

    /// A write of records was refused: another node has begun to play the room, or this one has by a process that
    /// is gone.
    pub fn fenced(&mut self, code: &str, now: Time) {
        if self.held.contains_key(code) {
            self.stop(code);
            self.ask_again(code, now);
        }
    }

    /// The records of a room that this node is to open were continued in a later epoch. If that is another node's, its
    /// entry is about to be heard of; if not, the directory has forgotten it, and the room goes on after it.
    pub fn outdated(&mut self, code: &str, epoch: u64, now: Time) {
        let newest = self.newer_epochs.entry(code.to_owned()).or_default();
        *newest = epoch.max(*newest);
        self.fenced(code, now);
    }

    /// The entry of a room may be another: asks for it, and waits a moment before anything is begun.
    fn ask_again(&mut self, code: &str, now: Time) {
        self.look(Key::Room(code.to_owned()));
        let pause = Operation::Pause { until: now + RETRY };
        self.operations.entry(code.to_owned()).or_insert(pause);
        self.unsettled.insert(code.to_owned());
    }

    /// Ends a room here that another node plays.
    pub(super) fn stop(&mut self, code: &str) {
        let owner = self.entries.get(code).map(|(entry, _)| entry.owner.clone());
        let peer = owner.filter(|owner| !self.is_me(owner));
        let url = peer.and_then(|owner| Some(self.peer_of(&owner)?.entry.url.clone()));
        self.held.remove(code);
        self.actions.push(Action::Stop(code.to_owned(), url));
    }

    /// A room was removed from the directory, which ends it here too. The removal of one that this node still played
    /// when the store came back is of a room before it.
    pub(super) fn stop_removed(&mut self, code: &str) {
        let held = self.held.get(code);
        if held.is_some_and(|held| held.phase != Phase::Over && held.doubt != Doubt::Kept) {
            self.stop(code);
        }
    }

    pub(super) fn room_answered(&mut self, code: &str, answer: Answer, now: Time) {
        let Some(operation) = self.operations.remove(code) else { return };
        match (answer, operation) {
            (Answer::Done(revision), Operation::Change { to }) => {
                let key = Key::Room(code.to_owned());
                self.changed(Change::Written(key, Entry::Room(to), revision), now);
                // A watcher may have told of it before this answer, which it had to wait for.
                self.settle(code, now);
                if self.draining {
                    self.settle_held_rooms(now);
                }
            }
            (Answer::Done(_), Operation::Remove { revision }) => {
                // Otherwise a watcher has told of it already.
                if self.entries.get(code).is_some_and(|(_, known)| *known == revision) {
                    self.removed.insert(code.to_owned(), revision);
                    self.forget(code);
                    self.settle(code, now);
                }
            }
            (Answer::Done(_), Operation::Pause { .. }) => {}
            (Answer::Refused | Answer::Unknown, _) => self.ask_again(code, now),
        }
    }

    /// Writes an entry that names this owner, if the entry is still as it is known.
    pub(super) fn give(&mut self, code: &str, owner: Owner) {
        let (known, held) = (self.entries.get(code), self.held.get(code));
        let Some(room) = known.map(|(entry, _)| &entry.room).or(held.map(|held| &held.room)) else {
            return;
        };
        let (known_epoch, revision) =
            known.map_or((0, 0), |(entry, revision)| (entry.epoch, *revision));
        let held_epoch = held.map_or(0, |held| held.epoch);
        let newer_epoch = self.newer_epochs.get(code).copied().unwrap_or(0);
        let epoch = known_epoch.max(held_epoch).max(newer_epoch) + 1;
        let to = RoomEntry { owner, epoch, room: room.clone() };
        let (key, value) = (Key::Room(code.to_owned()), Entry::Room(to.clone()));
        self.actions.push(Action::Write(key, value, revision));
        self.operations.insert(code.to_owned(), Operation::Change { to });
    }

    pub(super) fn remove(&mut self, code: &str) {
        let Some((_, revision)) = self.entries.get(code) else { return };
        let revision = *revision;
        self.actions.push(Action::Remove(Key::Room(code.to_owned()), revision));
        self.operations.insert(code.to_owned(), Operation::Remove { revision });
    }
}
