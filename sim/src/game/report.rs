//! What a step has to report: hard contacts and bodies that left the world.

use super::hero::RESPAWN_TICKS;
use super::{Event, Game, Kind};
use crate::shape::Shape;
use crate::world::{Touch, World};
use glam::Vec2;

/// Impacts that one tick reports, the hardest ones; further ones are only felt.
pub const IMPACTS_PER_TICK_MAX: usize = 32;

impl Game {
    /// Contacts that began harder than the scene's report speed, hardest first.
    pub(super) fn report_impacts(&mut self) {
        if self.scene.solver.is_none() {
            return;
        }
        let Game { world, impacts, events, scene, .. } = self;
        let touches = world.touches();
        let hard = |touch: &Touch| touch.began && touch.closing > scene.impact_speed;
        impacts.clear();
        impacts.extend((0u32..).zip(touches).filter(|(_, touch)| hard(touch)).map(|(at, _)| at));
        let closing = |at: u32| touches[at as usize].closing;
        // Of equally hard ones those with the lower ids stay.
        impacts.sort_unstable_by(|&one, &other| {
            closing(other).total_cmp(&closing(one)).then(one.cmp(&other))
        });
        impacts.truncate(IMPACTS_PER_TICK_MAX);
        events.extend(impacts.iter().map(|&at| {
            let touch = &touches[at as usize];
            Event::Impact {
                a: touch.a,
                b: touch.b,
                point: contact_point(world, touch),
                speed: touch.closing,
            }
        }));
    }

    /// Bodies that left the kill zone; the players of lost heroes wait for the next one.
    pub(super) fn report_departed(&mut self) {
        for place in 0..self.world.departed().len() {
            let (id, point) = self.world.departed()[place];
            let player = self.players.iter_mut().find(|player| player.hero == Some(id));
            if let Some(player) = player {
                player.hero_wait = RESPAWN_TICKS;
            }
            let kind = self.forget(id).map_or(Kind::Block, |actor| actor.kind);
            self.events.push(Event::BodyLeft { kind, body: id, point });
        }
    }
}

/// The middle of an overlap.
fn contact_point(world: &World, touch: &Touch) -> Vec2 {
    let (shape_a, shape_b) = (world.shape(touch.a), world.shape(touch.b));
    let (center_a, center_b) = (world.position(touch.a), world.position(touch.b));
    let half_depth = touch.depth * 0.5;
    match (shape_a, shape_b) {
        (Shape::Circle { radius }, _) => center_a + touch.normal * (radius - half_depth),
        (_, Shape::Circle { radius }) => center_b - touch.normal * (radius - half_depth),
        (Shape::Box { half: half_a }, Shape::Box { half: half_b }) => Vec2::new(
            middle(center_a.x, half_a.x, center_b.x, half_b.x),
            middle(center_a.y, half_a.y, center_b.y, half_b.y),
        ),
    }
}

/// The middle of what two intervals share.
fn middle(center_a: f32, half_a: f32, center_b: f32, half_b: f32) -> f32 {
    let low = crate::math::max(center_a - half_a, center_b - half_b);
    let high = crate::math::min(center_a + half_a, center_b + half_b);
    (low + high) * 0.5
}
