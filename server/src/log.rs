//! The logs of all rooms: readers with a position each, and the files that they write.
//!
//! **Data.** A room's [`GameLog`](jostle_room::GameLog) has blocks, made once and shared. A replay, the file of
//! `--state`, or the stream of a fleet in its place, and a clip are readers of it, each with a position of its own.
//!
//! **Its trip.** After its ticks a room's [`RoomLog`] puts the newest blocks into its [`SharedLog`], and waits for nothing. The
//! writer's thread has each [`LogReader`] of a disk read on, and its [`Sink`] write; a reader of the network is a task. A
//! room that outlives the process is a [`SavedRoom`], from the newest file of it.
//!
//! **Limits.** A shared log has the length of a clip: a reader that is further behind has lost its place. What was read is
//! written before more is.
//!
//! **Failures.** There is one [`Policy`]: whatever fails, is full or stalls costs a reader its file and no game a tick. The
//! first error is logged, each is counted, and a new file begins after a while. `docs/faults.md` has the table.

mod index;
mod logs;
mod name;
mod reader;
mod recording;
mod replay_file;
mod restore;
mod room_log;
mod settings;
mod state_dir;
mod state_file;
mod store;
mod writer;

pub use logs::{Logs, STATE, StreamEnd};
pub use name::{calendar, is_name};
pub use reader::{LogReader, NextWrite, Policy, Seal, SharedLog, Sink, Wants};
pub use recording::Recording;
pub use restore::{Notes, SavedRoom};
pub use room_log::RoomLog;
pub use settings::{Create, Settings, days};
pub use state_dir::{StateDir, StateSettings, Sync, write_closed};
pub use store::{Readable, Refused, ReplayStore};

#[cfg(test)]
mod tests;
