//! The node's own entry, and the lease that the entry represents.

use super::terms::{
    Action, Answer, HELD_FOR, LEASE_TTL, Load, NodeSettings, RENEW_EVERY, RETRY, Requests, Time,
};
use crate::fleet::entry::{Entry, Key, NodeEntry, Owner, Revision};
use std::time::Duration;
use tracing::{info, warn};

/// This node's membership of the fleet.
#[derive(Debug, Default)]
pub struct Membership {
    pub node: NodeSettings,
    pub load: Load,
    /// Whether all rooms should be handed over.
    pub draining: bool,
    /// Time from which this node may claim other nodes' rooms.
    pub claims_from: Time,
    /// Whether the current incarnation has registered since the store may last have forgotten writes.
    pub has_registered: bool,
    /// Revision of the node's entry; `None` if it has no entry.
    revision: Option<Revision>,
    /// If there is no entry, the revision that the next write may replace: 0, or the revision of an earlier
    /// incarnation's entry.
    replaces: Revision,
    /// Whether a write by the current incarnation went unanswered.
    may_be_written: bool,
    /// Number of earlier incarnations in this process.
    lost: u64,
    /// Whether the revision may have changed in the meantime.
    unsure: bool,
    exchange: Exchange,
    /// Time at which the lease ends.
    held_until: Time,
    /// Whether the log already mentions that the name is taken.
    said_taken: bool,
    /// Whether the node has left permanently.
    has_left: bool,
}

/// The exchange with the store about the node's entry.
#[derive(Debug, Default)]
struct Exchange {
    /// Time at which the current write or lookup was sent.
    asked_at: Option<Time>,
    /// Whether the current request is a lookup.
    is_looking: bool,
    /// Time of the next write or lookup.
    next_at: Time,
}

impl Membership {
    /// This node in its current incarnation.
    pub fn owner(&self) -> Owner {
        Owner { node: self.node.name.clone(), incarnation: self.node.incarnation }
    }

    pub fn is(&self, owner: &Owner) -> bool {
        owner.node == self.node.name && owner.incarnation == self.node.incarnation
    }

    /// Returns whether this node is registered.
    pub fn is_registered(&self) -> bool {
        self.revision.is_some()
    }

    /// Returns whether the store is known to have an entry of this incarnation.
    pub fn is_confirmed(&self) -> bool {
        self.is_registered() && !self.unsure
    }

    /// Returns whether a lookup of this name is this node checking its own entry after a write that was refused or went
    /// unanswered.
    pub fn looks_for(&self, name: &str) -> bool {
        name == self.node.name && self.exchange.is_looking
    }

    /// The incarnation with a valid lease.
    pub fn leased(&self, now: Time) -> Option<u64> {
        (now < self.held_until).then_some(self.node.incarnation)
    }

    /// Hands over all rooms, and accepts no new ones.
    pub fn drain(&mut self, now: Time) {
        self.draining = true;
        self.exchange.next_at = self.exchange.next_at.min(now);
    }

    /// Called when a connection has been made; the store may no longer have the entry.
    pub fn connected(&mut self, may_have_forgotten: bool, now: Time) {
        self.claims_from = now + LEASE_TTL;
        if may_have_forgotten {
            self.has_registered = false;
            self.replaces = 0;
        }
        let before =
            std::mem::replace(&mut self.exchange, Exchange { next_at: now, ..Exchange::default() });
        self.may_be_written |= before.asked_at.is_some() && !before.is_looking;
        self.unsure = self.revision.is_some() || self.may_be_written;
        if self.has_left {
            // The entry is left to expire.
            self.revision = None;
        }
    }

    /// Renews the lease if a renewal is due and `may_renew` allows it. `known` is the revision that watchers reported.
    pub fn poll(
        &mut self,
        known: Option<Revision>,
        may_renew: impl FnOnce(u64) -> bool,
        out: &mut Requests,
        now: Time,
    ) {
        if self.has_left || self.exchange.asked_at.is_some() || now < self.exchange.next_at {
            return;
        }
        let key = Key::Node(self.node.name.clone());
        if self.unsure {
            // A lookup that is already in progress may have been answered before the write.
            self.exchange.is_looking = out.look_up(key, known);
            self.exchange.asked_at = self.exchange.is_looking.then_some(now);
        } else if self.revision.is_none() || may_renew(self.node.incarnation) {
            let expected = self.revision.unwrap_or(self.replaces);
            out.actions.push(Action::Write(key, Entry::Node(self.entry()), expected));
            self.exchange.asked_at = Some(now);
        }
    }

