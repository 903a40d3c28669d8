//! Walking heroes, which run along the ground and jump off it.

use crate::input::Buttons;
use crate::scene::{HeroSpec, Scene, WalkSpec};
use glam::Vec2;
use jostle_sim::math::{clamp, max};
use jostle_sim::{BodyId, DT, World, collide};

/// Distance below a hero's feet within which a body counts as ground, world units. It is more than a hero at
/// rest sinks in or bounces.
const REACH: f32 = 0.25;
/// Steepest ground on which a hero can stand, as the minimum component of its normal against gravity.
const STEEP: f32 = 0.7;
/// Time that a hero takes to reach running speed from a standstill, seconds.
const RUN_UP: f32 = 0.1;

impl WalkSpec {
    /// The velocity of a hero after a tick with these buttons down, before the world steps. `ground` is the velocity
    /// of the ground under it.
    fn steered(self, velocity: Vec2, down: Buttons, ground: Option<Vec2>) -> Vec2 {
        let run = down.axis(Buttons::RIGHT, Buttons::LEFT) * self.speed;
        let mut steered = velocity;
        if run != 0.0 || ground.is_some() {
            let wanted = ground.map_or(0.0, |ground| ground.x) + run;
            let gain = self.speed * (DT / RUN_UP);
            steered.x += clamp(wanted - velocity.x, -gain, gain);
        }
        if let Some(ground) = ground.filter(|_| down.contains(Buttons::UP)) {
            steered.y = max(self.jump, ground.y);
        }
        steered
    }
}

impl HeroSpec {
    /// The velocity of a hero in `world` after a tick with these buttons down, before the world steps.
    pub fn steered_in(&self, world: &World, scene: &Scene, hero: BodyId, down: Buttons) -> Vec2 {
        let velocity = world.velocity(hero);
        match self.walk {
            None => self.thrusted(velocity, down),
            Some(walk) => walk.steered(velocity, down, ground_of(world, scene, hero)),
        }
    }
}

/// The velocity of the ground under a hero, if it stands on any. This is the velocity of the first body below its
/// feet, in id order, unless the hero is leaving it.
fn ground_of(world: &World, scene: &Scene, hero: BodyId) -> Option<Vec2> {
    let (shape, group, velocity) = (world.shape(hero), world.group(hero), world.velocity(hero));
    let feet = world.position(hero) - Vec2::new(0.0, REACH);
    let grounds = world.ids().filter(|&id| id != hero && scene.groups_meet(group, world.group(id)));
    let mut grounds = grounds.filter(|&id| {
        let found = collide(shape, feet, world.shape(id), world.position(id), (0, 1));
        found.is_some_and(|manifold| manifold.normal.y <= -STEEP)
    });
    // A hero that rises from the ground too fast to be settling on it has jumped.
    grounds.find_map(|id| {
        let ground = world.velocity(id);
        (velocity.y - ground.y <= REACH / DT).then_some(ground)
    })
}
