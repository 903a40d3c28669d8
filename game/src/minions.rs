//! Minions either wander at a fixed speed or rest, and return to that motion after a bounce.

use crate::roster::{Actor, Rule};
use crate::scene::Kind;
use glam::Vec2;
use jostle_sim::math::clamp_length;
use jostle_sim::{BodyId, DT, Motion, World};

/// Below this share of its wander speed, a minion's heading no longer follows its motion.
const ASTRAY: f32 = 0.5;
/// Below this share of its wander speed, a minion counts as having been stopped by a lighter body in its way.
const STOPPED: f32 = 0.1;

/// Brings wandering minions back towards their wander speed along their heading (C38), and minions that started at
/// rest back to rest.
pub(crate) fn steer(world: &mut World, actors: &[Option<Actor>], recovery: f32) {
    let gain = recovery * DT;
    for actor in actors.iter().flatten() {
        let own = match actor.rule {
            Rule::Wander { heading, speed, .. } => heading * speed,
            Rule::Still if actor.kind == Kind::Minion && floats(world, actor.id) => Vec2::ZERO,
            _ => continue,
        };
        let velocity = world.velocity(actor.id);
        let lost = own - velocity;
        world.set_velocity(actor.id, velocity + clamp_length(lost, gain));
    }
}

/// Whether a body can move but does not fall. Falling bodies come to rest on the floor by themselves.
fn floats(world: &World, id: BodyId) -> bool {
    let gravity = world.settings().gravity * world.gravity_scale(id);
    world.motion(id) == Motion::Dynamic && gravity == Vec2::ZERO
}

/// After a step, points minions in the direction in which they move, and turns a blocked minion away from its
/// obstacle. A lighter body is not an obstacle as long as it can be pushed along. A lighter dye pack never turns a
/// minion, no matter which of the two is faster (A2.34): the minion keeps its heading until it has recovered.
pub(crate) fn turn(world: &World, actors: &mut [Option<Actor>], recovery: f32) {
    for touch in world.touches() {
        let sides = [(touch.a, touch.b, touch.normal), (touch.b, touch.a, -touch.normal)];
        for (id, other, towards) in sides {
            let is_pack =
                actors[other.index as usize].is_some_and(|other| other.kind == Kind::Pack);
            let Some(actor) = &mut actors[id.index as usize] else { continue };
            if let Rule::Wander { heading, speed, is_pushed } = &mut actor.rule {
                let is_lighter = world.inverse_mass(other) > world.inverse_mass(id);
                if is_pack && is_lighter {
                    *is_pushed = true;
                    continue;
                }
                *is_pushed &= world.motion(other) != Motion::Dynamic;
                let blocked = heading.dot(towards);
                let gives_way = is_lighter && world.velocity(id).dot(*heading) > *speed * STOPPED;
                if blocked > 0.0 && !gives_way {
                    *heading -= towards * (2.0 * blocked);
                }
            }
        }
    }
    for actor in actors.iter_mut().flatten() {
        if let Rule::Wander { heading, speed, is_pushed } = &mut actor.rule {
            let velocity = world.velocity(actor.id);
            let moving = velocity.length();
            if *is_pushed {
                *is_pushed = (*heading * *speed - velocity).length() > recovery * DT;
            } else if moving > *speed * ASTRAY {
                *heading = velocity / moving;
            }
        }
    }
}
