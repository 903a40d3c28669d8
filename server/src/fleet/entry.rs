//! The entries of the directory: small JSON values under the names of nodes and the codes of rooms. New fields have
//! defaults, so that nodes of two versions can share a directory.

use serde::{Deserialize, Serialize};
use std::net::IpAddr;

/// Revision of an entry: grows with every write of its bucket. 0 stands for no entry.
pub type Revision = u64;

/// A node, as long as its lease lasts. It writes its entry every two seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeEntry {
    /// Drawn when the node registers. A node that lost its lease, and a process that took its name, have another.
    pub incarnation: u64,
    /// Where players reach it, such as `https://b.play.example.org`, without a slash at the end.
    pub url: String,
    /// Whether it hands its rooms over and takes none.
    #[serde(default)]
    pub draining: bool,
    /// Processor seconds a second that its rooms may take.
    pub capacity: f64,
    /// Of these, what they took in the last seconds.
    pub used: f64,
    /// Rooms that it may still open.
    pub rooms_left: usize,
    /// Tells whether it has the same secret; missing in entries of an earlier version.
    #[serde(default)]
    pub secret_mark: Option<u32>,
    /// Its public rooms, for the lists of other nodes.
    #[serde(default)]
    pub rooms: Vec<RoomCounts>,
}

/// How full a room is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoomCounts {
    /// The code in its link.
    pub code: String,
    pub players: usize,
    /// Of these, players who are there now.
    pub connected: usize,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spectators: usize,
}

/// Most rooms have no spectators, and their counts are sent to all nodes.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// The node that plays a room.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Owner {
    pub node: String,
    /// Its incarnation; the owner is gone when the node has another.
    pub incarnation: u64,
}

/// A room. The node that it names plays it, and no other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoomEntry {
    /// The node that plays it.
    pub owner: Owner,
    /// Grows by one with every change of the owner, from 1.
    pub epoch: u64,
    /// The rest, which never changes.
    #[serde(flatten)]
    pub room: RoomFacts,
}

/// What is decided when a room opens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoomFacts {
    /// Name of its scene.
    pub scene: String,
    /// Number that its tokens and host keys name.
    pub number: u64,
    /// Whether it is reached by its link only.
    #[serde(default)]
    pub private: bool,
    /// Network of the creator; `None` for a standing room.
    #[serde(default)]
    pub creator: Option<IpAddr>,
    /// Whether a guest brought the scene: only the node that opens the room has it, and then the room's records.
    #[serde(default)]
    pub guest: bool,
}

/// The name of an entry.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Key {
    Node(String),
    Room(String),
}

/// The value of an entry.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// That of a node.
    Node(NodeEntry),
    /// That of a room.
    Room(RoomEntry),
}
