//! The protocol between client and server: messages, the snapshot and its codec, the replay format, all limits on
//! these, and the JSON answers of the HTTP API. This crate does no IO, allocates nothing before checking its size, and
//! never panics, whatever bytes it is given.

#![warn(missing_docs)]

mod appearance;
mod bits;
mod clip;
mod codec;
mod error;
mod failover;
mod ids;
pub mod limits;
pub mod message;
mod origin;
mod position_history;
mod refusal;
pub mod replay;
mod role;
pub mod snapshot;
mod snapshot_stream;
mod token;
pub mod web;
pub mod wire;

pub use appearance::{first_forbidden, has_visible};
pub use codec::EncodeScratch;
pub use error::DecodeError;
pub use failover::Servers;
pub use message::{
    Appearance, AppearanceError, ClientMessage, ClipRefusal, Refusal, Role, ServerMessage, VERSION,
    WelcomeSeat,
};
pub use origin::is_origin;
pub use refusal::BAD_MESSAGE_CODES;
pub use snapshot::{PlayerState, Snapshot, SnapshotBody, TimedEvent};
pub use snapshot_stream::{Decoded, SnapshotStream};
pub use token::Token;
