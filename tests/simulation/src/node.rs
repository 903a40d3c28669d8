//! A simulated node: its directory, its clock and its rooms.

use super::queue::{NodeEvent, Process, Request};
use jostle_server::fleet::directory::Directory;
use std::collections::BTreeMap;
use std::time::Duration;

/// A running process of a node.
#[derive(Debug)]
pub struct Node {
    pub process: Process,
    /// Its part in the fleet.
    pub directory: Directory,
    pub born: Duration,
    /// Seconds of its clock a second.
    pub rate: f64,
    /// The newest lease: an incarnation, and its end by the clock of the node.
    pub lease: (u64, Duration),
    /// Its rooms, by code.
    pub rooms: BTreeMap<String, PlayedRoom>,
    /// Requests without an answer, by number.
    pub requests: BTreeMap<u64, Request>,
    pub watch: Watch,
    /// Times that the store had forgotten something when the node connected to it.
    pub store: u64,
    /// Whether it is cut off from the store.
    pub is_cut: bool,
    /// How it stands still.
    pub standstill: Option<Standstill>,
    /// What is due as soon as it goes on.
    pub backlog: Vec<NodeEvent>,
    /// Whether it drains.
    pub draining: bool,
    /// Whether it has left the fleet.
    pub left: bool,
    /// When it measures its load next.
    pub measures_at: Duration,
    /// The rooms that ended here, and their epochs.
    pub ended: BTreeMap<String, u64>,
}

/// How a node stands still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standstill {
    Directory,
    /// Its rooms too.
    Whole,
}

/// A room at a node.
#[derive(Clone, Debug)]
pub struct PlayedRoom {
    /// Number of this opened room; no other has it.
    pub number: u64,
    /// The epoch of the entry.
    pub epoch: u64,
    /// The incarnation under which it is held.
    pub held_under: u64,
    /// How far it is.
    pub state: RoomState,
    /// Number of the last record that it knows.
    pub last: u64,
}

/// How far a room is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomState {
    /// It reads its records.
    Opening,
    /// It is played, if the lease allows it.
    Playing,
    /// It writes its last record.
    Parting,
}

/// The two watchers of a node.
#[derive(Debug, Default)]
pub struct Watch {
    /// Grows with every new pair of watchers.
    pub round: u32,
    /// Number of the next write of each bucket that is to be delivered, once it has begun.
    pub next: [Option<u64>; 2],
    /// Whether a delivery is on its way.
    pub pending: [bool; 2],
}

impl Node {
    /// The time of its clock.
    pub fn clock(&self, now: Duration) -> Duration {
        (now - self.born).mul_f64(self.rate)
    }

    /// The time at which its clock will have gone on by this much.
    pub fn after(&self, now: Duration, own: Duration) -> Duration {
        now + own.div_f64(self.rate)
    }

    /// Whether a room is played at this moment.
    pub fn plays(&self, code: &str, now: Duration, ignores_lease: bool) -> bool {
        let Some(room) = self.rooms.get(code) else { return false };
        let (incarnation, until) = self.lease;
        let leased = room.held_under == incarnation && self.clock(now) < until;
        room.state != RoomState::Opening
            && self.standstill != Some(Standstill::Whole)
            && (leased || ignores_lease)
    }

    /// The room of this code, if it is still this one.
    pub fn room(&mut self, code: &str, number: u64) -> Option<&mut PlayedRoom> {
        self.rooms.get_mut(code).filter(|room| room.number == number)
    }
}
