//! Springs from a body to a point or to another body.

use super::air::FORCE_MAX;
use crate::body::BodyId;
use crate::check;
use glam::{DVec2, Vec2};

/// Length below which springs have no direction, world units.
pub(super) const LENGTH_MIN: f64 = 1e-9;

/// The other end of a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpringEnd {
    /// A fixed point, world units.
    Point(Vec2),
    /// The centre of another body.
    Body(BodyId),
}

/// A spring attached to the centre of a body. It passes through everything, pulls when longer than its rest length
/// and pushes when shorter. It is removed together with either of its bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// The body at its first end.
    pub body: BodyId,
    /// The other end.
    pub end: SpringEnd,
    /// Rest length, world units; not negative.
    pub rest_length: f32,
    /// Force per unit of length, 0..=[`FORCE_MAX`].
    pub stiffness: f32,
    /// Force per unit of speed along the spring (along any direction if its rest length is 0),
    /// 0..=[`FORCE_MAX`].
    pub damping: f32,
}

impl Spring {
    /// A spring of zero length on which `mass` oscillates `frequency` times per second. A damping ratio of 1
    /// is critical. For a spring between two bodies, pass m1 m2 / (m1 + m2) as the mass.
    pub fn tuned(
        body: BodyId,
        end: SpringEnd,
        frequency: f32,
        damping_ratio: f32,
        mass: f32,
    ) -> Spring {
        let turn = std::f32::consts::TAU * frequency;
        let (stiffness, damping) = (turn * turn * mass, 2.0 * damping_ratio * turn * mass);
        Spring { body, end, rest_length: 0.0, stiffness, damping }
    }

    /// Slots of the spring's bodies.
    pub(super) fn slots(&self) -> impl Iterator<Item = u32> {
        let other = match self.end {
            SpringEnd::Body(other) => Some(other.index),
            SpringEnd::Point(_) => None,
        };
        std::iter::once(self.body.index).chain(other)
    }

    /// Energy stored in the spring while its bodies are at these positions.
    pub(super) fn energy(&self, mut position: impl FnMut(u32) -> DVec2) -> f64 {
        let far = match self.end {
            SpringEnd::Point(point) => point.as_dvec2(),
            SpringEnd::Body(other) => position(other.index),
        };
        let length = position(self.body.index).distance(far);
        let stretch = length - f64::from(self.rest_length);
        f64::from(self.stiffness) * stretch * stretch / 2.0
    }

    /// Panics unless every number is in its documented range.
    pub(super) fn check(&self) {
        let Spring { rest_length, stiffness, damping, .. } = *self;
        let range = 0.0..=FORCE_MAX;
        check::number(range.contains(&rest_length), "rest length of a spring", rest_length);
        check::number(range.contains(&stiffness), "stiffness of a spring", stiffness);
        check::number(range.contains(&damping), "damping of a spring", damping);
        match self.end {
            SpringEnd::Point(point) => check::vector(point.is_finite(), "end of a spring", point),
            SpringEnd::Body(other) => assert!(other != self.body, "a spring from a body to itself"),
        }
    }
}
