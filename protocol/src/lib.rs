//! What travels between client and server: messages, the snapshot and its codec, and every limit
//! on them. No IO, no allocation that was not checked first, no panic on any bytes.

mod appearance;
mod bits;
mod codec;
pub mod limits;
pub mod message;
mod refusal;
pub mod replay;
mod seat;
pub mod snapshot;
mod stream;
mod token;
pub mod wire;

pub use codec::Pen;
pub use message::{Appearance, AppearanceError, ClientMessage, Refusal, ServerMessage};
pub use snapshot::{PlayerState, Snapshot, SnapshotBody, TimedEvent};
pub use stream::{Heard, Stream};
pub use token::Token;
pub use wire::DecodeError;

/// Version of everything in this crate; both ends must agree.
pub const VERSION: u16 = 3;
