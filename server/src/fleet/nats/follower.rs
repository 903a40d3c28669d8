//! Follows a bucket, and turns the entries that its watcher reports into changes to the directory.

use super::store::watched;
use crate::fleet::directory::Change;
use crate::fleet::entry::{Key, Revision};
use async_nats::jetstream::kv::Operation;
use std::collections::BTreeSet;
use tracing::warn;

#[derive(Default)]
pub struct Follower {
    /// The entries that existed when watching began; `None` once all of them have been reported.
    initial: Option<BTreeSet<Key>>,
    /// Unreadable entries that have already been logged.
    unreadable: BTreeSet<Key>,
}

impl Follower {
    /// Called when watching the bucket starts over from the beginning.
    pub fn begin(&mut self) {
        self.initial = Some(BTreeSet::new());
    }

    /// Handles a reported entry. Returns `None` if the entry cannot be read; it then counts as present, with its last
    /// known value.
    pub fn hear(
        &mut self,
        key: Key,
        operation: Operation,
        value: &[u8],
        revision: Revision,
    ) -> Option<Change> {
        let entry = match watched(&key, operation, value) {
            Ok(None) => {
                self.unreadable.remove(&key);
                return Some(Change::Gone(key, revision));
            }
            Ok(Some(entry)) => Some(entry),
            Err(reason) => {
                if self.unreadable.insert(key.clone()) {
                    warn!(reason, "an entry of the directory cannot be read, and is passed over");
                }
                None
            }
        };
        self.initial.iter_mut().for_each(|present| present.extend([key.clone()]));
        let entry = entry?;
        self.unreadable.remove(&key);
        Some(Change::Written(key, entry, revision))
    }

    /// Takes the initial entries once all of them have been reported.
    pub fn take_initial(&mut self) -> Option<BTreeSet<Key>> {
        self.initial.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::entry::{Entry, Owner, RoomEntry, RoomFacts};

    #[test]
    fn an_entry_that_cannot_be_read_is_passed_over_and_counts_as_there() {
        let key = |code: &str| Key::Room(code.to_owned());
        let room = RoomEntry {
            owner: Owner { node: "a".into(), incarnation: 1 },
            epoch: 1,
            room: RoomFacts {
                scene: "arena".into(),
                number: 1,
                private: false,
                creator: None,
                guest: false,
            },
        };
        let value = serde_json::to_vec(&room).expect("an entry");
        let mut follower = Follower::default();
        follower.begin();
        let foreign = |follower: &mut Follower, revision| {
            follower.hear(key("foreign"), Operation::Put, b"{\"owner\":7}", revision)
        };
        assert_eq!(foreign(&mut follower, 1), None);
        let written = Change::Written(key("pile"), Entry::Room(room), 2);
        assert_eq!(follower.hear(key("pile"), Operation::Put, &value, 2), Some(written));
        assert_eq!(foreign(&mut follower, 3), None);
        assert_eq!(follower.unreadable.len(), 1);
        let gone = Some(Change::Gone(key("foreign"), 4));
        assert_eq!(follower.hear(key("foreign"), Operation::Delete, b"", 4), gone);
        assert!(follower.unreadable.is_empty());
        assert_eq!(follower.take_initial(), Some([key("foreign"), key("pile")].into()));
        assert_eq!(follower.take_initial(), None);
    }
}
