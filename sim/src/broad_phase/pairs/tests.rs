//! Tests that the list is complete, and that it makes no difference when it is built.

use super::*;
use crate::rng::Rng;
use crate::world::{BodyDef, Motion, World, WorldSettings};
use crate::{Shape, Vec2};

/// A box of 200 x 100 with loose circles and boxes at random velocities.
fn gas(count: u32, speed: f32) -> World {
    let mut world = World::new(WorldSettings::default());
    let walls = [(100.0, -5.0, 240.0, 10.0), (-5.0, 50.0, 10.0, 140.0), (205.0, 50.0, 10.0, 140.0)];
    for (x, y, width, height) in walls {
        let shape = Shape::rect(width, height);
        let position = Vec2::new(x, y);
        world.add(&BodyDef { shape, position, motion: Motion::Static, ..BodyDef::default() });
    }
    let mut rng = Rng::new(3, 0);
    for index in 0..count {
        let shape = if index % 2 == 0 {
            Shape::circle(rng.range(0.5, 3.0))
        } else {
            Shape::rect(rng.range(1.0, 6.0), rng.range(1.0, 6.0))
        };
        let position = Vec2::new(rng.range(5.0, 195.0), rng.range(5.0, 95.0));
        let velocity = Vec2::new(rng.range(-speed, speed), rng.range(-speed, speed));
        world.add(&BodyDef { shape, position, velocity, ..BodyDef::default() });
    }
    world
}

/// Finds by brute force the pairs that are near each other.
fn near_pairs(bodies: &Bodies) -> Vec<(u32, u32)> {
    let slots: Vec<u32> = bodies.slots().collect();
    let after = |a: u32| slots.iter().map(move |&b| (a, b)).filter(|&(a, b)| a < b);
    let all = slots.iter().flat_map(|&a| after(a));
    all.filter(|&(a, b)| {
        let movable = bodies.inverse_mass[a as usize] + bodies.inverse_mass[b as usize] > 0.0;
        movable && near(bodies, a, b)
    })
    .collect()
}

#[test]
fn the_list_holds_every_near_pair_at_every_step() {
    let mut world = gas(150, 60.0);
    for step in 0..240 {
        world.step();
        // The positions for which the step built its pairs are gone. Refreshing the list at the current positions
        // must make it complete as well.
        world.pairs.refresh(&world.bodies, world.settings.filter());
        let listed: Vec<(u32, u32)> = world
            .pairs
            .pairs
            .iter()
            .map(|pair| (pair.a, pair.b))
            .filter(|&(a, b)| near(&world.bodies, a, b))
            .collect();
        assert_eq!(listed, near_pairs(&world.bodies), "step {step}");
    }
}

#[test]
fn the_time_of_a_rebuild_changes_no_bit() {
    let (mut lazy, mut eager) = (gas(150, 60.0), gas(150, 60.0));
    for step in 0..600 {
        eager.pairs.invalidate();
        lazy.step();
        eager.step();
        assert_eq!(lazy.hash(), eager.hash(), "step {step}");
    }
}

#[test]
fn the_list_is_complete_where_few_bodies_outgrow_their_boxes() {
    let mut world = gas(300, 0.0);
    let ids: Vec<_> = world.ids().collect();
    let (mut renewals, mut added) = (0, 0);
    for step in 0..240 {
        for &id in ids.iter().skip(5).step_by(60) {
            world.set_velocity(id, Vec2::new(if step % 80 < 40 { 100.0 } else { -100.0 }, 20.0));
        }
        if step % 50 == 49 {
            world.remove(ids[step / 50]);
        }
        world.step();
        world.pairs.refresh(&world.bodies, world.settings.filter());
        renewals += usize::from(world.pairs.added > added);
        added = world.pairs.added;
        let pairs = world.pairs.pairs.iter().map(|pair| (pair.a, pair.b));
        let listed: Vec<(u32, u32)> = pairs.filter(|&(a, b)| near(&world.bodies, a, b)).collect();
        assert_eq!(listed, near_pairs(&world.bodies), "step {step}");
    }
    assert!(renewals > 30, "{renewals} renewals");
}
