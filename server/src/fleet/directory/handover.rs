//! The rooms that this node holds, takes over and hands over. Whenever something changes, a room's entry is compared
//! with the room's state on this node, and that comparison alone determines the next step.

use super::members::Members;
use super::placements::Placements;
use super::terms::{Action, CLAIM_STEP, RETRY, ROOMS_PER_PARTING, Requests, RoomEvent, Time};
use crate::fleet::entry::{Entry, Key, Owner, Revision, RoomEntry, RoomFacts};
use std::collections::{BTreeMap, BTreeSet};

/// The rooms that this node holds, takes over or hands over.
#[derive(Debug, Default)]
pub struct Handover {
    held: BTreeMap<String, Held>,
    operations: BTreeMap<String, Operation>,
    /// Rooms whose entries need comparing again.
    pub due: BTreeSet<String>,
}

/// The parts of the directory that a decision about a room depends on, apart from the room's own state, and the queue
/// for the resulting requests.
pub struct Surroundings<'a> {
    pub members: &'a mut Members,
    pub placements: &'a mut Placements,
    pub requests: &'a mut Requests,
    pub now: Time,
}

/// A room whose entry names this node.
#[derive(Clone, Debug)]
struct Held {
    /// The epoch in the room's entry.
    epoch: u64,
    /// The room's progress on this node.
    phase: Phase,
    /// The facts about the room.
    room: RoomFacts,
    /// The incarnation of this node that holds the room.
    incarnation: u64,
    /// Whether the store may have forgotten that this node holds the room.
    doubt: Doubt,
}

/// Doubt about whether a held room still belongs to this node, when the store may have forgotten writes. It is resolved
/// by an entry that names this node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Doubt {
    None,
    /// The lease was still valid when the store came back. No other node has claimed the room, so this node rewrites
    /// its entry.
    Kept,
    /// The lease had expired. Another node may be playing the room, and the store may have forgotten that.
    Lapsed,
}

/// A held room's phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The driver is reading the room's records and starting its thread.
    Opening,
    /// The room could not be opened; another node should try at this time.
    Failed(Time),
    /// The room is being played, or is paused because there is no valid lease.
    Playing,
    /// The room is about to end on this node, leaving a final record of its state.
    Parting,
    /// The room's final record has been written; its entry must now name another node.
    Parted,
    /// The room is over; its entry must be removed.
    Over,
}

/// A write in progress to a room's entry.
#[derive(Clone, Debug)]
pub enum Operation {
    /// A new entry, or a change of owner by a claim or a handover.
    Change { to: RoomEntry },
    /// The removal of an entry because the room is over.
    Remove { revision: Revision },
    /// A pause until this time after a failed write.
    Pause { until: Time },
}

impl Handover {
    /// The rooms that this node is playing, handing over or opening.
    pub fn rooms(&self) -> impl ExactSizeIterator<Item = &String> {
        self.held.keys()
    }

    /// Returns whether this node holds a room in this or a later epoch.
    pub fn holds_epoch(&self, code: &str, epoch: u64) -> bool {
        self.held.get(code).is_some_and(|held| held.epoch >= epoch)
    }

    pub fn plays(&self, code: &str) -> bool {
        self.held.get(code).is_some_and(|held| held.phase == Phase::Playing)
    }

    /// Returns whether this node holds a room or is writing its entry.
    pub fn is_busy_with(&self, code: &str) -> bool {
        self.held.contains_key(code) || self.operations.contains_key(code)
    }

    /// Returns whether the lease must not be renewed yet, because this node might then play rooms that belong to
    /// another.
    pub fn has_doubts(&self, incarnation: u64) -> bool {
        self.held.values().any(|held| held.doubt != Doubt::None && held.incarnation == incarnation)
    }

    /// Called on a new connection: writes that were in progress will no longer be answered.
    pub fn connected(&mut self, now: Time) {
        for (code, operation) in &mut self.operations {
            *operation = Operation::Pause { until: now + RETRY };
            self.due.insert(code.clone());
        }
    }

    /// Called when the store may have forgotten entries. `leased` is the incarnation whose lease is valid. While doubts
    /// remain, no node claims rooms, so rooms that belonged to this node when the previous doubt arose still do.
    pub fn doubt(&mut self, leased: Option<u64>, doubts_go_on: bool) {
        // A room being handed over is not played here, and may already belong to another node.
        self.held.retain(|_, held| !matches!(held.phase, Phase::Parted | Phase::Failed(_)));
        for held in self.held.values_mut() {
            let is_kept =
                leased == Some(held.incarnation) || doubts_go_on && held.doubt == Doubt::Kept;
            held.doubt = if is_kept { Doubt::Kept } else { Doubt::Lapsed };
        }
    }

    /// Called when the lease has been lost: all rooms must be compared again.
    pub fn lease_lost(&mut self) {
        self.due.extend(self.held.keys().cloned());
    }

