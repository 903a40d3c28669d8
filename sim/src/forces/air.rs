//! Air drag, the constants for a step with forces, and the step's moves.

use glam::{DVec2, Vec2};

/// Largest drag rates, 1/s and 1/unit, and largest stiffness and damping of a spring.
pub const FORCE_MAX: f32 = 1e18;

/// Drag on a body: its velocity u relative to the wind changes at the rate -(linear + quadratic |u|) u.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drag {
    /// Rate of linear drag, 1/s, 0..=[`FORCE_MAX`].
    pub linear: f32,
    /// Rate of quadratic drag, 1/unit, 0..=[`FORCE_MAX`].
    pub quadratic: f32,
}

impl Drag {
    /// No drag.
    pub const NONE: Drag = Drag { linear: 0.0, quadratic: 0.0 };

    pub(super) fn is_valid(self) -> bool {
        let range = 0.0..=FORCE_MAX;
        range.contains(&self.linear) && range.contains(&self.quadratic)
    }
}

/// A body's flight through a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    pub slot: u32,
    /// Velocity at the end of the step.
    pub velocity: Vec2,
    pub path: Vec2,
    pub kind: MoveKind,
}

/// How contacts act on a move.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MoveKind {
    /// The path is nearly a parabola. Contacts act on the velocity at its end, as they do in free fall.
    Smooth,
    /// The body is moved by a spring that turns over within a few steps, so that the velocity at the end says
    /// nothing about the path. Contacts act on the mean velocity.
    Fast {
        /// Path that an implicit step would take.
        implicit: Vec2,
    },
    /// The body is moved by such a spring, but blocked by something. The path follows from the velocity at the end.
    Held(Hold),
}

/// A held body as seen by contacts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hold {
    /// Velocity to which contacts add, units/s.
    pub velocity: Vec2,
    /// Inverse of the mass that resists contacts, including the effect of springs.
    pub inverse_mass: f32,
}

/// Constants for a step, in double precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Air {
    pub gravity: DVec2,
    pub wind: DVec2,
    pub dt: f64,
    pub speed_max: f64,
}

impl Air {
    /// Creates a move, limited to the largest speed.
    pub fn limited_move(&self, slot: u32, velocity: DVec2, path: DVec2) -> Move {
        let velocity = limited(velocity, self.speed_max).as_vec2();
        let path = limited(path, self.speed_max * self.dt).as_vec2();
        Move { slot, velocity, path, kind: MoveKind::Smooth }
    }
}

/// Phase by which an oscillation must advance in a step to count as fast, radians.
pub(super) const FAST_PHASE: f64 = 0.5;

/// Limits the length of a vector. One that is not finite becomes zero.
fn limited(vector: DVec2, limit: f64) -> DVec2 {
    let squared = vector.length_squared();
    if squared <= limit * limit {
        vector
    } else if squared.is_finite() {
        vector * (limit / squared.sqrt())
    } else {
        DVec2::ZERO
    }
}
