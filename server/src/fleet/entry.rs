//! The entries of the directory: small JSON values, keyed by node names and room codes. New fields have defaults, so
//! that nodes of two versions can share a directory.

use serde::{Deserialize, Serialize};
use std::net::IpAddr;

/// Revision of an entry. It increases with every write to its bucket; 0 means that the entry does not exist.
pub type Revision = u64;

/// A node with a valid lease. It rewrites its entry every two seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeEntry {
    /// Chosen when the node registers. A node that lost its lease, or another process with its name, has a different
    /// one.
    pub incarnation: u64,
    /// Address at which players reach the node, such as `https://b.play.example.org`, without a trailing slash.
    pub url: String,
    /// Whether the node hands over its rooms and takes none.
    #[serde(default)]
    pub draining: bool,
    /// Processor time that the node's rooms may take, in seconds per second.
    pub capacity: f64,
    /// The part of it that they took in the last seconds.
    pub used: f64,
    /// Number of rooms that the node may still open.
    pub rooms_left: usize,
    /// Shows whether the node has the same secret; missing in entries of earlier versions.
    #[serde(default)]
    pub secret_mark: Option<u32>,
    /// The node's public rooms, for the lists of other nodes.
    #[serde(default)]
    pub rooms: Vec<RoomCounts>,
}

/// The occupancy of a room.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoomCounts {
    /// The code in the room's link.
    pub code: String,
    pub players: usize,
    /// Number of players who are connected.
    pub connected: usize,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spectators: usize,
}

/// Zeros are omitted: most rooms have no spectators, and their counts are sent to all nodes.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// The node that plays a room.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Owner {
    pub node: String,
    /// The node's incarnation. The owner is gone when the node has another one.
    pub incarnation: u64,
}

/// A room. It is played only by the node named here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoomEntry {
    /// The node that plays the room.
    pub owner: Owner,
    /// Increases by one with every change of the owner, from 1.
    pub epoch: u64,
    /// The facts that never change.
    #[serde(flatten)]
    pub room: RoomFacts,
}

/// The facts decided when a room opens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoomFacts {
    /// Name of the room's scene.
    pub scene: String,
    /// Number in the room's tokens and host keys.
    pub number: u64,
    /// Whether the room can only be reached by its link.
    #[serde(default)]
    pub private: bool,
    /// Network of the creator; `None` for a standing room.
    #[serde(default)]
    pub creator: Option<IpAddr>,
    /// Whether a guest provided the scene. It is known only to the node that opens the room, and later from the room's
    /// records.
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
    /// The entry of a node.
    Node(NodeEntry),
    /// The entry of a room.
    Room(RoomEntry),
}
