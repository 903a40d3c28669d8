//! A [`Scene`] file describes a game, and a [`Game`] plays it on a [`World`](jostle_sim::World).
//!
//! The same scene, seed and input log give the same state hash in every tick, bit for bit, on every
//! target. Nothing here does IO, reads a clock, spawns a thread or iterates a hash map.

#![warn(missing_docs)]

mod emitters;
mod event;
mod game;
mod heroes;
mod impacts;
mod input;
mod launchers;
mod minions;
mod packs;
mod phase;
mod placing;
mod platforms;
mod player;
mod rngs;
mod roster;
mod rules;
pub mod scene;
mod side;
mod state;
mod tools;
pub mod trial;
mod walk;

#[cfg(test)]
mod tests;

pub use event::Event;
pub use game::{Game, PlayerInfo, SnapshotBody};
pub use input::{Buttons, Input, POINTER_MAX, POINTER_QUANTUM, Seat};
pub use phase::Phase;
pub use rules::{
    OrderProgress, RoundInfo, RoundPhase, RoundPlayer, SideInfo, SlingInfo, Taking, sling_path,
};
pub use scene::{Kind, SEATS_MAX, Scene, SceneError, Tools};
pub use side::Side;
pub use tools::selectable_at;
