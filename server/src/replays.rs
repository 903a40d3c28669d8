//! Recording on a server: each room has a [`RoomRecording`], which hands its records to the one writer thread
//! over a bounded queue and never waits for it. The [`ReplayStore`] is the directory as others see it.
//! Every error here ends in the log and in [`Counters`]; the games go on.

mod index;
mod name;
mod queue;
mod recording;
mod room_recording;
mod settings;
mod store;
mod writer;

pub use name::{calendar, is_name};
pub use recording::Recording;
pub use room_recording::RoomRecording;
pub use settings::{Counters, Create, Settings, days};
pub use store::{Readable, Refused, ReplayStore};

#[cfg(test)]
mod tests;
