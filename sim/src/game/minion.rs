//! Minions: they wander at a speed of their own, and what a bounce takes of it comes back.

use super::Game;
use super::actor::Rule;
use crate::DT;
use crate::math::clamp_length;

/// Below this share of its wander speed a minion no longer heads where it moves.
const ASTRAY: f32 = 0.5;

impl Game {
    /// Brings minions back towards their speed, along the way that they head (C38).
    pub(super) fn steer_minions(&mut self) {
        let gain = self.scene.minion.recovery * DT;
        for actor in self.actors.iter().flatten() {
            if let Rule::Wander { heading, speed } = actor.rule {
                let velocity = self.world.velocity(actor.id);
                let lost = heading * speed - velocity;
                self.world.set_velocity(actor.id, velocity + clamp_length(lost, gain));
            }
        }
    }

    /// After a step: minions head where they move, and one that was stopped turns away from
    /// what stopped it.
    pub(super) fn turn_minions(&mut self) {
        for touch in self.world.touches() {
            for (id, towards) in [(touch.a, touch.normal), (touch.b, -touch.normal)] {
                let Some(actor) = &mut self.actors[id.index as usize] else { continue };
                if let Rule::Wander { heading, .. } = &mut actor.rule {
                    let blocked = heading.dot(towards);
                    if blocked > 0.0 {
                        *heading -= towards * (2.0 * blocked);
                    }
                }
            }
        }
        for actor in self.actors.iter_mut().flatten() {
            if let Rule::Wander { heading, speed } = &mut actor.rule {
                let velocity = self.world.velocity(actor.id);
                let moving = velocity.length();
                if moving > *speed * ASTRAY {
                    *heading = velocity / moving;
                }
            }
        }
    }
}
