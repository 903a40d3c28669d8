//! Notes in a room's file on everything that is not its game.

use crate::host::admission::Admission;
use jostle_room::SavedMembers;
use serde::{Deserialize, Serialize};
use std::net::IpAddr;

/// The notes of the host in a room's file, as JSON. New fields have defaults, so that files of an older version
/// can be read.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Notes {
    /// [`crate::host::room_handle::RoomInfo::number`]: tokens and host keys name it.
    pub number: u64,
    /// Whether it is reached by its link only.
    pub private: bool,
    /// Network of the creator; `None` for a standing room.
    pub creator: Option<IpAddr>,
    /// Whether a guest brought the scene.
    #[serde(default)]
    pub guest: bool,
    /// Who has which seat.
    pub members: SavedMembers,
    /// The networks of the seats, and the kicked players.
    #[serde(default)]
    pub admission: Admission,
}
