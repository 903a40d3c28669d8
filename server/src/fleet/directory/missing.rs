//! Owners of rooms that are not among the nodes: which of them are gone. An owner whose entry was heard of and then
//! left, or was looked for and not found, is gone for good, since no node uses an incarnation twice.

use super::state::Missing;
use super::{Action, Directory, LEASE_TTL, LOOKERS, RETRY, Time};
use crate::fleet::entry::{Key, NodeEntry, Owner, Revision};
use tracing::info;

impl Directory {
    /// Since when this owner is known to be gone. While that is doubtful, it is looked for.
    pub(super) fn gone_since(&mut self, owner: &Owner, now: Time) -> Option<Time> {
        if self.peer_of(owner).is_some() {
            self.missing.remove(owner);
            return None;
        }
        let first = Missing::Doubtful { asked: false, next_at: now };
        match *self.missing.entry(owner.clone()).or_insert(first) {
            Missing::Gone(since) => return Some(since),
            Missing::Doubtful { asked: false, next_at } if now >= next_at => {
                // A look that is on its way already may have been answered before the owner came.
                if self.look(Key::Node(owner.node.clone())) {
                    self.missing
                        .insert(owner.clone(), Missing::Doubtful { asked: true, next_at: now });
                }
            }
            Missing::Doubtful { .. } => {}
        }
        None
    }

    /// Takes the answer to a look for a node: its entry, and the revision that was known when the look was sent.
    pub(super) fn node_looked_up(
        &mut self,
        name: String,
        found: Option<(NodeEntry, Revision)>,
        known: Option<Revision>,
        now: Time,
    ) {
        let incarnation = found.as_ref().map(|(entry, _)| entry.incarnation);
        self.decide_doubts(&name, incarnation, now);
        if name == self.node.name && self.membership.is_looking {
            self.lease_looked_up(found, now);
        } else if let Some((entry, revision)) = found {
            self.heard_of(name, entry, revision, now);
        } else if let Some(peer) = self.nodes.get(&name)
            && Some(peer.revision) == known
        {
            self.node_is_gone(&name, now);
            self.actions.push(Action::Remove(Key::Node(name), 0));
        }
    }

    fn decide_doubts(&mut self, name: &str, found: Option<u64>, now: Time) {
        let mut gone = Vec::new();
        for (owner, missing) in self.missing.range_mut(all_of(name)) {
            if owner.node != name {
                break;
            }
            if let Missing::Doubtful { asked: true, .. } = missing {
                if Some(owner.incarnation) == found {
                    *missing = Missing::Doubtful { asked: false, next_at: now + RETRY };
                } else {
                    gone.push(owner.clone());
                }
            }
        }
        for owner in gone {
            self.owner_is_gone(owner, now);
        }
    }

    /// A look for a node was not answered.
    pub(super) fn still_doubtful(&mut self, name: &str, now: Time) {
        for (owner, missing) in self.missing.range_mut(all_of(name)) {
            if owner.node != name {
                break;
            }
            if let Missing::Doubtful { asked: true, .. } = missing {
                *missing = Missing::Doubtful { asked: false, next_at: now + RETRY };
            }
        }
    }

    /// The entry of a node has left the directory.
    pub(super) fn node_is_gone(&mut self, name: &str, now: Time) {
        if let Some(peer) = self.nodes.remove(name) {
            if name != self.node.name {
                info!(node = %name, url = %peer.entry.url, "a node is gone");
            }
            let incarnation = peer.entry.incarnation;
            self.owner_is_gone(Owner { node: name.to_owned(), incarnation }, now);
        }
    }

    /// The rooms of an owner are to be claimed.
    pub(super) fn owner_is_gone(&mut self, owner: Owner, now: Time) {
        let Some(codes) = self.rooms_of.get(&owner).cloned() else { return };
        self.missing.insert(owner, Missing::Gone(now));
        for code in codes {
            self.settle(&code, now);
        }
    }

    /// Watchers are not told that an entry has expired, so it is looked for, first by the nodes that are near.
    pub(super) fn look_for_silent_nodes(&mut self, now: Time) {
        let is_due = |silent: Time, looked_at: Time| silent > LEASE_TTL && now >= looked_at + RETRY;
        let silent = self.nodes.iter().filter_map(|(name, peer)| {
            let silent = now.saturating_sub(peer.heard_at);
            (*name != self.node.name && is_due(silent, peer.looked_at)).then_some((name, silent))
        });
        let looks = silent.filter(|(name, silent)| {
            let doublings = (*silent - LEASE_TTL).as_millis() / RETRY.as_millis();
            self.is_among_nearest(name, LOOKERS << doublings.min(20))
        });
        let names: Vec<String> = looks.map(|(name, _)| name.clone()).collect();
        for name in names {
            self.nodes.get_mut(&name).expect("just seen").looked_at = now;
            self.look(Key::Node(name));
        }
    }
}

fn all_of(name: &str) -> std::ops::RangeFrom<Owner> {
    Owner { node: name.to_owned(), incarnation: 0 }..
}
