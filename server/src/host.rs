//! Rooms and their threads. [`rooms::Rooms`] opens a room and hands sessions to it, [`ticker`] is its thread,
//! [`room_handle`] all that others hold of it. The thread feeds its [`sessions`] through an [`outbox`] each, which it never waits for.

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
pub mod thread_time;
pub mod ticker;
pub mod token_signer;

/// The current phase of a server. It only moves forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Running,
    /// Players have been warned, and nothing new is started.
    Draining,
    Closing,
}

/// A random number that cannot be foreseen.
pub fn random() -> u64 {
    getrandom::u64().expect("the system's random source worked when the server started")
}
