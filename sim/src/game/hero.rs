//! Heroes of players: where they appear and how they are steered.

use super::actor::Rule;
use super::{Buttons, Game, Kind};
use crate::contact::collide;
use crate::math::{clamp_length, max};
use crate::scene::HeroSpec;
use crate::world::{BodyDef, BodyId};
use crate::{DT, Tools};
use glam::Vec2;
use std::sync::Arc;

/// Ticks from the loss of a hero to the next one.
pub(super) const RESPAWN_TICKS: u32 = 30;
/// Ticks from one try to find a clear place to the next.
const RETRY_TICKS: u32 = 10;
/// Random places tried when no spawn point is clear.
const PLACES_TRIED: u32 = 16;

impl Game {
    /// Heroes of players who have none and have waited.
    pub(super) fn spawn_heroes(&mut self) {
        for at in 0..self.players.len() {
            let player = &mut self.players[at];
            if player.hero.is_none() && player.hero_wait > 0 {
                player.hero_wait -= 1;
            } else if player.hero.is_none() {
                self.spawn_hero(at);
            }
        }
    }

    /// Places the hero of a player, or has the player wait where nothing is clear.
    pub(super) fn spawn_hero(&mut self, at: usize) {
        let scene = Arc::clone(&self.scene);
        let Some(spec) = &scene.hero else { return };
        let seat = self.players[at].seat;
        let hero = self.clear_place(spec, usize::from(seat.0)).and_then(|position| {
            let def = BodyDef { position, ..spec.body };
            self.add(&def, Kind::Hero, Some(seat), Rule::Still)
        });
        self.players[at].hero = hero;
        self.players[at].hero_wait = RETRY_TICKS;
    }

    /// A place where a hero touches nothing that it collides with: a spawn point, from the seat's
    /// own on, else one at random in the world.
    fn clear_place(&mut self, spec: &HeroSpec, first: usize) -> Option<Vec2> {
        let count = spec.spawns.len();
        let points = (0..count).map(|step| spec.spawns[(first + step) % count]);
        if let Some(point) = points.into_iter().find(|&point| self.is_clear(&spec.body, point)) {
            return Some(point);
        }
        for _ in 0..PLACES_TRIED {
            let (x, y) = (self.chance.spawn.unit(), self.chance.spawn.unit());
            let point = Vec2::new(x, y) * self.scene.size;
            if self.is_clear(&spec.body, point) {
                return Some(point);
            }
        }
        None
    }

    fn is_clear(&self, body: &BodyDef, place: Vec2) -> bool {
        let free_of = |id: BodyId| {
            let (shape, center) = (self.world.shape(id), self.world.position(id));
            !self.scene.groups_meet(body.group, self.world.group(id))
                || collide(body.shape, place, shape, center, (0, 1)).is_none()
        };
        self.world.ids().all(free_of)
    }

    /// WASD changes velocities; past the scene's speed thrust only turns.
    pub(super) fn thrust_heroes(&mut self) {
        let scene = Arc::clone(&self.scene);
        let Some(spec) = scene.hero.as_ref().filter(|_| self.allows(Tools::STEER)) else { return };
        for player in &self.players {
            let Some(hero) = player.hero else { continue };
            let before = self.world.velocity(hero);
            self.world.set_velocity(hero, spec.steered(before, player.down));
        }
    }
}

impl HeroSpec {
    /// The velocity of a hero after a tick with these buttons down, before the world steps.
    pub fn steered(&self, velocity: Vec2, down: Buttons) -> Vec2 {
        let push = Vec2::new(
            down.axis(Buttons::RIGHT, Buttons::LEFT),
            down.axis(Buttons::UP, Buttons::DOWN),
        );
        if push == Vec2::ZERO {
            return velocity;
        }
        let speed_max = max(self.speed_max, velocity.length());
        clamp_length(velocity + push * self.thrust * DT, speed_max)
    }
}
