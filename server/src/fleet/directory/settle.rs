//! What follows from a room's entry for this node.

use super::state::{Doubt, Held, Operation, Phase};
use super::{Action, CLAIM_STEP, Directory, ROOMS_PER_PARTING, Time};
use crate::fleet::entry::Owner;

impl Directory {
    /// Compares a room's entry with what this node does, and begins what is to be done.
    pub(super) fn settle(&mut self, code: &str, now: Time) {
        if let Some(Operation::Pause { until }) = self.operations.get(code) {
            if now < *until {
                self.unsettled.insert(code.to_owned());
            } else {
                self.operations.remove(code);
            }
        }
        if !self.rooms_synced {
            self.unsettled.insert(code.to_owned());
            return;
        }
        let held = self.held.get(code).cloned();
        let owner = self.entries.get(code).map(|(entry, _)| entry.owner.clone());
        match (owner, held) {
            (None, None) => {}
            (None, Some(held)) if held.phase == Phase::Over => {
                self.held.remove(code);
            }
            (None, Some(held)) if held.doubt == Doubt::None => self.stop(code),
            (None, Some(held)) => self.take_back(code, held.doubt, now),
            (Some(owner), None) if self.is_me(&owner) => self.open(code, now),
            (Some(owner), None) => self.claim_if_lost(code, &owner, now),
            (Some(_), Some(held)) => self.settle_held(code, held, now),
        }
    }

    /// Opens a room whose entry names this node. An entry that may have been written over before the store forgot it
    /// has to be written again first, when no other node can play the room any more.
    fn open(&mut self, code: &str, now: Time) {
        let Some((entry, revision)) = self.entries.get(code).cloned() else { return };
        let is_outdated = self.newer_epochs.get(code).is_some_and(|epoch| *epoch > entry.epoch);
        let is_new = self.is_of_this_store(revision);
        if self.operations.contains_key(code) {
            self.unsettled.insert(code.to_owned());
        } else if is_outdated || !is_new {
            let doubt = if is_new { Doubt::None } else { Doubt::Lapsed };
            self.take_back(code, doubt, now);
        } else {
            let incarnation = entry.owner.incarnation;
            let (epoch, room) = (entry.epoch, entry.room.clone());
            let phase = Phase::Opening;
            let held = Held { epoch, phase, room, incarnation, doubt: Doubt::None };
            self.held.insert(code.to_owned(), held);
            self.actions.push(Action::Open(code.to_owned(), entry));
        }
    }

    /// Writes an entry that names this node, once it may.
    fn take_back(&mut self, code: &str, doubt: Doubt, now: Time) {
        let may_write = self.is_confirmed() && !self.operations.contains_key(code);
        if may_write && self.may_take_back(doubt, now) {
            self.give(code, self.me());
        } else {
            self.unsettled.insert(code.to_owned());
        }
    }

    fn settle_held(&mut self, code: &str, held: Held, now: Time) {
        let Some((entry, revision)) = self.entries.get(code).cloned() else { return };
        let (is_own, is_me) = (entry.owner.node == self.node.name, self.is_me(&entry.owner));
        if is_me && entry.epoch == held.epoch + 1 {
            // Claimed again after the lease was lost, and no other node had it in between.
            let incarnation = entry.owner.incarnation;
            let held = Held { epoch: entry.epoch, incarnation, doubt: Doubt::None, ..held };
            self.held.insert(code.to_owned(), held);
            self.actions.push(Action::Resume(code.to_owned()));
            return self.settle(code, now);
        }
        // An entry that was written since is that of a node which may play the room.
        let is_behind = entry.epoch < held.epoch && !self.is_newer_than_known(revision);
        if is_behind && held.doubt == Doubt::Kept {
            return self.take_back(code, held.doubt, now);
        }
        let is_another = is_me && entry.owner.incarnation != held.incarnation;
        if !is_own || is_another || entry.epoch != held.epoch {
            self.stop(code);
            // It may have come back since.
            return self.settle(code, now);
        }
        let may_go_on = match held.doubt {
            Doubt::None => self.is_registered(),
            Doubt::Kept | Doubt::Lapsed => self.is_confirmed(),
        };
        if self.operations.contains_key(code) || !may_go_on {
            self.unsettled.insert(code.to_owned());
            return;
        }
        if !is_me {
            return self.take_back(code, held.doubt, now);
        }
        self.held.get_mut(code).expect("held").doubt = Doubt::None;
        self.go_on_with(code, held.phase, now);
    }

    /// Rooms part one after another: the players of one have moved before those of the next have to.
    fn may_part(&self) -> bool {
        let parts = |held: &&Held| matches!(held.phase, Phase::Parting | Phase::Parted);
        self.held.values().filter(parts).count() <= self.held.len() / ROOMS_PER_PARTING
    }

    fn go_on_with(&mut self, code: &str, phase: Phase, now: Time) {
        let other = |directory: &Directory| directory.roomiest(|name| name != directory.node.name);
        match phase {
            Phase::Over => self.remove(code),
            Phase::Playing if self.draining && self.may_part() && other(self).is_some() => {
                self.held.get_mut(code).expect("held").phase = Phase::Parting;
                self.actions.push(Action::Part(code.to_owned()));
            }
            Phase::Failed(until) if now < until => {
                self.unsettled.insert(code.to_owned());
            }
            Phase::Parted | Phase::Failed(_) => match other(self) {
                Some(owner) => {
                    if let Some(peer) = self.nodes.get_mut(&owner.node) {
                        peer.placed += 1;
                    }
                    self.give(code, owner);
                }
                // No other node has room, so this one has to go on with it.
                None => {
                    self.stop(code);
                    self.unsettled.insert(code.to_owned());
                }
            },
            Phase::Playing if self.draining => {
                self.unsettled.insert(code.to_owned());
            }
            Phase::Opening | Phase::Playing | Phase::Parting => {}
        }
    }

    /// Claims a room whose node is gone, when it is this node's turn.
    fn claim_if_lost(&mut self, code: &str, owner: &Owner, now: Time) {
        if !self.has_synced() || self.peer_of(owner).is_some() {
            return;
        }
        self.unsettled.insert(code.to_owned());
        let Some(since) = self.gone_since(owner, now) else { return };
        let since = since.max(self.connection.claims_from);
        if now < since
            || self.draining
            || !self.is_registered()
            || self.operations.contains_key(code)
        {
            return;
        }
        let attempts = (now - since).as_millis() / CLAIM_STEP.as_millis() + 1;
        if self.may_claim(code, attempts as usize) {
            let me = self.me();
            if let Some(peer) = self.nodes.get_mut(&me.node) {
                peer.placed += 1;
            }
            self.give(code, me);
        }
    }
}
