//! A simulated node: its directory, its clock and its rooms.

use super::queue::{NodeEvent, Process, Request};
use jostle_server::fleet::directory::Directory;
use std::collections::BTreeMap;
use std::time::Duration;

/// A running process of a node.
#[derive(Debug)]
pub struct Node {
    pub process: Process,
    /// The node's directory.
    pub directory: Directory,
    pub born: Duration,
    /// Rate of the node's clock, in its own seconds per real second.
    pub rate: f64,
    /// The newest lease, as its incarnation and its end according to the node's clock.
    pub lease: (u64, Duration),
    /// The node's rooms, by code.
    pub rooms: BTreeMap<String, PlayedRoom>,
    /// Unanswered requests, by number.
    pub requests: BTreeMap<u64, Request>,
    pub watch: Watch,
    /// How many times the store had lost data when the node last connected to it.
    pub store: u64,
    /// Whether the node is cut off from the store.
    pub is_cut: bool,
    /// How the node is frozen, if at all.
    pub standstill: Option<Standstill>,
    /// Events to handle once the node resumes.
    pub backlog: Vec<NodeEvent>,
    /// Whether the node is draining.
    pub draining: bool,
    /// Whether the node has left the fleet.
    pub left: bool,
    /// When the node will next measure its load, by its own clock.
    pub measures_at: Duration,
    /// Rooms that ended at this node, with their epochs.
    pub ended: BTreeMap<String, u64>,
}

/// How a node is frozen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standstill {
    Directory,
    /// The whole process is frozen, including its rooms.
    Whole,
}

/// A room at a node.
#[derive(Clone, Debug)]
pub struct PlayedRoom {
    /// Number that uniquely identifies this opening of the room.
    pub number: u64,
    /// The epoch of the room's entry.
    pub epoch: u64,
    /// The incarnation of the lease under which the room is held.
    pub held_under: u64,
    /// The room's progress.
    pub state: RoomState,
    /// Number of the newest record that the room knows.
    pub last: u64,
}

/// The progress of a room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomState {
    /// The room is reading its records.
    Opening,
    /// The room is being played if the lease allows it.
    Playing,
    /// The room is writing its final record.
    Parting,
}

/// The two watchers of a node.
#[derive(Debug, Default)]
pub struct Watch {
    /// Incremented with every new pair of watchers.
    pub round: u32,
    /// Number of the next write to deliver from each bucket once its watcher has started.
    pub next: [Option<u64>; 2],
    /// Whether a delivery is scheduled.
    pub pending: [bool; 2],
}

impl Node {
    /// The time according to the node's clock.
    pub fn clock(&self, now: Duration) -> Duration {
        (now - self.born).mul_f64(self.rate)
    }

    /// The time when the node's clock will have advanced by `own`.
    pub fn after(&self, now: Duration, own: Duration) -> Duration {
        now + own.div_f64(self.rate)
    }

    /// Whether the node currently plays a room.
    pub fn plays(&self, code: &str, now: Duration, ignores_lease: bool) -> bool {
        let Some(room) = self.rooms.get(code) else { return false };
        let (incarnation, until) = self.lease;
        let leased = room.held_under == incarnation && self.clock(now) < until;
        room.state != RoomState::Opening
            && self.standstill != Some(Standstill::Whole)
            && (leased || ignores_lease)
    }

    /// The room with the given code, if it still has the given number.
    pub fn room(&mut self, code: &str, number: u64) -> Option<&mut PlayedRoom> {
        self.rooms.get_mut(code).filter(|room| room.number == number)
    }
}
