//! Platforms and other bodies that follow a path.

use crate::scene::Scene;
use jostle_sim::{BodyId, World};

/// Gives bodies on a path the velocity that takes them to their position at the end of the tick. `tick_of` returns
/// the path tick of each body.
pub(crate) fn drive(
    world: &mut World,
    placed: &[Option<BodyId>],
    scene: &Scene,
    tick_of: impl Fn(usize) -> u32,
) {
    for (index, (body, id)) in scene.bodies.iter().zip(placed).enumerate() {
        if let (Some(path), &Some(id)) = (&body.path, id) {
            let (tick, position) = (tick_of(index), world.position(id));
            let velocity = path.velocity_to(tick, position, scene.world.speed_max);
            world.set_velocity(id, velocity);
        }
    }
}
