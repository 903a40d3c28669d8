//! Features of a world that cost time: the part of a scene's plan that a step reads.
//!
//! A step skips the features that no body of the world has. A world begins with the features of its
//! settings and widens with every body that has more, so a plan that names too many costs time but
//! can never make a result wrong. Features are not state: with all of them named the hashes are the
//! same.

use crate::body::{BodyDef, Motion};
use crate::shape::{Shape, shapes};

/// Whether the code for contacts without friction, and that for one kind of shapes, are left out: the
/// general code computes the same bits, and the page, which is downloaded, contains only that.
pub(crate) const GENERAL_ONLY: bool = cfg!(target_arch = "wasm32");

/// Features of a world; see the module's description.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Bodies that are circles.
    pub circles: bool,
    /// Bodies that are boxes.
    pub boxes: bool,
    /// Contacts with friction: a dynamic body has some. A pair takes the geometric mean of the two,
    /// and one of them is dynamic.
    pub friction: bool,
    /// Contacts that bounce: a body that is not static does. A pair takes the smaller restitution.
    pub restitution: bool,
    /// Particles, and what makes them.
    pub particles: bool,
}

impl Features {
    /// No features: an empty world, which widens as bodies are added.
    pub const NONE: Features = Features {
        circles: false,
        boxes: false,
        friction: false,
        restitution: false,
        particles: false,
    };
    /// All features: the general code of a step.
    pub const ALL: Features =
        Features { circles: true, boxes: true, friction: true, restitution: true, particles: true };

    /// Whether a step takes the code with friction.
    #[inline]
    pub(crate) fn takes_friction(self) -> bool {
        self.friction || GENERAL_ONLY
    }

    /// Whether passes take the code with restitution.
    #[inline]
    pub(crate) fn takes_restitution(self) -> bool {
        self.restitution || GENERAL_ONLY
    }

    /// The kinds of [`shapes`] for which a step takes its code.
    #[inline]
    pub(crate) fn takes_shapes(self) -> u8 {
        match (self.circles, self.boxes) {
            (true, false) if !GENERAL_ONLY => shapes::CIRCLES,
            (false, true) if !GENERAL_ONLY => shapes::BOXES,
            _ => shapes::BOTH,
        }
    }

    /// The features of a body.
    pub fn of(def: &BodyDef) -> Features {
        let BodyDef { shape, motion, friction, restitution, .. } = *def;
        Features::of_parts(shape, motion, friction, restitution)
    }

    /// The features of a body with these properties.
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

    /// The features that either of the two has.
    pub fn with(self, other: Features) -> Features {
        Features {
            circles: self.circles || other.circles,
            boxes: self.boxes || other.boxes,
            friction: self.friction || other.friction,
            restitution: self.restitution || other.restitution,
            particles: self.particles || other.particles,
        }
    }

    /// Whether this has all features of `other`.
    pub fn contains(self, other: Features) -> bool {
        self.with(other) == self
    }
}
