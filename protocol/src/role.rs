//! The role of a client in a room: a player with a seat, or a spectator.

use crate::token::Token;
use jostle_game::Seat;

/// The role of a client in a room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// A player, who has a seat.
    #[default]
    Player,
    /// A spectator, without a seat: receives everything and can change nothing.
    Spectator,
}

/// The seat in a welcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WelcomeSeat {
    /// The seat that the player holds.
    pub seat: Seat,
    /// Whether the player is the room's host, because the hello had the right key.
    pub host: bool,
    /// A token with which the player can get the seat back once, after a lost socket.
    pub token: Token,
}
