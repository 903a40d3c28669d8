//! A [`Room`] is one game and its members, without sockets, files or time. It takes ticks and messages and produces
//! bytes. The server and the page use the same code.

#![warn(missing_docs)]

mod bots;
pub mod divergence;
mod input_queue;
pub mod log;
mod members;
pub mod playback;
mod replication;
mod room;
pub mod run;

pub use input_queue::{
    INPUTS_QUEUED_MAX, INPUTS_WAITING_GOAL, LONG_QUEUE_TICKS, SEQ_AHEAD_MAX, SILENCE_TICKS,
};
pub use log::GameLog;
pub use members::{Claim, SEAT_HELD_TICKS, SavedMembers, SavedSeat, Welcome};
pub use playback::{Playback, PlaybackError, Played};
pub use replication::{
    BufferPool, CAMERA_AHEAD_TICKS, CAMERA_CATCH_UP_TICKS, InterestArea, Rate, Subscriber, view_of,
};
pub use room::{Room, VIEW_EVERY_TICKS};
pub use run::{Measure, Run, Unproven};
