//! A seated player, as seen by the rules.

use crate::input::{Buttons, Input, Seat};
use crate::side::SideState;
use glam::Vec2;
use jostle_sim::{BodyId, Motion, World};

/// A body held by a player.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldBody {
    pub body: BodyId,
    /// Gravity scale to restore when the body is released.
    pub gravity_scale: f32,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Player {
    pub seat: Seat,
    pub hero: Option<BodyId>,
    /// Ticks until the next attempt to place a hero.
    pub hero_wait: u32,
    pub selected: Option<BodyId>,
    pub held: Option<HeldBody>,
    pub score: u16,
    /// The team, in a scene with teams.
    pub team: Option<u8>,
    /// The player's standing in the round, if there are no teams.
    pub standing: SideState,
    /// Ticks until the next dye pack may be thrown.
    pub throw_wait: u32,
    /// Position where the hero last appeared.
    pub home: Vec2,
    /// Position where the hero respawns instead, if one is set.
    pub checkpoint: Option<Vec2>,
    /// The body carried by the hero.
    pub carried: Option<HeldBody>,
    /// The hero that left the world in this tick.
    pub lost: Option<BodyId>,
    pub controls: PlayerControls,
}

/// A player's pointer and keys.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlayerControls {
    /// Whether no input arrived for this tick because the connection is closed or silent. Hits on such a player
    /// score nothing.
    pub is_away: bool,
    /// Ticks during which the player's keys do nothing.
    pub stun: u32,
    /// Most recent pointer position inside the world.
    pub pointer: Option<Vec2>,
    /// The same, one tick earlier.
    pub pointer_before: Option<Vec2>,
    /// Pointer in this tick, if it is inside the world.
    pub aim: Option<Vec2>,
    /// Buttons that are down.
    pub down: Buttons,
    /// Buttons that went down in this tick.
    pressed: Buttons,
}

impl PlayerControls {
    /// Takes the input for a tick. It is `None` while the player is away, in which case no button is down. A pointer
    /// outside the world is ignored, and the previous one is kept (B1).
    pub fn take(&mut self, input: Option<Input>, world_size: Vec2) {
        let inside = |pointer: &Vec2| {
            (0.0..=world_size.x).contains(&pointer.x) && (0.0..=world_size.y).contains(&pointer.y)
        };
        self.is_away = input.is_none();
        let input = input.unwrap_or_default();
        let mut down = input.buttons();
        if self.stun > 0 {
            self.stun -= 1;
            down.0 &= Buttons::OF_ROUND.0;
        }
        self.aim = input.pointer().filter(inside);
        self.pointer_before = self.pointer;
        self.pointer = self.aim.or(self.pointer);
        self.pressed = Buttons(down.0 & !self.down.0);
        self.down = down;
    }

    /// Returns whether a button is down.
    pub fn holds(&self, button: Buttons) -> bool {
        self.down.contains(button)
    }

    /// Returns whether a button went down in this tick.
    pub fn pressed(&self, button: Buttons) -> bool {
        self.pressed.contains(button)
    }
}

impl Player {
    /// Resets the state left over from the previous round.
    pub fn begin_round(&mut self) {
        self.controls.stun = 0;
        self.throw_wait = 0;
        self.checkpoint = None;
        self.hero_wait = 0;
    }

    /// Attaches a body to the hero in place of any other, provided the body still exists and is dynamic.
    pub fn carry(&mut self, body: BodyId, world: &mut World) {
        if !world.contains(body) || world.motion(body) != Motion::Dynamic {
            return;
        }
        if self.carried.is_none_or(|carried| carried.body != body) {
            self.drop_carried(world);
            let gravity_scale = world.gravity_scale(body);
            world.set_gravity_scale(body, 0.0);
            self.carried = Some(HeldBody { body, gravity_scale });
        }
    }

    /// Drops the body that the hero carries.
    pub fn drop_carried(&mut self, world: &mut World) {
        if let Some(carried) = self.carried.take() {
            world.set_gravity_scale(carried.body, carried.gravity_scale);
        }
    }

    /// Releases a body that is about to be moved elsewhere.
    pub fn let_go_of(&mut self, body: BodyId, world: &mut World) {
        if let Some(held) = self.held.take_if(|held| held.body == body) {
            world.set_gravity_scale(body, held.gravity_scale);
        }
        if self.carried.is_some_and(|carried| carried.body == body) {
            self.drop_carried(world);
        }
    }

    /// Drops every reference to a body that is gone.
    pub fn forget(&mut self, body: BodyId) {
        self.hero.take_if(|hero| *hero == body);
        self.selected.take_if(|selected| *selected == body);
        self.held.take_if(|held| held.body == body);
        self.carried.take_if(|carried| carried.body == body);
    }
}

/// Gives each player their input for this tick.
pub(crate) fn take_inputs(players: &mut [Player], inputs: &[(Seat, Input)], world_size: Vec2) {
    for player in players {
        let found = inputs.binary_search_by_key(&player.seat, |&(seat, _)| seat);
        player.throw_wait = player.throw_wait.saturating_sub(1);
        player.lost = None;
        player.controls.take(found.ok().map(|at| inputs[at].1), world_size);
    }
}
