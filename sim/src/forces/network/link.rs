//! The force of a spring over a substep, and its derivative.

use crate::forces::springs::LENGTH_MIN;
use glam::{DMat2, DVec2};

/// An end of a spring.
#[derive(Clone, Copy, Debug)]
pub(super) enum LinkEnd {
    Node(u32),
    /// A body that is not moved by forces.
    Slot(u32),
    Point(DVec2),
}

/// A spring in the network.
#[derive(Clone, Debug)]
pub(super) struct NetworkLink {
    pub a: LinkEnd,
    pub b: LinkEnd,
    pub rest_length: f64,
    pub stiffness: f64,
    pub damping: f64,
}

/// Force of a spring.
pub(super) struct Pull {
    /// Force on the other end.
    pub force: DVec2,
    direction: DVec2,
    /// Transverse stiffness, which is tension divided by length if the spring pulls.
    across: f64,
}

impl LinkEnd {
    pub fn node(self) -> Option<u32> {
        match self {
            LinkEnd::Node(node) => Some(node),
            LinkEnd::Slot(_) | LinkEnd::Point(_) => None,
        }
    }
}

impl NetworkLink {
    pub fn pull(&self, early: DVec2, late: DVec2, speed: DVec2, t: f64) -> Pull {
        let mean = early * (1.0 - t) + late * t;
        if self.rest_length == 0.0 {
            let force = -mean * self.stiffness - speed * self.damping;
            return Pull { force, direction: DVec2::X, across: 0.0 };
        }
        let length = early.length() * (1.0 - t) + late.length() * t;
        let direction = unit(mean);
        let tension = self.stiffness * (length - self.rest_length);
        let (slant, across) = if length > LENGTH_MIN {
            (mean / length, max_or_nan(tension, 0.0) / length)
        } else {
            (direction, 0.0)
        };
        let damped = direction * (self.damping * direction.dot(speed));
        Pull { force: -slant * tension - damped, direction, across }
    }
}

impl Pull {
    /// Derivative of the impulse with respect to the velocity at the end of the step, or an upper bound that is the
    /// same in every direction.
    pub fn stiffness(&self, link: &NetworkLink, is_bound: bool, t: f64, dt: f64) -> DMat2 {
        let along = dt * t * (link.stiffness * t * dt + link.damping);
        if is_bound || link.rest_length == 0.0 {
            return DMat2::IDENTITY * along;
        }
        let across = dt * t * self.across * t * dt;
        let direction = self.direction;
        let outer = DMat2::from_cols(direction * direction.x, direction * direction.y);
        outer * (along - across) + DMat2::IDENTITY * across
    }
}

/// Unit vector in the direction of a vector; the x axis if it has no direction.
fn unit(vector: DVec2) -> DVec2 {
    let length = vector.length();
    if length > LENGTH_MIN { vector / length } else { DVec2::X }
}

/// The larger of the two, or NaN if `a` is NaN.
pub(super) fn max_or_nan(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// The surface of an immovable obstacle. A stiff damper holds a node that would pass it.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub node: u32,
    /// Unit vector towards the node.
    pub normal: DVec2,
    /// Smallest allowed velocity along the normal, units/s.
    pub speed_min: f64,
    pub is_active: bool,
    /// Impulse per unit of speed below the minimum.
    pub stiffness: f64,
}

impl Plane {
    /// Impulse along the normal on a node with this velocity.
    pub fn impulse(&self, velocity: DVec2) -> f64 {
        let short = self.speed_min - self.normal.dot(velocity);
        if self.is_active { self.stiffness * short } else { 0.0 }
    }
}
