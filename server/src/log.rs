//! The logs of all rooms: their readers, each at its own position, and the files that the readers write.
//!
//! **Data.** A room's [`GameLog`](jostle_room::GameLog) has blocks that are created once and shared. Its readers are a
//! replay, the `--state` file (in a fleet, the stream instead) and a clip, each with its own position.
//!
//! **Data flow.** After its ticks, a room's [`RoomLog`] puts the newest blocks into its [`SharedLog`] without waiting.
//! The writer's thread lets each [`LogReader`] with files on a disk read further and its [`Sink`] write; a reader that
//! writes to the network runs as a task. A room that outlives the process becomes a [`SavedRoom`], read from its newest
//! file.
//!
//! **Limits.** A shared log is as long as a clip; a reader that falls further behind loses its place. A reader writes
//! everything that it has read before it reads more.
//!
//! **Failures.** There is a single [`Policy`]: whatever fails, fills up or stalls, a reader may lose its file, but no
//! game loses a tick. The first error is logged, every error is counted, and a new file starts after a while. See the
//! table in `docs/faults.md`.

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
