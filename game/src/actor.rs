//! A body's role in the game, beyond what the World knows of it.

use crate::input::Seat;
use crate::scene::Kind;
use glam::Vec2;
use jostle_sim::BodyId;
use jostle_sim::state::{StateVisitor, Subject};

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

impl Actor {
    pub fn visit(&self, visitor: &mut impl StateVisitor) {
        let subject = Subject::Body(self.id);
        visitor.name(subject, "name", self.id);
        visitor.bits(subject, "kind", self.kind as u32);
        visitor.bits(subject, "owner", self.owner.map_or(u32::MAX, |seat| u32::from(seat.0)));
        match self.rule {
            Rule::Still => {}
            Rule::Wander { heading, speed, is_pushed } => {
                visitor.vector(subject, ["heading.x", "heading.y"], heading);
                visitor.number(subject, "wander speed", speed);
                if is_pushed {
                    visitor.bits(subject, "is pushed", 1);
                }
            }
            Rule::Chase { front, drift, driven, life } => {
                visitor.vector(subject, ["front.x", "front.y"], front);
                visitor.vector(subject, ["drift.x", "drift.y"], drift);
                visitor.vector(subject, ["driven.x", "driven.y"], driven);
                visitor.bits(subject, "ticks left", life);
            }
        }
    }
}
