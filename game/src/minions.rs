//! Minions: they wander at a speed of their own, and recover the speed that a bounce takes.

use crate::actor::{Actor, Rule};
use jostle_sim::math::clamp_length;
use jostle_sim::{DT, World};

/// Below this share of its wander speed a minion's heading no longer follows its motion.
const ASTRAY: f32 = 0.5;
/// Below this share a lighter body in its way has stopped it.
const STOPPED: f32 = 0.1;

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

/// After a step: minions head where they move, and a blocked one turns away from its obstacle. A
/// lighter one is no obstacle as long as it can be pushed along: a dye pack turns no minion.
pub(crate) fn turn(world: &World, actors: &mut [Option<Actor>]) {
    for touch in world.touches() {
        let sides = [(touch.a, touch.b, touch.normal), (touch.b, touch.a, -touch.normal)];
        for (id, other, towards) in sides {
            let Some(actor) = &mut actors[id.index as usize] else { continue };
            if let Rule::Wander { heading, speed } = &mut actor.rule {
                let blocked = heading.dot(towards);
                let gives_way = world.inverse_mass(other) > world.inverse_mass(id)
                    && world.velocity(id).dot(*heading) > *speed * STOPPED;
                if blocked > 0.0 && !gives_way {
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
