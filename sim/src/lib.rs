//! The simulation of a [`World`] of circles and axis-aligned boxes, and of its particles.
//!
//! The same calls produce the same state hash after every step, bit for bit, on every target. Nothing here does IO,
//! reads a clock, spawns a thread or iterates a hash map. Arithmetic is + - * / sqrt on f32 (on f64 for forces), and
//! [`math`] holds the few transcendental functions.

#![warn(missing_docs)]

mod bodies;
mod body;
mod broad_phase;
mod check;
mod continuous;
mod features;
mod forces;
mod growth;
mod hash;
mod integrate;
pub mod math;
mod narrow_phase;
pub mod particles;
mod rng;
mod shape;
pub mod short_sort;
mod sleep;
mod solver;
pub mod state;
mod steady;
mod step_counts;
mod time;
mod touches;
mod world;

pub use body::{BodyDef, BodyId, GROUPS_MAX, Motion};
pub use features::Features;
pub use forces::ForceSettings;
pub use forces::air::{Drag, FORCE_MAX};
pub use forces::euler::EulerGroups;
pub use forces::springs::{Spring, SpringEnd};
pub use glam::Vec2;
pub use hash::StateHasher;
pub use narrow_phase::Manifold;
pub use narrow_phase::overlap::collide;
pub use particles::{EmitterDef, Particles, Recipe, Source};
pub use rng::Rng;
pub use shape::{Aabb, Shape};
pub use solver::Solver;
pub use solver::settings::{Conjugate, Relaxation};
pub use state::bytes::StateError;
pub use state::{Difference, Subject};
pub use step_counts::StepCounts;
pub use time::{DT, STEP_MAX, TICKS_PER_SECOND};
pub use touches::Touch;
pub use world::{Departed, StepBudget, StepPhase, World, WorldSettings};
