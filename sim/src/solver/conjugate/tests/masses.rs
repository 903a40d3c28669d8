//! Tests heaps of bodies whose masses differ by many orders of magnitude.

use super::*;
use crate::rng::Rng;

/// Beyond the masses allowed in scenes, sweeps in f32 fail. Without the guard, a heap throws bodies up at 250,000
/// units/s.
#[test]
fn heaps_of_any_masses_throw_nothing_far_up() {
    for (decades, speed_max) in [(6.0, 150.0), (9.0, 1000.0)] {
        for seed in 0..12 {
            let mut rng = Rng::new(seed, 0);
            let mut world = heap(&mut rng, 12 + 25 * (seed as usize % 4), decades);
            for step in 0..400 {
                world.step();
                for id in dynamic(&world) {
                    let speed = world.velocity(id).y;
                    assert!(speed < speed_max, "seed {seed}, step {step}: {speed} units/s upwards");
                }
            }
        }
    }
}

/// `count` discs and boxes between two walls, with masses that differ by up to this many orders of magnitude.
fn heap(rng: &mut Rng, count: usize, decades: f32) -> World {
    let mut world = World::new(WorldSettings {
        gravity: Vec2::new(0.0, -50.0),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        ..WorldSettings::default()
    });
    let width = 12.0 + 0.12 * count as f32;
    for (x, y, size) in [
        (0.0, -1.0, Vec2::new(2.0 * width + 8.0, 2.0)),
        (-width - 1.0, 100.0, Vec2::new(2.0, 204.0)),
        (width + 1.0, 100.0, Vec2::new(2.0, 204.0)),
    ] {
        let (shape, motion) = (Shape::rect(size.x, size.y), Motion::Static);
        let def = BodyDef { shape, position: Vec2::new(x, y), motion, ..BodyDef::default() };
        add(&mut world, BodyDef { friction: 0.3, ..def });
    }
    let columns = (width / 1.2) as usize;
    for index in 0..count {
        let (column, row) = ((index % columns) as f32, (index / columns) as f32);
        let shape =
            if rng.range(0.0, 1.0) < 0.5 { Shape::circle(1.0) } else { Shape::rect(2.0, 2.0) };
        let body = BodyDef {
            shape,
            position: Vec2::new(1.3 - width + 2.3 * column + rng.range(0.0, 0.1), 2.0 + 2.4 * row),
            velocity: Vec2::new(rng.range(-10.0, 10.0), rng.range(-10.0, 10.0)),
            mass: libm::powf(10.0, decades * rng.range(-0.5, 0.5)),
            friction: 0.3,
            ..BodyDef::default()
        };
        add(&mut world, body);
    }
    world
}
