//! Body ids, kinds of motion, and definitions.

use crate::forces::air::Drag;
use crate::shape::Shape;
use glam::Vec2;

/// Permanent id of a body. After its removal, `index` is reused with another `generation`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId {
    /// Slot in the world's arrays.
    pub index: u32,
    /// Number of times that the slot was used before.
    pub generation: u32,
}

/// How a body responds to forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Never moves; infinite mass.
    Static,
    /// Moves only by its own velocity, like a lift; infinite mass.
    Kinematic,
    /// Moved by gravity and contacts.
    Dynamic,
}

/// Restitution and friction of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    pub restitution: f32,
    pub friction: f32,
}

/// Definition of a new body. [`Default`] is a dynamic circle of radius 1 in group 0, with mass 1,
/// restitution 0.8 and friction 0.3 (A2.7).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyDef {
    /// Shape, centred on the position of the body.
    pub shape: Shape,
    /// Centre, world units.
    pub position: Vec2,
    /// Velocity, units/s.
    pub velocity: Vec2,
    /// Whether forces and contacts move it.
    pub motion: Motion,
    /// Mass, positive and finite; only dynamic bodies use it.
    pub mass: f32,
    /// Restitution, 0..=1; a pair uses the smaller of the two values.
    pub restitution: f32,
    /// Coulomb friction coefficient, 0..=10; a pair uses the geometric mean.
    pub friction: f32,
    /// Factor applied to the world's gravity; 0 for none.
    pub gravity_scale: f32,
    /// Air drag; only dynamic bodies in a world with forces use it.
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

/// Number of collision groups.
pub const GROUPS_MAX: usize = 32;
