//! A body's role in the game, beyond what the World knows of it.

use crate::input::Seat;
use crate::scene::Kind;
use glam::Vec2;
use jostle_sim::BodyId;

/// A body's role in the game.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Actor {
    pub id: BodyId,
    pub kind: Kind,
    pub owner: Option<Seat>,
    pub rule: Rule,
}

/// Motion of a body by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    Still,
    Wander {
        heading: Vec2,
        /// Units/s, positive.
        speed: f32,
        /// A dye pack has pushed it off its way, to which it returns.
        is_pushed: bool,
    },
    Chase {
        /// Unit vector of its own motion.
        front: Vec2,
        /// Velocity that contacts have added to its own motion, units/s.
        drift: Vec2,
        /// Velocity set for this step, units/s.
        driven: Vec2,
        life: u32,
    },
}
