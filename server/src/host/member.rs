//! One player with a socket, and one spectator.

use crate::host::delivery::Delivery;
use crate::host::inbox::Inbox;
use crate::limits::connection_limits::Permit;
use jostle_game::Seat;
use jostle_protocol::ClientMessage;
use std::net::IpAddr;

/// One player with a socket.
pub struct ConnectedMember {
    pub(super) seat: Seat,
    /// Whether it may kick players and close the room.
    pub(super) host: bool,
    pub(super) inbox: Inbox<Option<ClientMessage>>,
    pub(super) feed: Delivery,
}

/// One spectator: a socket without a seat.
pub struct Spectator {
    pub(super) address: IpAddr,
    pub(super) inbox: Inbox<Option<ClientMessage>>,
    pub(super) feed: Delivery,
    /// Counts it towards the limits on the room's spectators.
    pub(super) _permit: Permit,
}
