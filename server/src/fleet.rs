//! Several servers as one: a directory of nodes and rooms in a key-value store that they share, and the records of
//! each room in a stream of it, from which another node goes on with a room whose node drains or dies.

pub mod directory;
pub mod entry;
pub mod handle;
pub mod joining;
pub mod lease;
pub mod settings;

#[cfg(feature = "nats")]
pub mod nats;