    /// Handles an event of a room that this node holds.
    pub fn on(&mut self, code: &str, event: RoomEvent, around: &mut Surroundings) {
        let Some(held) = self.held.get_mut(code) else { return };
        held.phase = match (event, held.phase) {
            (RoomEvent::Opened, Phase::Opening) => Phase::Playing,
            (RoomEvent::Parted, Phase::Parting) => Phase::Parted,
            (RoomEvent::Opened | RoomEvent::Parted, _) => return,
            (RoomEvent::OpenFailed, _) => Phase::Failed(around.now + 10 * RETRY),
            (RoomEvent::Ended, _) => Phase::Over,
            (RoomEvent::Fenced, _) => {
                self.stop(code, around);
                return self.ask_again(code, around);
            }
        };
        self.compare(code, around);
    }

    /// Ends the write in progress for a room, and returns it.
    pub fn answered(&mut self, code: &str) -> Option<Operation> {
        self.operations.remove(code)
    }

    /// Looks up a room's entry, which may have changed, and waits a moment before the next step.
    pub fn ask_again(&mut self, code: &str, around: &mut Surroundings) {
        around.placements.look_up(code, around.requests);
        let pause = Operation::Pause { until: around.now + RETRY };
        self.operations.entry(code.to_owned()).or_insert(pause);
        self.compare_later(code);
    }

    fn compare_later(&mut self, code: &str) {
        self.due.insert(code.to_owned());
    }

    /// Ends a room on this node because another node plays it.
    fn stop(&mut self, code: &str, around: &mut Surroundings) {
        let owner = around.placements.owner(code);
        let peer = owner.filter(|owner| !around.members.own.is(owner));
        let url = peer.and_then(|owner| Some(around.members.entry_of(owner)?.url.clone()));
        self.held.remove(code);
        around.requests.actions.push(Action::Stop(code.to_owned(), url));
    }

    /// Called when a room has been removed from the directory, which ends it here too. If this node was still playing
    /// the room when the store came back, the removal concerns an earlier room with the same code.
    pub fn removed(&mut self, code: &str, around: &mut Surroundings) {
        let held = self.held.get(code);
        if held.is_some_and(|held| held.phase != Phase::Over && held.doubt != Doubt::Kept) {
            self.stop(code, around);
        }
        self.compare(code, around);
    }

    /// Writes a room's entry if its revision is still the given one.
    pub fn write(
        &mut self,
        code: &str,
        to: RoomEntry,
        revision: Revision,
        requests: &mut Requests,
    ) {
        let (key, value) = (Key::Room(code.to_owned()), Entry::Room(to.clone()));
        requests.actions.push(Action::Write(key, value, revision));
        self.operations.insert(code.to_owned(), Operation::Change { to });
    }

    /// Writes an entry with this owner, if the entry has not changed in the meantime.
    fn assign(&mut self, code: &str, owner: Owner, around: &mut Surroundings) {
        let (known, held) = (around.placements.get(code), self.held.get(code));
        let Some(room) = known.map(|(entry, _)| &entry.room).or(held.map(|held| &held.room)) else {
            return;
        };
        let epoch = around.placements.next_epoch(code, held.map_or(0, |held| held.epoch));
        let to = RoomEntry { owner, epoch, room: room.clone() };
        self.write(code, to, known.map_or(0, |(_, revision)| *revision), around.requests);
    }

    /// Compares a room's entry with the room's state on this node, and takes the next step.
    pub fn compare(&mut self, code: &str, around: &mut Surroundings) {
        if let Some(Operation::Pause { until }) = self.operations.get(code) {
            if around.now < *until {
                self.compare_later(code);
            } else {
                self.operations.remove(code);
            }
        }
        if !around.placements.synced {
            return self.compare_later(code);
        }
        match (around.placements.owner(code).cloned(), self.held.get(code).cloned()) {
            (None, None) => {}
            (None, Some(held)) if held.phase == Phase::Over => {
                self.held.remove(code);
            }
            (None, Some(held)) if held.doubt == Doubt::None => self.stop(code, around),
            (None, Some(held)) => self.take_back(code, held.doubt, around),
            (Some(owner), None) if around.members.own.is(&owner) => self.open(code, around),
            (Some(owner), None) => self.claim_if_lost(code, &owner, around),
            (Some(_), Some(held)) => self.compare_held(code, held, around),
        }
    }

    /// Opens a room whose entry names this node. If the entry may be an old one to which the store reverted, it must
    /// first be rewritten, once no other node can be playing the room.
    fn open(&mut self, code: &str, around: &mut Surroundings) {
        let Some((entry, revision)) = around.placements.get(code).cloned() else { return };
        let is_new =
            around.members.own.has_registered || around.placements.is_newer_than_known(revision);
        if self.operations.contains_key(code) {
            self.compare_later(code);
        } else if around.placements.is_outdated(code, entry.epoch) || !is_new {
            let doubt = if is_new { Doubt::None } else { Doubt::Lapsed };
            self.take_back(code, doubt, around);
        } else {
            let held = Held {
                epoch: entry.epoch,
                phase: Phase::Opening,
                room: entry.room.clone(),
                incarnation: entry.owner.incarnation,
                doubt: Doubt::None,
            };
            self.held.insert(code.to_owned(), held);
            around.requests.actions.push(Action::Open(code.to_owned(), entry));
        }
    }

