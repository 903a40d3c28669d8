//! A seated player, as the rules see it.

use crate::input::{Buttons, Input, Seat};
use glam::Vec2;
use jostle_sim::BodyId;
use jostle_sim::state::{StateVisitor, Subject};

/// A body that a player holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Held {
    pub body: BodyId,
    /// Gravity scale that the body gets back on release.
    pub gravity_scale: f32,
}

/// A seated player.
#[derive(Clone, Debug)]
pub(crate) struct Player {
    pub seat: Seat,
    pub hero: Option<BodyId>,
    /// Ticks until the next attempt to place a hero.
    pub hero_wait: u32,
    pub selected: Option<BodyId>,
    pub held: Option<Held>,
    pub score: u16,
    /// Last pointer inside the world.
    pub pointer: Option<Vec2>,
    /// Pointer of this tick, if inside the world.
    pub aim: Option<Vec2>,
    /// Buttons that are down.
    pub down: Buttons,
    /// Buttons that went down in this tick.
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

    /// Takes the input of a tick. A pointer outside the world is ignored: the last one stays (B1).
    pub fn take(&mut self, input: Input, world_size: Vec2) {
        let inside = |pointer: &Vec2| {
            (0.0..=world_size.x).contains(&pointer.x) && (0.0..=world_size.y).contains(&pointer.y)
        };
        self.aim = input.pointer.filter(inside);
        self.pointer = self.aim.or(self.pointer);
        self.pressed = Buttons(input.buttons.0 & !self.down.0);
        self.down = input.buttons;
    }

    /// Returns whether a button is down.
    pub fn holds(&self, button: Buttons) -> bool {
        self.down.contains(button)
    }

    /// Returns whether a button went down in this tick.
    pub fn pressed(&self, button: Buttons) -> bool {
        self.pressed.contains(button)
    }

    /// Drops every reference to a body that is gone.
    pub fn forget(&mut self, body: BodyId) {
        self.hero.take_if(|hero| *hero == body);
        self.selected.take_if(|selected| *selected == body);
        self.held.take_if(|held| held.body == body);
    }

    pub fn visit(&self, visitor: &mut impl StateVisitor) {
        let subject = Subject::OtherNumbered("player", u32::from(self.seat.0));
        visitor.bits(subject, "seat", u32::from(self.seat.0));
        let bodies = [
            ("hero", self.hero),
            ("selected", self.selected),
            ("held", self.held.map(|held| held.body)),
        ];
        for (field, body) in bodies {
            visitor.name(subject, field, body.unwrap_or(BodyId { index: u32::MAX, generation: 0 }));
        }
        visitor.number(subject, "gravity scale", self.held.map_or(0.0, |held| held.gravity_scale));
        visitor.bits(subject, "wait for a hero", self.hero_wait);
        visitor.bits(subject, "score", u32::from(self.score));
        visitor.bits(subject, "has pointed", u32::from(self.pointer.is_some()));
        visitor.vector(subject, ["pointer.x", "pointer.y"], self.pointer.unwrap_or_default());
        visitor.bits(subject, "buttons", u32::from(self.down.0));
    }
}

/// Gives each player its input of this tick. A seat without an entry is at rest: nothing is down.
pub(crate) fn take_inputs(players: &mut [Player], inputs: &[(Seat, Input)], world_size: Vec2) {
    for player in players {
        let input = match inputs.binary_search_by_key(&player.seat, |&(seat, _)| seat) {
            Ok(at) => inputs[at].1.rounded(),
            Err(_) => Input::default(),
        };
        player.take(input, world_size);
    }
}
