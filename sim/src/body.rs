//! What a body is: its name for good, how it moves, how it is defined.

use crate::forces::Drag;
use crate::shape::Shape;
use glam::Vec2;

/// Names one body for good: `index` is reused after a removal, `generation` then differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId {
    /// Slot in the world's arrays.
    pub index: u32,
    /// How often the slot was given out before.
    pub generation: u32,
}

/// How a body answers to forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Never moves, infinite mass.
    Static,
    /// Moves by its own velocity only, infinite mass: a lift.
    Kinematic,
    /// Moved by gravity and contacts.
    Dynamic,
}

/// A body as it is created. [`Default`] holds the chapter's values (row A2.7): a dynamic circle of
/// radius 1, mass 1, restitution 0.8, friction 0.3, in group 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyDef {
    /// Outline.
    pub shape: Shape,
    /// Centre, world units.
    pub position: Vec2,
    /// Units/s.
    pub velocity: Vec2,
    /// How it moves.
    pub motion: Motion,
    /// Mass, positive and finite; only meant for dynamic bodies.
    pub mass: f32,
    /// Bounce, 0..=1; a pair takes the smaller of the two.
    pub restitution: f32,
    /// Coulomb coefficient, 0..=10; a pair takes the geometric mean.
    pub friction: f32,
    /// Factor on the world's gravity; 0 floats.
    pub gravity_scale: f32,
    /// What slows it down on its way; only meant for dynamic bodies, in a world with forces.
    pub drag: Drag,
    /// Collision group, below [`GROUPS_MAX`].
    pub group: u8,
}

impl Default for BodyDef {
    fn default() -> BodyDef {
        BodyDef {
            shape: Shape::Circle { radius: 1.0 },
            position: Vec2::ZERO,
            velocity: Vec2::ZERO,
            motion: Motion::Dynamic,
            mass: 1.0,
            restitution: 0.8,
            friction: 0.3,
            gravity_scale: 1.0,
            drag: Drag::NONE,
            group: 0,
        }
    }
}

/// Collision groups a world can tell apart.
pub const GROUPS_MAX: usize = 32;
