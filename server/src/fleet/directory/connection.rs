//! The consequences of a new connection to the store. Requests of the connection before it get no answer any more, and
//! the store may have forgotten acknowledged writes: it lost its disk, or what was not synced when power failed.
//!
//! Two rules keep one owner for each room. A node claims no room of another before it has held its lease for
//! [`LEASE_TTL`], since the others may be about to connect as well. And it renews its lease only once every room that it
//! holds under this lease has an entry that names it; entries of rooms that it still played are written again.

use super::state::{Doubt, Operation, Phase};
use super::{Action, Directory, LEASE_TTL, RETRY, Time};
use crate::fleet::entry::Revision;
use std::time::Duration;
use tracing::warn;

impl Directory {
    /// A connection to the store was made, whose watchers are about to tell all entries. `may_have_forgotten` says
    /// that it need not be the store of the connection before, with everything that was acknowledged.
    pub fn connected(&mut self, may_have_forgotten: bool, now: Time) {
        self.connection.number += 1;
        self.connection.claims_from = now + LEASE_TTL;
        let is_exchange = |action: &Action| {
            matches!(action, Action::Write(..) | Action::Remove(..) | Action::Look(_))
        };
        self.actions.retain(|action| !is_exchange(action));
        self.looks.clear();
        self.missing.clear();
        for (code, operation) in &mut self.operations {
            *operation = Operation::Pause { until: now + RETRY };
            self.unsettled.insert(code.clone());
        }
        self.nodes_synced = false;
        self.rooms_synced = false;
        // A process that has just started knows of nothing that could be forgotten.
        if may_have_forgotten && self.connection.number > 1 {
            self.doubt(now);
        }
        self.look_for_own_entry(now);
    }

    /// Number of the present connection.
    pub fn connection(&self) -> u64 {
        self.connection.number
    }

    fn look_for_own_entry(&mut self, now: Time) {
        let membership = &mut self.membership;
        let was_asked = membership.asked_at.take().is_some();
        membership.may_be_written |= was_asked && !membership.is_looking;
        membership.is_looking = false;
        membership.unsure = membership.revision.is_some() || membership.may_be_written;
        membership.next_at = now;
        if membership.has_left {
            // The entry ends by itself.
            membership.revision = None;
        }
    }

    fn doubt(&mut self, now: Time) {
        // No node claims before that, so what was this node's at the doubt before still is.
        let doubts_go_on = now < self.connection.doubtful_until;
        self.connection.doubtful_until = self.connection.claims_from;
        self.connection.known_revision = Revision::MAX;
        self.connection.has_registered = false;
        self.membership.replaces = 0;
        self.removed.clear();
        self.nodes.values_mut().for_each(|peer| peer.revision = 0);
        self.entries.values_mut().for_each(|(_, revision)| *revision = 0);
        // Nothing is played of a room that was about to be given away, and another node may have it already.
        self.held.retain(|_, held| !matches!(held.phase, Phase::Parted | Phase::Failed(_)));
        let (lasts, incarnation) = (now < self.membership.held_until, self.node.incarnation);
        for held in self.held.values_mut() {
            let is_kept = lasts && held.incarnation == incarnation
                || doubts_go_on && held.doubt == Doubt::Kept;
            held.doubt = if is_kept { Doubt::Kept } else { Doubt::Lapsed };
        }
    }

    /// The watchers have told all entries of rooms; these were known before, and are not among them.
    pub(super) fn rooms_are_known(&mut self, absent: Vec<String>) {
        if self.connection.known_revision != Revision::MAX {
            return;
        }
        let revisions = self.entries.values().map(|(_, revision)| *revision);
        self.connection.known_revision = revisions.max().unwrap_or(0);
        if !absent.is_empty() {
            warn!(
                rooms = absent.len(),
                "the directory has forgotten rooms; those that are played are written again"
            );
        }
        self.connection.missed = absent.into_iter().collect();
    }

    /// Returns whether an entry was written since the store may have forgotten.
    pub(super) fn is_newer_than_known(&self, revision: Revision) -> bool {
        revision > self.connection.known_revision
    }

    /// Returns whether an entry that names this node was written since the store may have forgotten.
    pub(super) fn is_of_this_store(&self, revision: Revision) -> bool {
        self.connection.has_registered || self.is_newer_than_known(revision)
    }

    /// Returns whether the lease must not be renewed yet: rooms would be played under it that may be another node's.
    pub(super) fn has_doubts(&self) -> bool {
        let incarnation = self.node.incarnation;
        self.held.values().any(|held| held.doubt != Doubt::None && held.incarnation == incarnation)
    }

    /// Returns whether the entry of a held room may be written again.
    pub(super) fn may_take_back(&self, doubt: Doubt, now: Time) -> bool {
        doubt != Doubt::Lapsed || now >= self.connection.doubtful_until
    }

    /// The lease was renewed by a write that was sent at this time.
    pub(super) fn lease_lasts(&mut self, until: Time, now: Time) {
        // The others may have been without the store as well, and are about to come back.
        if now >= self.membership.held_until {
            self.connection.claims_from = self.connection.claims_from.max(now + LEASE_TTL);
        }
        self.membership.held_until = until;
        self.actions.push(Action::Lease(self.node.incarnation, until));
    }

    /// The lease is over.
    pub(super) fn lease_is_over(&mut self) {
        self.membership.held_until = Duration::ZERO;
        self.actions.push(Action::Lease(self.node.incarnation, Duration::ZERO));
    }
}
