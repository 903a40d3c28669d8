//! What a world can contain that costs something: the part of a scene's [`Plan`] that a step reads.
//!
//! A step skips what no body of the world brings. A world begins with what its settings name and
//! widens with every body that brings more, so a plan can cost time if it names too much, but it
//! can never make a result wrong. It is no state: with everything named the hashes are the same.
//!
//! [`Plan`]: crate::scene::Plan

use crate::body::{BodyDef, Motion};
use crate::shape::Shape;

/// What a world may need; see the module's description.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Bodies that are circles.
    pub circles: bool,
    /// Bodies that are boxes.
    pub boxes: bool,
    /// Contacts with friction: a dynamic body has some. A pair's is the geometric mean of the two,
    /// and one of them is dynamic.
    pub friction: bool,
    /// Contacts that bounce: a body that is not static does. A pair takes the smaller restitution.
    pub restitution: bool,
    /// Particles.
    pub particles: bool,
}

/// What this build can not do at all, to be measured against one that can: the name of a field in
/// the variable `JOSTLE_LEAVE_OUT` of the compiler.
const LEFT_OUT: Features = left_out(option_env!("JOSTLE_LEAVE_OUT"));

impl Features {
    /// Nothing: an empty world, which widens as bodies come.
    pub const NONE: Features = Features {
        circles: false,
        boxes: false,
        friction: false,
        restitution: false,
        particles: false,
    };
    /// Everything: the general way through a step.
    pub const ALL: Features =
        Features { circles: true, boxes: true, friction: true, restitution: true, particles: true };

    /// What a body brings.
    pub fn of(def: &BodyDef) -> Features {
        let BodyDef { shape, motion, friction, restitution, .. } = *def;
        Features::of_parts(shape, motion, friction, restitution)
    }

    /// The same of a body that is no definition any more.
    pub(crate) fn of_parts(
        shape: Shape,
        motion: Motion,
        friction: f32,
        restitution: f32,
    ) -> Features {
        Features {
            circles: matches!(shape, Shape::Circle { .. }),
            boxes: matches!(shape, Shape::Box { .. }),
            friction: motion == Motion::Dynamic && friction > 0.0,
            restitution: motion != Motion::Static && restitution > 0.0,
            particles: false,
        }
    }

    /// What either of the two needs.
    pub fn with(self, other: Features) -> Features {
        Features {
            circles: self.circles || other.circles,
            boxes: self.boxes || other.boxes,
            friction: self.friction || other.friction,
            restitution: self.restitution || other.restitution,
            particles: self.particles || other.particles,
        }
    }

    /// Whether all that `other` needs is in this.
    pub fn contains(self, other: Features) -> bool {
        self.with(other) == self
    }

    /// What a step of this build acts on: without what it can not do, a constant for the compiler.
    #[inline]
    pub(crate) fn in_this_build(self) -> Features {
        Features {
            circles: self.circles && !LEFT_OUT.circles,
            boxes: self.boxes && !LEFT_OUT.boxes,
            friction: self.friction && !LEFT_OUT.friction,
            restitution: self.restitution && !LEFT_OUT.restitution,
            particles: self.particles && !LEFT_OUT.particles,
        }
    }
}

const fn left_out(name: Option<&str>) -> Features {
    let Some(name) = name else { return Features::NONE };
    match name.as_bytes() {
        b"circles" => Features { circles: true, ..Features::NONE },
        b"boxes" => Features { boxes: true, ..Features::NONE },
        b"friction" => Features { friction: true, ..Features::NONE },
        b"restitution" => Features { restitution: true, ..Features::NONE },
        b"particles" => Features { particles: true, ..Features::NONE },
        _ => panic!("JOSTLE_LEAVE_OUT names no field of Features"),
    }
}
