//! Platforms and other bodies that follow a path.

use crate::scene::Scene;
use jostle_sim::{BodyId, World};

/// Gives bodies on a path the velocity that takes them to their position at the end of `tick`.
pub(crate) fn drive(world: &mut World, placed: &[Option<BodyId>], scene: &Scene, tick: u32) {
    for (body, id) in scene.bodies.iter().zip(placed) {
        if let (Some(path), &Some(id)) = (&body.path, id) {
            let velocity = path.velocity_to(tick, world.position(id), scene.world.speed_max);
            world.set_velocity(id, velocity);
        }
    }
}