    /// Removes this node's entry. Any rooms that it is still playing pause, and the node does not register again.
    pub fn leave(&mut self, out: &mut Requests) {
        self.draining = true;
        self.has_left = true;
        self.end_lease(out);
        // If a request is in progress, the revision is not known yet.
        if self.exchange.asked_at.is_none() {
            self.remove_entry(self.revision, out);
        }
    }

    /// The node counts as registered until the removal is answered.
    fn remove_entry(&mut self, revision: Option<Revision>, out: &mut Requests) {
        self.revision = revision;
        if let Some(revision) = revision {
            out.actions.push(Action::Remove(Key::Node(self.node.name.clone()), revision));
        }
    }

    /// The entry to write next.
    pub fn entry(&self) -> NodeEntry {
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

    /// Handles the answer to a write or removal of the entry. Returns its new revision if the lease was renewed.
    pub fn answered(&mut self, answer: Answer, out: &mut Requests, now: Time) -> Option<Revision> {
        let asked_at = self.exchange.asked_at.take();
        if self.has_left {
            match (answer, asked_at) {
                (Answer::Done(revision), Some(_)) => self.remove_entry(Some(revision), out),
                _ => self.revision = None,
            }
            return None;
        }
        let asked_at = asked_at?;
        let Answer::Done(revision) = answer else {
            self.unsure = true;
            self.may_be_written |= answer == Answer::Unknown;
            self.exchange.next_at = if answer == Answer::Refused { now } else { now + RETRY };
            return None;
        };
        let is_new = self.revision.replace(revision).is_none();
        self.exchange.next_at = asked_at + RENEW_EVERY;
        // The other nodes may have lost the store too, and be about to reconnect.
        if now >= self.held_until {
            self.claims_from = self.claims_from.max(now + LEASE_TTL);
        }
        self.held_until = asked_at + HELD_FOR;
        out.actions.push(Action::Lease(self.node.incarnation, self.held_until));
        if is_new {
            self.has_registered = true;
            info!(node = %self.node.name, "registered in the fleet");
        }
        Some(revision)
    }

    /// Handles the entry that the store holds under this node's name. Returns whether this incarnation has lost its
    /// entry.
    pub fn looked_up(
        &mut self,
        found: Option<&(NodeEntry, Revision)>,
        out: &mut Requests,
        now: Time,
    ) -> bool {
        self.exchange = Exchange { next_at: now, ..Exchange::default() };
        self.unsure = false;
        let own = found.filter(|(entry, _)| entry.incarnation == self.node.incarnation);
        let own = own.map(|(_, revision)| *revision);
        if self.has_left {
            self.remove_entry(own, out);
            return false;
        }
        if own.is_some() {
            self.revision = own;
            return false;
        }
        self.lose_lease(out);
        self.replaces = 0;
        let Some((entry, revision)) = found else { return true };
        let age = self.node.incarnation.wrapping_sub(entry.incarnation);
        if (1..=self.lost).contains(&age) {
            // This is a delayed write by an earlier incarnation, whose rooms are paused.
            self.replaces = *revision;
        } else {
            self.exchange.next_at = now + RETRY;
            if !std::mem::replace(&mut self.said_taken, true) {
                warn!(
                    node = %self.node.name,
                    "a node of this name is registered; waiting until it leaves or its lease ends"
                );
            }
        }
        true
    }

    /// Called when a lookup of this node's own entry goes unanswered.
    pub fn look_failed(&mut self, now: Time) {
        self.exchange = Exchange { next_at: now + RETRY, ..Exchange::default() };
        if self.has_left {
            self.revision = None;
        }
    }

    /// The others may consider this incarnation gone. It is not used again if others may have seen one of its writes.
    fn lose_lease(&mut self, out: &mut Requests) {
        let may_be_written = std::mem::take(&mut self.may_be_written);
        if self.revision.take().is_some() {
            warn!(node = %self.node.name, "the lease is lost; rooms stand still until they are claimed again");
        } else if !may_be_written {
            return;
        }
        self.lost += 1;
        self.node.incarnation = self.node.incarnation.wrapping_add(1);
        self.end_lease(out);
    }

    fn end_lease(&mut self, out: &mut Requests) {
        self.held_until = Duration::ZERO;
        out.actions.push(Action::Lease(self.node.incarnation, Duration::ZERO));
    }
}
