//! The simulation: a [`World`] of circles and axis-aligned boxes, its particles, and the [`Game`]
//! that a [`Scene`] makes of it.
//!
//! One scene, one seed and one input log give one state hash per tick, bit for bit, on every
//! target. Nothing here does IO, reads a clock, spawns a thread or iterates a hash map; arithmetic
//! is + - * / sqrt on f32 (on f64 in [`forces`]), and [`math`] holds the few transcendentals.

mod bodies;
pub mod body;
pub mod conjugate;
pub mod contact;
pub mod features;
pub mod forces;
pub mod game;
mod hash;
pub mod math;
mod pairs;
pub mod particle;
pub mod relaxation;
pub mod scene;
pub mod shape;
pub mod solver;
pub mod state;
pub mod world;

pub use features::Features;
pub use forces::{Drag, ForceSettings, Spring, SpringEnd};
pub use game::{BodyInfo, Buttons, Event, Game, Input, Kind, PlayerInfo, SEATS_MAX, Seat};
pub use glam::Vec2;
pub use hash::StateHasher;
pub use particle::{EmitterDef, Particles, Recipe, Source};
pub use scene::{Scene, SceneError, Tools};
pub use shape::{Aabb, Shape};
pub use solver::Solver;
pub use state::bytes::StateError;
pub use state::{Difference, Subject};
pub use world::{BodyDef, BodyId, Motion, Phase, World};

/// Ticks a second of the server's counter; one tick is one step of the World.
pub const TICKS_PER_SECOND: u32 = 60;
/// Seconds in one step.
pub const DT: f32 = 1.0 / TICKS_PER_SECOND as f32;
