//! The node's own lease, and those of the others.

use super::state::Peer;
use super::{Action, Answer, Directory, HELD_FOR, RENEW_EVERY, RETRY, Time};
use crate::fleet::entry::{Entry, Key, NodeEntry, Owner, Revision};
use jostle_protocol::is_origin;
use tracing::{info, warn};

impl Directory {
    /// Returns whether this node is registered.
    pub fn is_registered(&self) -> bool {
        self.membership.revision.is_some()
    }

    /// Returns whether the store was found to have the entry of this incarnation.
    pub(super) fn is_confirmed(&self) -> bool {
        self.is_registered() && !self.membership.unsure
    }

    pub(super) fn renew_at(&mut self, at: Time) {
        self.membership.next_at = self.membership.next_at.min(at);
    }

    pub(super) fn poll_lease(&mut self, now: Time) {
        let membership = &self.membership;
        if membership.has_left || membership.asked_at.is_some() || now < membership.next_at {
            return;
        }
        let key = Key::Node(self.node.name.clone());
        if membership.unsure {
            // A look that is on its way already may have been answered before the write.
            self.membership.is_looking = self.look(key);
            self.membership.asked_at = self.membership.is_looking.then_some(now);
        } else if membership.revision.is_none() || !self.has_doubts() {
            let expected = membership.revision.unwrap_or(membership.replaces);
            self.actions.push(Action::Write(key, Entry::Node(self.entry()), expected));
            self.membership.asked_at = Some(now);
        }
    }

    /// Removes this node's entry, so that the others need not wait for its end. Rooms that it still plays stand
    /// still from now on. It does not register again.
    pub fn leave(&mut self) {
        self.draining = true;
        self.membership.has_left = true;
        self.lease_is_over();
        // Otherwise the revision is not known yet.
        if self.membership.asked_at.is_none() {
            self.remove_entry(self.membership.revision);
        }
    }

    /// Until that is answered, the node counts as registered.
    fn remove_entry(&mut self, revision: Option<Revision>) {
        self.membership.revision = revision;
        let key = Key::Node(self.node.name.clone());
        self.actions.extend(revision.map(|revision| Action::Remove(key, revision)));
    }

    fn entry(&self) -> NodeEntry {
        NodeEntry {
            incarnation: self.node.incarnation,
            url: self.node.url.clone(),
            draining: self.draining,
            capacity: self.node.capacity,
            used: self.load.used,
            rooms_left: self.load.rooms_left,
            secret_mark: Some(self.node.secret_mark),
            rooms: self.load.rooms.clone(),
        }
    }

    pub(super) fn lease_answered(&mut self, answer: Answer, now: Time) {
        let asked_at = self.membership.asked_at.take();
        if self.membership.has_left {
            return match (answer, asked_at) {
                (Answer::Done(revision), Some(_)) => self.remove_entry(Some(revision)),
                _ => self.membership.revision = None,
            };
        }
        let Some(asked_at) = asked_at else { return };
        match answer {
            Answer::Done(revision) => {
                let is_new = self.membership.revision.replace(revision).is_none();
                self.membership.next_at = asked_at + RENEW_EVERY;
                self.lease_lasts(asked_at + HELD_FOR, now);
                if is_new {
                    self.connection.has_registered = true;
                    info!(node = %self.node.name, "registered in the fleet");
                }
                if self.peer_of(&self.me()).is_none() {
                    self.heard_of(self.node.name.clone(), self.entry(), revision, now);
                }
            }
            Answer::Refused | Answer::Unknown => {
                self.membership.unsure = true;
                self.membership.may_be_written |= answer == Answer::Unknown;
                self.membership.next_at = if answer == Answer::Refused { now } else { now + RETRY };
            }
        }
    }

    /// The driver found this node's entry after a write that was refused or not answered.
    pub(super) fn lease_looked_up(&mut self, found: Option<(NodeEntry, Revision)>, now: Time) {
        self.membership.asked_at = None;
        self.membership.is_looking = false;
        self.membership.next_at = now;
        self.membership.unsure = false;
        let own = self.node.incarnation;
        if self.membership.has_left {
            let own = found.filter(|(entry, _)| entry.incarnation == own);
            return self.remove_entry(own.map(|(_, revision)| revision));
        }
        let Some((entry, revision)) = found else {
            self.lose_lease();
            self.membership.replaces = 0;
            return self.node_is_gone(&self.node.name.clone(), now);
        };
        if entry.incarnation == own {
            self.membership.revision = Some(revision);
            return;
        }
        self.lose_lease();
        let age = self.node.incarnation.wrapping_sub(entry.incarnation);
        if (1..=self.membership.lost).contains(&age) {
            // A write that was late. The rooms of that incarnation stand still.
            self.membership.replaces = revision;
        } else {
            self.membership.replaces = 0;
            self.membership.next_at = now + RETRY;
            if !std::mem::replace(&mut self.membership.said_taken, true) {
                warn!(
                    node = %self.node.name,
                    "a node of this name is registered; waiting until it leaves or its lease ends"
                );
            }
        }
        self.heard_of(self.node.name.clone(), entry, revision, now);
    }

    pub(super) fn lease_look_failed(&mut self, name: &str, now: Time) {
        if name == self.node.name && self.membership.is_looking {
            self.membership.is_looking = false;
            self.membership.asked_at = None;
            self.membership.next_at = now + RETRY;
            if self.membership.has_left {
                self.membership.revision = None;
            }
        }
    }

    /// The others may take this incarnation for gone by now: it is not used again, if any write of it was seen.
    fn lose_lease(&mut self) {
        let may_be_written = std::mem::take(&mut self.membership.may_be_written);
        if self.membership.revision.take().is_some() {
            warn!(node = %self.node.name, "the lease is lost; rooms stand still until they are claimed again");
        } else if !may_be_written {
            return;
        }
        self.membership.lost += 1;
        self.node.incarnation = self.node.incarnation.wrapping_add(1);
        self.lease_is_over();
        self.unsettled.extend(self.held.keys().cloned());
    }

    pub(super) fn heard_of(
        &mut self,
        name: String,
        entry: NodeEntry,
        revision: Revision,
        now: Time,
    ) {
        let is_old = self.nodes.get(&name).is_some_and(|peer| peer.revision >= revision);
        // Clients could not be sent an address that is none.
        if is_old || !is_origin(&entry.url) {
            return;
        }
        let incarnation = entry.incarnation;
        let peer = Peer { entry, revision, heard_at: now, looked_at: now, placed: 0 };
        if let Some(before) = self.nodes.insert(name.clone(), peer)
            && before.entry.incarnation != incarnation
        {
            let incarnation = before.entry.incarnation;
            self.owner_is_gone(Owner { node: name, incarnation }, now);
        }
    }
}
