//! The directory's entries: small JSON values, keyed by node names and room codes. New fields have defaults, so that
//! nodes running different versions can share a directory.

use serde::{Deserialize, Serialize};
use std::net::IpAddr;

/// An entry's revision. It increases with every write to the entry's bucket; 0 means that the entry does not exist.
pub type Revision = u64;

/// A node with a valid lease. It rewrites its entry every two seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeEntry {
    /// Chosen when the node registers. A node that lost its lease, or another process with the same name, has a
    /// different one.
    pub incarnation: u64,
    /// Address at which players reach the node, such as `https://b.play.example.org`, without a trailing slash.
    pub url: String,
    /// Whether the node is handing over its rooms and accepting no new ones.
    #[serde(default)]
    pub draining: bool,
    /// Processor time available to the node's rooms, in seconds per second.
    pub capacity: f64,
    /// The part of this time that they used in the last few seconds.
    pub used: f64,
    /// Number of rooms that the node can still open.
    pub rooms_left: usize,
    /// Shows whether the node has the same secret; missing from entries written by earlier versions.
    #[serde(default)]
    pub secret_mark: Option<u32>,
    /// The node's public rooms, for other nodes' room lists.
    #[serde(default)]
    pub rooms: Vec<RoomCounts>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoomCounts {
    /// The code in the room's link.
    pub code: String,
    pub players: usize,
    /// Number of connected players.
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
    /// The node's incarnation. The owner is gone once the node has a different one.
    pub incarnation: u64,
}

/// A room. It is played only by the node named here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoomEntry {
    /// The node that plays the room.
    pub owner: Owner,
    /// Starts at 1 and increases by one with every change of owner.
    pub epoch: u64,
    /// The facts that never change.
    #[serde(flatten)]
    pub room: RoomFacts,
}

/// Facts that are decided when a room opens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RoomFacts {
    /// Name of the room's scene.
    pub scene: String,
    /// Number that appears in the room's tokens and host keys.
    pub number: u64,
    /// Whether the room can be reached only by its link.
    #[serde(default)]
    pub private: bool,
    /// The creator's network; `None` for a standing room.
    #[serde(default)]
    pub creator: Option<IpAddr>,
    /// Whether a guest provided the scene. Only the node that opens the room knows the scene; later it is read from the
    /// room's records.
    #[serde(default)]
    pub guest: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Key {
    Node(String),
    Room(String),
}

#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    Node(NodeEntry),
    Room(RoomEntry),
}
