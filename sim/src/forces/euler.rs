//! Euler's two methods, for scenes that demonstrate them.
//!
//! Both add h a to the velocity, where a is the acceleration at the start of the step. The explicit method moves a
//! body by its velocity at the start of the step, and the symplectic one by its velocity at the end. An orbit's
//! energy grows with the first method and oscillates about its true value with the second.

use super::air::{Air, Drag, Move};
use super::springs::{LENGTH_MIN, Spring, SpringEnd};
use crate::bodies::Bodies;
use glam::DVec2;

/// Groups whose dynamic bodies are moved by one of Euler's methods, one bit each. These methods are unstable where
/// forces are stiff, and only the world's speed limit bounds the speeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EulerGroups {
    /// Groups moved by the explicit method.
    pub explicit: u32,
    /// Groups moved by the symplectic method, except those in `explicit`.
    pub symplectic: u32,
}

impl EulerGroups {
    /// All groups use the default integrator.
    pub const NONE: EulerGroups = EulerGroups { explicit: 0, symplectic: 0 };

    pub(super) fn have(self, group: u8) -> bool {
        (self.explicit | self.symplectic) >> group & 1 == 1
    }
}

/// A body in one of these groups.
#[derive(Clone, Debug)]
pub(super) struct EulerBody {
    slot: u32,
    drag: Drag,
    is_explicit: bool,
    /// Springs attached to the body at either end.
    springs: Vec<Spring>,
}

impl EulerBody {
    pub fn slot(&self) -> u32 {
        self.slot
    }

    pub fn new(slot: u32, drag: Drag, is_explicit: bool, springs: &[Spring]) -> EulerBody {
        let holds = |spring: &&Spring| {
            spring.body.index == slot
                || matches!(spring.end, SpringEnd::Body(other) if other.index == slot)
        };
        let springs = springs.iter().filter(holds).copied().collect();
        EulerBody { slot, drag, is_explicit, springs }
    }

    /// Computes the move of a step.
    pub fn fly(&self, bodies: &Bodies, air: &Air) -> Move {
        let slot = self.slot as usize;
        let before = bodies.velocity[slot].as_dvec2();
        let through_air = before - air.wind;
        let Drag { linear, quadratic } = self.drag;
        let rate = f64::from(linear) + f64::from(quadratic) * through_air.length();
        let pull: DVec2 = self.springs.iter().map(|spring| self.pull(spring, bodies)).sum();
        let acceleration = air.gravity * f64::from(bodies.gravity_scale[slot])
            + pull * f64::from(bodies.inverse_mass[slot])
            - through_air * rate;
        let after = before + acceleration * air.dt;
        let path = if self.is_explicit { before } else { after } * air.dt;
        air.limited_move(self.slot, after, path)
    }

    /// Force of a spring on the body.
    fn pull(&self, spring: &Spring, bodies: &Bodies) -> DVec2 {
        let state = |slot: u32| {
            let slot = slot as usize;
            (bodies.center[slot].as_dvec2(), bodies.velocity[slot].as_dvec2())
        };
        let own = state(self.slot);
        let other = match spring.end {
            SpringEnd::Point(point) => (point.as_dvec2(), DVec2::ZERO),
            SpringEnd::Body(id) if id.index == self.slot => state(spring.body.index),
            SpringEnd::Body(id) => state(id.index),
        };
        let (offset, speed) = (other.0 - own.0, other.1 - own.1);
        let (stiffness, damping) = (f64::from(spring.stiffness), f64::from(spring.damping));
        let (length, rest_length) = (offset.length(), f64::from(spring.rest_length));
        if rest_length == 0.0 {
            return offset * stiffness + speed * damping;
        }
        if length < LENGTH_MIN {
            return DVec2::ZERO;
        }
        let along = offset / length;
        along * (stiffness * (length - rest_length) + damping * speed.dot(along))
    }
}
