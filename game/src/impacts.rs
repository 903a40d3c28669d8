//! Reports hard contacts.

use crate::event::Event;
use crate::scene::Scene;
use glam::Vec2;
use jostle_sim::Touch;
use jostle_sim::{Shape, World, math};

/// Maximum number of impacts reported per tick, hardest first. The others still take effect.
pub(crate) const IMPACTS_PER_TICK_MAX: usize = 32;

/// Reports contacts that began harder than the scene's report speed, hardest first. `hard` is
/// scratch memory.
pub(crate) fn report(world: &World, scene: &Scene, hard: &mut Vec<u64>, events: &mut Vec<Event>) {
    if scene.world.solver.is_none() {
        return;
    }
    let touches = world.touches();
    let is_hard = |touch: &Touch| touch.began && touch.closing > scene.impact_speed;
    hard.clear();
    // Among equally hard impacts, those with the lower ids are kept.
    let key =
        |(index, touch): (u64, &Touch)| u64::from(!math::ordered_bits(touch.closing)) << 32 | index;
    hard.extend((0u64..).zip(touches).filter(|(_, touch)| is_hard(touch)).map(key));
    hard.sort_unstable();
    hard.truncate(IMPACTS_PER_TICK_MAX);
    events.extend(hard.iter().map(|&key| {
        let touch = &touches[key as u32 as usize];
        let point = contact_point(world, touch);
        Event::Impact { a: touch.a, b: touch.b, point, speed: touch.closing }
    }));
}

/// The centre of the region in which two bodies overlap.
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

/// The centre of the overlap between two intervals.
fn middle(center_a: f32, half_a: f32, center_b: f32, half_b: f32) -> f32 {
    let low = math::max(center_a - half_a, center_b - half_b);
    let high = math::min(center_a + half_a, center_b + half_b);
    (low + high) * 0.5
}
