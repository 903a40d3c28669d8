//! Runs several servers as one fleet. They share a directory of nodes and rooms in a key-value store. Each room's
//! records are kept in a stream, from which another node resumes the room when the original node drains or dies.

pub mod directory;
pub mod entry;
pub mod handle;
pub mod joining;
pub mod lease;
pub mod settings;

#[cfg(feature = "nats")]
pub mod nats;
