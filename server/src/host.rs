//! Rooms and their threads. [`rooms::Rooms`] opens a room and hands sessions to it, [`ticker`] is the room's thread,
//! and [`room_handle`] is what others use to reach it. The thread sends to each of its [`sessions`] through an
//! [`outbox`], and never waits.

pub mod admission;
pub mod clock;
pub mod confusables;
pub mod delivery;
pub mod inbox;
pub mod outbox;
pub mod peer_nodes;
pub mod room_handle;
pub mod room_shares;
pub mod rooms;
pub mod seat_rates;
pub mod sessions;
pub mod socket_writer;
pub mod successors;
pub mod thread_time;
pub mod ticker;
pub mod token_signer;

/// A server's current phase. It only moves forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Running,
    /// Players have been warned, and nothing new is being started.
    Draining,
    Closing,
}

/// An unpredictable random number.
pub fn random() -> u64 {
    getrandom::u64().expect("the system's random source worked when the server started")
}
