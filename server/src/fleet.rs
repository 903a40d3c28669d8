//! Several servers as one fleet. They share a directory of nodes and rooms in a key-value store. Each room's records
//! are in a stream of that store, from which another node resumes the room when its node drains or dies.

pub mod directory;
pub mod entry;
pub mod handle;
pub mod joining;
pub mod lease;
pub mod settings;

#[cfg(feature = "nats")]
pub mod nats;
