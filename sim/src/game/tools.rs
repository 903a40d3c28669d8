//! Tools of players: Z, X, C, V, the click, and H, M, P with the drag.

use super::actor::{Held, Rule};
use super::placing::either_side;
use super::{Buttons, Game, Kind};
use crate::math::{clamp_length, min};
use crate::particle::Source;
use crate::world::{BodyDef, Motion};
use crate::{DT, Tools};
use glam::Vec2;
use std::sync::Arc;

/// Largest change of either component of a velocity that C makes in a tick, units/s.
const AGITATE_SPEED: f32 = 5.0;
/// Speed at which a held body follows the pointer, units/s: fast, but through nothing.
const HOLD_SPEED_MAX: f32 = 120.0;
/// How far from the pointer Z drops a dumb minion, as a share of its half extent (C45).
const DROP_SPREAD: f32 = 0.5;

impl Game {
    /// Tools that act on bodies, before the step: V, C, selection and drag, X.
    pub(super) fn use_tools_on_bodies(&mut self) {
        let any = |button| self.players.iter().any(|player| player.holds(button));
        if self.allows(Tools::CLEAR) && any(Buttons::CLEAR) {
            self.clear_dumb();
        } else if self.allows(Tools::AGITATE) && any(Buttons::AGITATE) {
            self.agitate_dumb();
        }
        for at in 0..self.players.len() {
            if self.allows(Tools::SELECT) {
                self.select(at);
                self.drag(at);
            }
            if self.allows(Tools::HOLD) {
                self.hold(at);
            }
        }
    }

    /// Tools that make something, after the step, so that it appears at the very pointer.
    pub(super) fn make_with_tools(&mut self) {
        for at in 0..self.players.len() {
            let player = &self.players[at];
            let Some(aim) = player.aim else { continue };
            let seat = player.seat;
            let makes = player.holds(Buttons::MAKE);
            if player.pressed(Buttons::FIRE) && self.allows(Tools::LAUNCH) {
                self.launch_pack(seat, aim);
            }
            if makes && self.allows(Tools::DUMB) {
                self.drop_dumb(aim);
            }
            if let Some(recipe) = self.scene.spray.filter(|_| makes && self.allows(Tools::SPRAY)) {
                self.emit(recipe, 1, Source::Point(aim));
            }
        }
    }

    fn clear_dumb(&mut self) {
        for index in 0..self.actors.len() {
            if let Some(actor) = self.actors[index].filter(|actor| actor.kind == Kind::Dumb) {
                self.remove(actor.id);
            }
        }
    }

    fn agitate_dumb(&mut self) {
        for actor in self.actors.iter().flatten().filter(|actor| actor.kind == Kind::Dumb) {
            if self.world.motion(actor.id) == Motion::Static {
                continue;
            }
            let x = self.chance.agitate.range(-AGITATE_SPEED, AGITATE_SPEED);
            let y = self.chance.agitate.range(-AGITATE_SPEED, AGITATE_SPEED);
            let velocity = self.world.velocity(actor.id) + Vec2::new(x, y);
            self.world.set_velocity(actor.id, velocity);
        }
    }

    fn drop_dumb(&mut self, aim: Vec2) {
        let scene = Arc::clone(&self.scene);
        let Some(body) = &scene.dumb else { return };
        let dumb = self.actors.iter().flatten().filter(|actor| actor.kind == Kind::Dumb).count();
        if dumb >= scene.dumb_max || self.room() == 0 {
            return;
        }
        let rng = &mut self.chance.drop;
        let spread = body.shape.half_extent() * DROP_SPREAD;
        let offset = Vec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * spread;
        let velocity = either_side(scene.dumb_speed, rng);
        let position = aim + offset;
        // Inside a wall it would be pushed out on the far side, out of the world.
        let walled = self.world.body_at(position, |id| {
            self.world.motion(id) == Motion::Static
                && scene.groups_meet(body.group, self.world.group(id))
        });
        if walled.is_none() {
            self.add(&BodyDef { position, velocity, ..*body }, Kind::Dumb, None, Rule::Still);
        }
    }

    fn select(&mut self, at: usize) {
        let keys = [
            (Buttons::PICK_HERO, Kind::Hero),
            (Buttons::PICK_MINION, Kind::Minion),
            (Buttons::PICK_PLATFORM, Kind::Platform),
        ];
        for (button, kind) in keys {
            if self.players[at].pressed(button) {
                self.players[at].selected = self.first_of(kind).or(self.players[at].selected);
            }
        }
    }

    /// The selected body's centre is put at the pointer; it need not be hit (B2).
    fn drag(&mut self, at: usize) {
        let player = &self.players[at];
        if let (Some(body), Some(aim)) = (player.selected, player.aim)
            && player.holds(Buttons::FIRE)
        {
            self.world.set_position(body, aim);
            self.world.set_velocity(body, Vec2::ZERO);
        }
    }

    /// The first body that comes under the pointer while X is down is held until X goes up (C44): it is driven
    /// towards the pointer, and gravity loads nothing in the meantime.
    fn hold(&mut self, at: usize) {
        if !self.players[at].holds(Buttons::HOLD) {
            self.let_go(at);
            return;
        }
        if self.players[at].held.is_none() {
            self.take_hold(at);
        }
        let player = &self.players[at];
        let (Some(held), Some(pointer)) = (player.held, player.pointer) else { return };
        let way = pointer - self.world.position(held.body);
        let speed_max = min(HOLD_SPEED_MAX, self.scene.speed_max);
        self.world.set_velocity(held.body, clamp_length(way / DT, speed_max));
    }

    fn take_hold(&mut self, at: usize) {
        let Some(aim) = self.players[at].aim else { return };
        let loose = |id: crate::BodyId| {
            let actor = self.actors[id.index as usize];
            let kind = actor.is_some_and(|actor| matches!(actor.kind, Kind::Dumb | Kind::Block));
            let taken =
                self.players.iter().any(|player| player.held.is_some_and(|held| held.body == id));
            kind && !taken && self.world.motion(id) == Motion::Dynamic
        };
        let Some(body) = self.world.body_at(aim, loose) else { return };
        let gravity_scale = self.world.gravity_scale(body);
        self.world.set_gravity_scale(body, 0.0);
        self.players[at].held = Some(Held { body, gravity_scale });
    }

    pub(super) fn let_go(&mut self, at: usize) {
        if let Some(held) = self.players[at].held.take() {
            self.world.set_gravity_scale(held.body, held.gravity_scale);
        }
    }
}
