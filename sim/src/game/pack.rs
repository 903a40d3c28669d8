//! Dye packs: launched by players, they chase a hero and burst on it.
//!
//! A pack's velocity is its own motion plus its drift. Its own motion is part of what contacts
//! see (C21), so it pushes like any body; what they change becomes drift, which dies away, so that
//! a pack in front of a platform slides along it, and a hero behind a platform has cover (C39).

use super::actor::{Actor, Rule};
use super::{Event, Game, Kind, Seat};
use crate::contact::collide;
use crate::math::{atan2, clamp, rotate};
use crate::particle::Source;
use crate::shape::Shape;
use crate::world::BodyDef;
use glam::Vec2;
use std::sync::Arc;

/// Packs look to the right when they appear (B3).
const FRONT_AT_START: Vec2 = Vec2::X;

impl Game {
    /// Turns packs towards their targets, moves them, and removes the worn-out ones.
    pub(super) fn steer_packs(&mut self) {
        let scene = Arc::clone(&self.scene);
        let Some(spec) = &scene.pack else { return };
        let heroes = self.list_heroes();
        for index in 0..self.actors.len() {
            let Some(actor) = self.actors[index] else { continue };
            let Rule::Chase { front, drift, life, .. } = actor.rule else { continue };
            if life <= 1 {
                self.remove(actor.id);
                continue;
            }
            let front = match self.target_of(actor, &heroes) {
                Some(target) => turned(front, target - self.world.position(actor.id), spec.turn),
                None => front,
            };
            let drift = drift * spec.drift;
            let driven = front * spec.speed + drift;
            self.world.set_velocity(actor.id, driven);
            let rule = Rule::Chase { front, drift, driven, life: life - 1 };
            self.actors[index] = Some(Actor { rule, ..actor });
        }
        self.heroes = heroes;
    }

    /// All heroes, owned or not, in index order; the list is to be given back.
    fn list_heroes(&mut self) -> Vec<Actor> {
        let mut heroes = std::mem::take(&mut self.heroes);
        heroes.clear();
        heroes.extend(self.actors.iter().flatten().filter(|actor| actor.kind == Kind::Hero));
        heroes
    }

    /// The centre of the nearest hero that a pack may burst on.
    fn target_of(&self, pack: Actor, heroes: &[Actor]) -> Option<Vec2> {
        let place = self.world.position(pack.id);
        let mut nearest: Option<(f32, Vec2)> = None;
        for hero in heroes.iter().filter(|hero| self.is_prey(hero.owner, pack.owner)) {
            let center = self.world.position(hero.id);
            let distance = (center - place).length_squared();
            if nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, center));
            }
        }
        nearest.map(|(_, center)| center)
    }

    /// Packs spare their owner's hero, unless the owner plays alone.
    fn is_prey(&self, hero: Option<Seat>, owner: Option<Seat>) -> bool {
        hero != owner || self.players.len() == 1
    }

    /// After a step: what contacts changed of a pack's velocity becomes drift.
    pub(super) fn feel_contacts_of_packs(&mut self) {
        for actor in self.actors.iter_mut().flatten() {
            if let Rule::Chase { drift, driven, .. } = &mut actor.rule {
                *drift += self.world.velocity(actor.id) - *driven;
            }
        }
    }

    /// Packs that touch a hero are gone; the burst starts in the same tick (A4.8).
    pub(super) fn burst_packs(&mut self) {
        let scene = Arc::clone(&self.scene);
        let Some(spec) = &scene.pack else { return };
        let heroes = self.list_heroes();
        for index in 0..self.actors.len() {
            let pack = self.actors[index].filter(|actor| actor.kind == Kind::Pack);
            let Some(pack) = pack else { continue };
            let Some((hero, point)) = self.hit_by(pack, &heroes) else { continue };
            let victim = hero.owner;
            self.remove(pack.id);
            let Some(owner) = pack.owner else { continue };
            if victim != Some(owner)
                && let Some(player) = self.players.iter_mut().find(|player| player.seat == owner)
            {
                player.score = player.score.saturating_add(1);
            }
            self.events.push(Event::PackHit { owner, victim, hero: hero.id, point });
            if spec.burst > 0 {
                self.emit(spec.recipe, spec.burst, Source::Point(point));
            }
        }
        self.heroes = heroes;
    }

    /// The first hero that the pack touches, and where.
    fn hit_by(&self, pack: Actor, heroes: &[Actor]) -> Option<(Actor, Vec2)> {
        let (shape, center) = (self.world.shape(pack.id), self.world.position(pack.id));
        let touched = |hero: &&Actor| {
            let (other, place) = (self.world.shape(hero.id), self.world.position(hero.id));
            self.is_prey(hero.owner, pack.owner)
                && collide(shape, center, other, place, (pack.id.index, hero.id.index)).is_some()
        };
        let hero = *heroes.iter().find(touched)?;
        let place = self.world.position(hero.id);
        Some((hero, nearest_point(self.world.shape(hero.id), place, center)))
    }

    /// A click launches a pack at the pointer, within the player's cap.
    pub(super) fn launch_pack(&mut self, seat: Seat, place: Vec2) {
        let scene = Arc::clone(&self.scene);
        let Some(spec) = &scene.pack else { return };
        let own = |actor: &&Actor| actor.kind == Kind::Pack && actor.owner == Some(seat);
        let flying = self.actors.iter().flatten().filter(own).count();
        if flying >= scene.packs_max || self.room() == 0 {
            return;
        }
        let velocity = FRONT_AT_START * spec.speed;
        let rule = Rule::Chase {
            front: FRONT_AT_START,
            drift: Vec2::ZERO,
            driven: velocity,
            life: spec.life_ticks,
        };
        let def = BodyDef { position: place, velocity, ..spec.body };
        self.add(&def, Kind::Pack, Some(seat), rule);
    }
}

/// `front` after turning a share of the signed angle to `way` (A4.9).
fn turned(front: Vec2, way: Vec2, share: f32) -> Vec2 {
    let angle = atan2(front.perp_dot(way), front.dot(way));
    let turned = rotate(front, angle * share);
    turned / turned.length()
}

/// The point of a placed shape that is nearest to `from`; `from` itself if it lies inside.
fn nearest_point(shape: Shape, center: Vec2, from: Vec2) -> Vec2 {
    let away = from - center;
    match shape {
        Shape::Circle { radius } => center + crate::math::clamp_length(away, radius),
        Shape::Box { half } => {
            center + Vec2::new(clamp(away.x, -half.x, half.x), clamp(away.y, -half.y, half.y))
        }
    }
}
