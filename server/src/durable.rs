//! Rooms that outlive the process (`--state`): each room's thread hands what it records to the one
//! [`StateWriter`] over a bounded queue, and never waits for it; at the start rooms are restored from the files.
//!
//! A room has one file, a replay that begins with a keyframe and goes on in short blocks; notes of the host
//! in it ([`Notes`]) list the players and their seats. After [`limits::STATE_FILE_TICKS`](crate::limits::STATE_FILE_TICKS)
//! a new file takes its place, so that a restart has little to play again. A file that lost its tail is restored
//! up to its last whole record.

mod dir;
mod job;
mod notes;
mod queue;
mod restore;
mod sink;
mod writer;

pub use dir::{StateDir, StateSettings, Sync, write_closed};
pub use job::{Job, RoomFile};
pub use notes::Notes;
pub use queue::StateWriter;
pub use restore::SavedRoom;
pub use sink::{RecordKeeper, RecordSink};
