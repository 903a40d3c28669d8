//! Rooms and their threads. [`rooms::Rooms`] opens a room and hands sessions to it, [`ticker`] is its thread,
//! [`room_handle`] all that others hold of it. The thread feeds each [`member`] through an [`outbox`], which it never waits for.

pub mod admission;
pub mod clock;
pub mod delivery;
pub mod inbox;
pub mod last_tick;
pub mod member;
pub mod names;
pub mod neighbours;
pub mod outbox;
pub mod phase;
pub mod random;
pub mod room_handle;
pub mod room_shares;
pub mod rooms;
pub mod run_queue;
pub mod schedule;
pub mod seat_rates;
pub mod socket_writer;
pub mod spectators;
pub mod thread_time;
pub mod ticker;
pub mod token_signer;
