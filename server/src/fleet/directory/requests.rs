//! What the directory asks of its driver, in the order in which it was decided.

use super::terms::Action;
use crate::fleet::entry::{Key, Revision};
use std::collections::BTreeMap;

/// Actions that the driver has not taken yet, and lookups that are not answered yet.
#[derive(Debug, Default)]
pub struct Requests {
    pub actions: Vec<Action>,
    lookups: BTreeMap<Key, Lookup>,
}

/// A lookup of an entry that is under way.
#[derive(Clone, Copy, Debug)]
pub struct Lookup {
    /// The entry's revision as it was known when the lookup was sent.
    pub known: Option<Revision>,
    /// Revision of the newest removal that was heard of since.
    pub removed_by: Revision,
}

impl Requests {
    /// Looks an entry up of which this revision is known; returns false if a lookup is under way already.
    pub fn look_up(&mut self, key: Key, known: Option<Revision>) -> bool {
        let is_new = !self.is_looking_up(&key);
        if is_new {
            self.lookups.insert(key.clone(), Lookup { known, removed_by: 0 });
            self.actions.push(Action::Look(key));
        }
        is_new
    }

    pub fn is_looking_up(&self, key: &Key) -> bool {
        self.lookups.contains_key(key)
    }

    /// An entry was removed: a lookup that is under way may still find what was there before.
    pub fn removed_by(&mut self, key: &Key, revision: Revision) {
        if let Some(lookup) = self.lookups.get_mut(key) {
            lookup.removed_by = revision;
        }
    }

    /// Ends a lookup.
    pub fn looked_up(&mut self, key: &Key) -> Option<Lookup> {
        self.lookups.remove(key)
    }

    /// Drops all requests to the store, which a lost connection leaves without an answer.
    pub fn cancel(&mut self) {
        let is_exchange = |action: &Action| {
            matches!(action, Action::Write(..) | Action::Remove(..) | Action::Look(_))
        };
        self.actions.retain(|action| !is_exchange(action));
        self.lookups.clear();
    }
}