    /// Writes an entry that names this node as soon as that is allowed.
    fn take_back(&mut self, code: &str, doubt: Doubt, around: &mut Surroundings) {
        let is_free = around.members.own.is_confirmed() && !self.operations.contains_key(code);
        if is_free && (doubt != Doubt::Lapsed || !around.placements.is_doubtful(around.now)) {
            self.assign(code, around.members.own.owner(), around);
        } else {
            self.compare_later(code);
        }
    }

    fn compare_held(&mut self, code: &str, held: Held, around: &mut Surroundings) {
        let Some((entry, revision)) = around.placements.get(code).cloned() else { return };
        let own = &around.members.own;
        let (is_own, is_me) = (entry.owner.node == own.node.name, own.is(&entry.owner));
        if is_me && entry.epoch == held.epoch + 1 {
            // The room was claimed again after the lease was lost, and belonged to no other node in between.
            let incarnation = entry.owner.incarnation;
            let held = Held { epoch: entry.epoch, incarnation, doubt: Doubt::None, ..held };
            self.held.insert(code.to_owned(), held);
            around.requests.actions.push(Action::Resume(code.to_owned()));
            return self.compare(code, around);
        }
        // An entry written after the store came back comes from a node that may be playing the room.
        let is_behind =
            entry.epoch < held.epoch && !around.placements.is_newer_than_known(revision);
        if is_behind && held.doubt == Doubt::Kept {
            return self.take_back(code, held.doubt, around);
        }
        let is_another = is_me && entry.owner.incarnation != held.incarnation;
        if !is_own || is_another || entry.epoch != held.epoch {
            self.stop(code, around);
            // The room may have come back in the meantime.
            return self.compare(code, around);
        }
        let may_go_on = match held.doubt {
            Doubt::None => own.is_registered(),
            Doubt::Kept | Doubt::Lapsed => own.is_confirmed(),
        };
        if self.operations.contains_key(code) || !may_go_on {
            return self.compare_later(code);
        }
        if !is_me {
            return self.take_back(code, held.doubt, around);
        }
        self.held.get_mut(code).expect("held").doubt = Doubt::None;
        self.go_on_with(code, held.phase, around);
    }

    /// Rooms are handed over one by one, so that one room's players have moved before the next room's must.
    fn may_part(&self) -> bool {
        let parts = |held: &&Held| matches!(held.phase, Phase::Parting | Phase::Parted);
        self.held.values().filter(parts).count() <= self.held.len() / ROOMS_PER_PARTING
    }

    fn go_on_with(&mut self, code: &str, phase: Phase, around: &mut Surroundings) {
        let draining = around.members.own.draining;
        match phase {
            Phase::Over => {
                if let Some(revision) = around.placements.revision(code) {
                    around
                        .requests
                        .actions
                        .push(Action::Remove(Key::Room(code.to_owned()), revision));
                    self.operations.insert(code.to_owned(), Operation::Remove { revision });
                }
            }
            Phase::Playing
                if draining && self.may_part() && around.members.roomiest_other().is_some() =>
            {
                self.held.get_mut(code).expect("held").phase = Phase::Parting;
                around.requests.actions.push(Action::Part(code.to_owned()));
            }
            Phase::Failed(until) if around.now < until => self.compare_later(code),
            Phase::Parted | Phase::Failed(_) => match around.members.roomiest_other() {
                Some(owner) => {
                    around.members.reserve(&owner);
                    self.assign(code, owner, around);
                }
                // No other node has capacity, so this one has to keep the room.
                None => {
                    self.stop(code, around);
                    self.compare_later(code);
                }
            },
            Phase::Playing if draining => self.compare_later(code),
            Phase::Opening | Phase::Playing | Phase::Parting => {}
        }
    }

    /// Claims a room whose node is gone, if it is this node's turn to try.
    fn claim_if_lost(&mut self, code: &str, owner: &Owner, around: &mut Surroundings) {
        let (members, now) = (&mut *around.members, around.now);
        if !members.synced || members.entry_of(owner).is_some() {
            return;
        }
        self.compare_later(code);
        let Some(since) = members.gone_since(owner, around.requests, now) else { return };
        let since = since.max(members.own.claims_from);
        if now < since
            || members.own.draining
            || !members.own.is_registered()
            || self.operations.contains_key(code)
        {
            return;
        }
        let attempts = (now - since).as_millis() / CLAIM_STEP.as_millis() + 1;
        if members.may_claim(code, attempts as usize) {
            let me = members.own.owner();
            members.reserve(&me);
            self.assign(code, me, around);
        }
    }
}
