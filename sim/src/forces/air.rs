//! The constants of a step with forces, and its moves.

use glam::{DVec2, Vec2};

/// Free flight of a body through a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    pub slot: u32,
    /// At the end of the step.
    pub velocity: Vec2,
    pub path: Vec2,
}

/// Constants of a step, in double precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Air {
    pub gravity: DVec2,
    pub wind: DVec2,
    pub dt: f64,
    pub speed_max: f64,
}

impl Air {
    /// Limits a move to the largest speed.
    pub fn limited_move(&self, slot: u32, velocity: DVec2, path: DVec2) -> Move {
        let velocity = limited(velocity, self.speed_max).as_vec2();
        Move { slot, velocity, path: limited(path, self.speed_max * self.dt).as_vec2() }
    }
}

/// A vector that is not finite becomes zero.
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
