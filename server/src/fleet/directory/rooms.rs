//! The rooms that this node holds, and its writes that are on their way.

use super::state::{Operation, Phase};
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
        let Some((entry, revision)) = self.entries.get(code) else { return };
        let to = RoomEntry { owner, epoch: entry.epoch + 1, room: entry.room.clone() };
        let (key, value) = (Key::Room(code.to_owned()), Entry::Room(to.clone()));
        self.actions.push(Action::Write(key, value, *revision));
        self.operations.insert(code.to_owned(), Operation::Change { to });
    }

    pub(super) fn remove(&mut self, code: &str) {
        let Some((_, revision)) = self.entries.get(code) else { return };
        let revision = *revision;
        self.actions.push(Action::Remove(Key::Room(code.to_owned()), revision));
        self.operations.insert(code.to_owned(), Operation::Remove { revision });
    }
}
