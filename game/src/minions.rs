//! Minions: they wander at a speed of their own, and recover the speed that a bounce takes.

use crate::actor::{Actor, Rule};
use jostle_sim::math::clamp_length;
use jostle_sim::{DT, World};

/// Below this share of its wander speed a minion's heading no longer follows its motion.
const ASTRAY: f32 = 0.5;

/// Brings minions back towards their wander speed, along their heading (C38).
pub(crate) fn steer(world: &mut World, actors: &[Option<Actor>], recovery: f32) {
    let gain = recovery * DT;
    for actor in actors.iter().flatten() {
        if let Rule::Wander { heading, speed } = actor.rule {
            let velocity = world.velocity(actor.id);
            let lost = heading * speed - velocity;
            world.set_velocity(actor.id, velocity + clamp_length(lost, gain));
        }
    }
}

/// After a step: minions head where they move, and a blocked one turns away from its obstacle.
pub(crate) fn turn(world: &World, actors: &mut [Option<Actor>]) {
    for touch in world.touches() {
        for (id, towards) in [(touch.a, touch.normal), (touch.b, -touch.normal)] {
            let Some(actor) = &mut actors[id.index as usize] else { continue };
            if let Rule::Wander { heading, .. } = &mut actor.rule {
                let blocked = heading.dot(towards);
                if blocked > 0.0 {
                    *heading -= towards * (2.0 * blocked);
                }
            }
        }
    }
    for actor in actors.iter_mut().flatten() {
        if let Rule::Wander { heading, speed } = &mut actor.rule {
            let velocity = world.velocity(actor.id);
            let moving = velocity.length();
            if moving > *speed * ASTRAY {
                *heading = velocity / moving;
            }
        }
    }
}
