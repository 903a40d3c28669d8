//! Features of a world that cost time. They come from the scene's plan.
//!
//! A step skips features that no body of the world has. A world starts with the features in its settings and gains
//! those of every body that is added, so no plan can make a result wrong; one that names too many features only
//! costs time. Features are not state, since the hashes are the same with all of them enabled.

use crate::body::{BodyDef, Motion};
use crate::shape::{Shape, shapes};

/// Whether to leave out the special code for contacts without friction and for a single kind of shape. The general
/// code computes the same bits, and is the only one in the page, which has to be downloaded.
pub(crate) const GENERAL_ONLY: bool = cfg!(target_arch = "wasm32");

/// Features of a world; see the module documentation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Some bodies are circles.
    pub circles: bool,
    /// Some bodies are boxes.
    pub boxes: bool,
    /// Contacts have friction because some dynamic body does. A pair uses the geometric mean of its two
    /// coefficients, and one of its bodies is dynamic.
    pub friction: bool,
    /// Contacts bounce because some body that is not static has restitution. A pair uses the smaller value.
    pub restitution: bool,
    /// Particles and emitters.
    pub particles: bool,
}

impl Features {
    /// No features, as in an empty world, which gains them as bodies are added.
    pub const NONE: Features = Features {
        circles: false,
        boxes: false,
        friction: false,
        restitution: false,
        particles: false,
    };
    /// All features, so that a step runs the general code.
    pub const ALL: Features =
        Features { circles: true, boxes: true, friction: true, restitution: true, particles: true };

    /// Whether a step uses the code with friction.
    #[inline]
    pub(crate) fn takes_friction(self) -> bool {
        self.friction || GENERAL_ONLY
    }

    /// Whether passes use the code with restitution.
    #[inline]
    pub(crate) fn takes_restitution(self) -> bool {
        self.restitution || GENERAL_ONLY
    }

    /// The kinds of [`shapes`] whose code a step uses.
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

    /// The features of both combined.
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
