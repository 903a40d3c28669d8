//! What a client is in a room: a player with a seat, or a spectator.

use crate::token::Token;
use jostle_game::Seat;

/// The part that a client takes in a room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// A player, with a seat.
    #[default]
    Player,
    /// A spectator, without one: it is sent everything and can change nothing.
    Spectator,
}

/// The seat in a welcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WelcomeSeat {
    /// The seat that the player holds.
    pub seat: Seat,
    /// Whether the player is the room's host, because the hello had the right key.
    pub host: bool,
    /// The token with which the player gets the seat back after a lost socket, once.
    pub token: Token,
}
