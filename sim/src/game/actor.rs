//! What the rules know about a body and about a player, beyond what the World knows.

use super::{Buttons, Kind, Seat};
use crate::body::BodyId;
use crate::state::{Subject, Words};
use glam::Vec2;

/// A body's part in the game.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Actor {
    pub id: BodyId,
    pub kind: Kind,
    pub owner: Option<Seat>,
    pub rule: Rule,
}

/// How a body moves by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rule {
    /// Not at all.
    Still,
    /// A minion.
    Wander {
        /// Unit vector.
        heading: Vec2,
        /// Units/s, positive.
        speed: f32,
    },
    /// A dye pack.
    Chase {
        /// Unit vector of its own motion.
        front: Vec2,
        /// What contacts have added to its own motion, units/s.
        drift: Vec2,
        /// Velocity that it was given for this step, units/s.
        driven: Vec2,
        /// Ticks left.
        life: u32,
    },
}

impl Actor {
    pub fn words(&self, words: &mut impl Words) {
        let subject = Subject::Body(self.id);
        words.name(subject, "name", self.id);
        words.bits(subject, "kind", self.kind as u32);
        words.bits(subject, "owner", self.owner.map_or(u32::MAX, |seat| u32::from(seat.0)));
        match self.rule {
            Rule::Still => {}
            Rule::Wander { heading, speed } => {
                words.vector(subject, ["heading.x", "heading.y"], heading);
                words.number(subject, "wander speed", speed);
            }
            Rule::Chase { front, drift, driven, life } => {
                words.vector(subject, ["front.x", "front.y"], front);
                words.vector(subject, ["drift.x", "drift.y"], drift);
                words.vector(subject, ["driven.x", "driven.y"], driven);
                words.bits(subject, "ticks left", life);
            }
        }
    }
}

/// A body in a player's hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    pub body: BodyId,
    /// What the body gets back when it is let go.
    pub gravity_scale: f32,
}

/// A seated player.
#[derive(Clone, Debug)]
pub(super) struct Player {
    pub seat: Seat,
    pub hero: Option<BodyId>,
    /// Ticks until the next try to place a hero.
    pub hero_wait: u32,
    pub selected: Option<BodyId>,
    pub held: Option<Held>,
    pub score: u16,
    /// Where the player pointed last.
    pub pointer: Option<Vec2>,
    /// Where the player points in this tick, if inside the world.
    pub aim: Option<Vec2>,
    pub down: Buttons,
    pressed: Buttons,
}

impl Player {
    pub fn new(seat: Seat, selected: Option<BodyId>) -> Player {
        Player {
            seat,
            hero: None,
            hero_wait: 0,
            selected,
            held: None,
            score: 0,
            pointer: None,
            aim: None,
            down: Buttons::default(),
            pressed: Buttons::default(),
        }
    }

    /// Takes the buttons of a tick.
    pub fn press(&mut self, down: Buttons) {
        self.pressed = Buttons(down.0 & !self.down.0);
        self.down = down;
    }

    /// Whether a button is down.
    pub fn holds(&self, button: Buttons) -> bool {
        self.down.contains(button)
    }

    /// Whether a button went down in this tick.
    pub fn pressed(&self, button: Buttons) -> bool {
        self.pressed.contains(button)
    }

    /// Lets go of a body that is gone.
    pub fn forget(&mut self, body: BodyId) {
        self.hero.take_if(|hero| *hero == body);
        self.selected.take_if(|selected| *selected == body);
        self.held.take_if(|held| held.body == body);
    }

    pub fn words(&self, words: &mut impl Words) {
        let subject = Subject::Player(self.seat.0);
        words.bits(subject, "seat", u32::from(self.seat.0));
        let bodies = [
            ("hero", self.hero),
            ("selected", self.selected),
            ("held", self.held.map(|held| held.body)),
        ];
        for (field, body) in bodies {
            words.name(subject, field, body.unwrap_or(BodyId { index: u32::MAX, generation: 0 }));
        }
        words.number(subject, "gravity scale", self.held.map_or(0.0, |held| held.gravity_scale));
        words.bits(subject, "wait for a hero", self.hero_wait);
        words.bits(subject, "score", u32::from(self.score));
        words.bits(subject, "has pointed", u32::from(self.pointer.is_some()));
        words.vector(subject, ["pointer.x", "pointer.y"], self.pointer.unwrap_or_default());
        words.bits(subject, "buttons", u32::from(self.down.0));
    }
}
