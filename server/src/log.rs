//! The logs of all rooms: their readers, each with a position, and the files that they write.
//!
//! **Data.** A room's [`GameLog`](jostle_room::GameLog) has blocks that are made once and shared. Its readers are a
//! replay, the file of `--state` (in a fleet the stream in its place), and a clip, each with its own position.
//!
//! **Data flow.** After its ticks a room's [`RoomLog`] puts the newest blocks into its [`SharedLog`], without waiting.
//! The writer's thread lets each [`LogReader`] of a disk read further, and its [`Sink`] write; a reader that writes to
//! the network is a task. A room that outlives the process becomes a [`SavedRoom`], read from its newest file.
//!
//! **Limits.** A shared log has the length of a clip; a reader that falls further behind has lost its place. A reader
//! writes everything it has read before it reads more.
//!
//! **Failures.** There is one [`Policy`]: whatever fails, is full or stalls, a reader may lose its file, but no game
//! loses a tick. The first error is logged, each is counted, and a new file starts after a while. `docs/faults.md` has
//! the table.

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
pub use restore::{HostNotes, SavedRoom};
pub use room_log::RoomLog;
pub use settings::{Create, Settings, days};
pub use state_dir::{StateDir, StateSettings, Sync, write_closed};
pub use store::{Readable, Refused, ReplayStore};

#[cfg(test)]
mod tests;
