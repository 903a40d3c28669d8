//! The node's own lease, and those of the others.

use super::state::Peer;
use super::{Action, Answer, Directory, HELD_FOR, LEASE_TTL, RENEW_EVERY, RETRY, Time};
use crate::fleet::entry::{Entry, Key, NodeEntry, Revision};
use jostle_protocol::is_origin;
use std::time::Duration;
use tracing::{info, warn};

impl Directory {
    /// Returns whether this node is registered.
    pub fn is_registered(&self) -> bool {
        self.membership.revision.is_some()
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
        self.membership.asked_at = Some(now);
        if self.membership.unsure {
            self.actions.push(Action::Look(key));
        } else {
            let expected = self.membership.revision.unwrap_or(0);
            self.actions.push(Action::Write(key, Entry::Node(self.entry()), expected));
        }
    }

    fn entry(&self) -> NodeEntry {
        NodeEntry {
            incarnation: self.node.incarnation,
            url: self.node.url.clone(),
            draining: self.draining,
            capacity: self.node.capacity,
            used: self.load.used,
            rooms_left: self.load.rooms_left,
            rooms: self.load.rooms.clone(),
        }
    }

    pub(super) fn lease_answered(&mut self, answer: Answer, now: Time) {
        if self.membership.has_left {
            self.membership.revision = None;
            return;
        }
        let Some(asked_at) = self.membership.asked_at.take() else { return };
        match answer {
            Answer::Done(revision) => {
                let is_new = self.membership.revision.replace(revision).is_none();
                self.membership.next_at = asked_at + RENEW_EVERY;
                self.actions.push(Action::Lease(self.node.incarnation, asked_at + HELD_FOR));
                if is_new {
                    info!(node = %self.node.name, "registered in the fleet");
                    self.heard_of(self.node.name.clone(), self.entry(), revision, now);
                    self.settle_all(now);
                }
            }
            Answer::Refused | Answer::Unknown => {
                self.membership.unsure = true;
                self.membership.next_at = if answer == Answer::Refused { now } else { now + RETRY };
            }
        }
    }

    /// The driver found this node's entry after a write that was refused or not answered.
    pub(super) fn lease_looked_up(&mut self, found: Option<(NodeEntry, Revision)>, now: Time) {
        self.membership.asked_at = None;
        self.membership.next_at = now;
        self.membership.unsure = false;
        match found {
            Some((entry, revision)) if entry.incarnation == self.node.incarnation => {
                self.membership.revision = Some(revision);
            }
            Some((entry, revision)) => {
                self.lose_lease();
                if !std::mem::replace(&mut self.membership.said_taken, true) {
                    warn!(
                        node = %self.node.name,
                        "a node of this name is registered; waiting until it leaves or its lease ends"
                    );
                }
                self.heard_of(self.node.name.clone(), entry, revision, now);
                self.membership.next_at = now + RETRY;
            }
            None => {
                self.lose_lease();
                self.node_is_gone(&self.node.name.clone(), now);
            }
        }
    }

    /// No answer came to a look.
    pub fn look_failed(&mut self, key: &Key, now: Time) {
        self.looks.remove(key);
        if matches!(key, Key::Node(name) if *name == self.node.name) {
            self.membership.asked_at = None;
            self.membership.next_at = now + RETRY;
        }
    }

    /// Removes this node's entry, so that the others need not wait for its end. It does not register again.
    pub fn leave(&mut self) {
        self.draining = true;
        self.membership.has_left = true;
        if let Some(revision) = self.membership.revision {
            self.actions.push(Action::Lease(self.node.incarnation, Duration::ZERO));
            self.actions.push(Action::Remove(Key::Node(self.node.name.clone()), revision));
        }
    }

    fn lose_lease(&mut self) {
        if self.membership.revision.take().is_some() {
            warn!(node = %self.node.name, "the lease is lost; rooms stand still until they are claimed again");
            self.node.incarnation = self.node.incarnation.wrapping_add(1);
            self.actions.push(Action::Lease(self.node.incarnation, Duration::ZERO));
        }
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
        let is_known =
            self.nodes.get(&name).is_some_and(|peer| peer.entry.incarnation == entry.incarnation);
        let peer = Peer { entry, revision, heard_at: now, looked_at: now, placed: 0 };
        self.nodes.insert(name, peer);
        if !is_known && self.has_synced {
            // Rooms of the incarnation before have lost their owner.
            self.settle_all(now);
        }
    }

    pub(super) fn node_is_gone(&mut self, name: &str, now: Time) {
        if let Some(peer) = self.nodes.remove(name) {
            if name != self.node.name {
                info!(node = %name, url = %peer.entry.url, "a node is gone");
            }
            if self.has_synced {
                self.settle_all(now);
            }
        }
    }

    /// Watchers are not told that an entry has expired, so it is looked for.
    pub(super) fn look_for_silent_nodes(&mut self, now: Time) {
        for (name, peer) in &mut self.nodes {
            let is_silent = now.saturating_sub(peer.heard_at) > LEASE_TTL;
            if *name != self.node.name && is_silent && now >= peer.looked_at + RETRY {
                peer.looked_at = now;
                self.actions.push(Action::Look(Key::Node(name.clone())));
            }
        }
    }
}
