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

/// What this build can not do at all, to be measured against one that can: a name in the variable
/// `JOSTLE_LEAVE_OUT` of the compiler.
const LEFT_OUT: Option<&str> = option_env!("JOSTLE_LEAVE_OUT");
/// Names that it may have: the fields of [`Features`] and of [`Abilities`].
const NAMES: [&str; 10] = [
    "circles",
    "boxes",
    "friction",
    "restitution",
    "particles",
    "forces",
    "sleeping",
    "kinematic",
    "continuous",
    "touches",
];

/// What a build can do, beside [`Features`]: constants for the compiler. Worlds that do not use it need
/// no plan to be spared it; builds that leave it out show what asking costs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Abilities {
    /// Bodies that are circles.
    pub circles: bool,
    /// Bodies that are boxes.
    pub boxes: bool,
    /// Drag, wind and springs.
    pub forces: bool,
    /// Islands at rest that sleep.
    pub sleeping: bool,
    /// Bodies that move by their own velocity only.
    pub kinematic: bool,
    /// Bodies that move by more than their size in a step.
    pub continuous: bool,
    /// The list of who touches whom, from which events are made.
    pub touches: bool,
}

/// What this build can do.
pub(crate) const CAN: Abilities = Abilities {
    circles: !is_left_out("circles"),
    boxes: !is_left_out("boxes"),
    forces: !is_left_out("forces"),
    sleeping: !is_left_out("sleeping"),
    kinematic: !is_left_out("kinematic"),
    continuous: !is_left_out("continuous"),
    touches: !is_left_out("touches"),
};

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
            circles: self.circles && CAN.circles,
            boxes: self.boxes && CAN.boxes,
            friction: self.friction && !is_left_out("friction"),
            restitution: self.restitution && !is_left_out("restitution"),
            particles: self.particles && !is_left_out("particles"),
        }
    }
}

/// Whether the build leaves out what has this name.
const fn is_left_out(name: &str) -> bool {
    match LEFT_OUT {
        Some(left_out) => is_same(left_out, name),
        None => false,
    }
}

const fn is_same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut place = 0;
    while place < one.len() && place < other.len() && one[place] == other[place] {
        place += 1;
    }
    place == one.len() && place == other.len()
}

const _: () = {
    let mut known = LEFT_OUT.is_none();
    let mut place = 0;
    while place < NAMES.len() {
        known |= is_left_out(NAMES[place]);
        place += 1;
    }
    assert!(known, "JOSTLE_LEAVE_OUT names nothing that can be left out");
};
