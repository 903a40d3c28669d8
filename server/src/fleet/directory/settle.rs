//! What follows from a room's entry for this node.

use super::state::{Held, Operation, Phase};
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
        let held = self.held.get(code).cloned();
        let owner = self.entries.get(code).map(|(entry, _)| entry.owner.clone());
        match (owner, held) {
            (None, None) => {}
            (None, Some(held)) if held.phase == Phase::Over => {
                self.held.remove(code);
            }
            (None, Some(_)) => self.stop(code),
            (Some(owner), None) if self.is_me(&owner) => self.open(code),
            (Some(owner), None) => self.claim_if_lost(code, &owner, now),
            (Some(_), Some(held)) => self.settle_held(code, &held, now),
        }
    }

    fn open(&mut self, code: &str) {
        if self.operations.contains_key(code) {
            self.unsettled.insert(code.to_owned());
            return;
        }
        let Some((entry, _)) = self.entries.get(code).cloned() else { return };
        self.held.insert(code.to_owned(), Held { epoch: entry.epoch, phase: Phase::Opening });
        self.actions.push(Action::Open(code.to_owned(), entry));
    }

    fn settle_held(&mut self, code: &str, held: &Held, now: Time) {
        let Some((entry, _)) = self.entries.get(code).cloned() else { return };
        let is_own = entry.owner.node == self.node.name;
        if is_own && self.is_me(&entry.owner) && entry.epoch == held.epoch + 1 {
            // Claimed again after the lease was lost, and no other node had it in between.
            self.held.insert(code.to_owned(), Held { epoch: entry.epoch, ..held.clone() });
            self.actions.push(Action::Resume(code.to_owned()));
            return self.settle(code, now);
        }
        if !is_own || entry.epoch != held.epoch {
            self.stop(code);
            // It may have come back since.
            return self.settle(code, now);
        }
        if self.operations.contains_key(code) || !self.is_registered() {
            self.unsettled.insert(code.to_owned());
            return;
        }
        if !self.is_me(&entry.owner) {
            return self.give(code, self.me());
        }
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
        if self.draining || !self.is_registered() || self.operations.contains_key(code) {
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
