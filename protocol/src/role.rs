//! A client's role in a room: a player with a seat, or a spectator.

use crate::token::Token;
use jostle_game::Seat;

/// A client's role in a room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// A player, who has a seat.
    #[default]
    Player,
    /// A spectator, who has no seat, receives everything and can change nothing.
    Spectator,
}

/// The seat in a welcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WelcomeSeat {
    /// The seat that the player holds.
    pub seat: Seat,
    /// Whether the player is the room's host, because the hello contained the right key.
    pub host: bool,
    /// A token with which the player can get the seat back once after losing the socket.
    pub token: Token,
}
