//! Tests that the result for an island depends on nothing outside it.

use super::*;
use crate::rng::Rng;

/// A tray with bouncing balls and boxes, around `x`.
fn tray(world: &mut World, x: f32, rng: &mut Rng) -> Vec<BodyId> {
    let wall = |shape, dx: f32, y: f32| BodyDef {
        shape,
        position: Vec2::new(x + dx, y),
        motion: Motion::Static,
        ..BodyDef::default()
    };
    for def in [
        wall(Shape::rect(40.0, 2.0), 0.0, -1.0),
        wall(Shape::rect(2.0, 40.0), -20.0, 19.0),
        wall(Shape::rect(2.0, 40.0), 20.0, 19.0),
    ] {
        world.add(&def).expect("there is room");
    }
    let mut bodies = Vec::new();
    for index in 0..60 {
        let size = rng.range(0.6, 2.4);
        let shape =
            if index % 2 == 0 { Shape::circle(0.5 * size) } else { Shape::rect(size, size) };
        let position = Vec2::new(x + rng.range(-16.0, 16.0), rng.range(2.0, 30.0));
        let restitution = if index % 3 == 0 { 0.6 } else { 0.0 };
        let def = BodyDef { shape, position, restitution, ..BodyDef::default() };
        bodies.push(world.add(&def).expect("there is room"));
    }
    bodies
}

/// In every 20th step, changes each body's velocity by up to `most` units/s.
fn shake(world: &mut World, bodies: &[BodyId], step: u32, most: f32, rng: &mut Rng) {
    if step % 20 == 19 {
        for &id in bodies {
            let push = Vec2::new(rng.range(-most, most), rng.range(-most, most));
            world.set_velocity(id, world.velocity(id) + push);
        }
    }
}

#[test]
fn an_island_moves_by_the_same_bits_whatever_happens_elsewhere() {
    for seed in 3..15 {
        stays_the_same_beside_another(seed);
    }
}

fn stays_the_same_beside_another(seed: u64) {
    let (mut alone, mut beside) = (world(), world());
    let mut rngs = [Rng::new(seed, 0), Rng::new(seed, 0)];
    let ours = tray(&mut alone, 0.0, &mut rngs[0]);
    assert_eq!(tray(&mut beside, 0.0, &mut rngs[1]), ours);
    let mut other_rng = Rng::new(seed, 1);
    // This is so far away that nothing thrown out of the other tray gets here.
    let others = tray(&mut beside, 32_768.0, &mut other_rng);
    for step in 0..400 {
        shake(&mut alone, &ours, step, 40.0, &mut rngs[0]);
        shake(&mut beside, &ours, step, 40.0, &mut rngs[1]);
        shake(&mut beside, &others, step, 200.0, &mut other_rng);
        alone.step();
        beside.step();
        for &id in ours.iter().filter(|&&id| alone.contains(id)) {
            assert_eq!(alone.position(id), beside.position(id), "body {} at {step}", id.index);
            assert_eq!(alone.velocity(id), beside.velocity(id), "body {} at {step}", id.index);
        }
        let seen = beside.touches().iter().filter(|touch| ours.contains(&touch.b));
        assert!(alone.touches().iter().eq(seen), "touches at {step}");
    }
}
