//! Shakes a pile, and tests that work is bounded, overlaps are small, no bodies are lost and there is no hidden state.

use super::*;
use crate::state::bytes::{StateReader, StateWriter};

const WIDTH: f32 = 60.0;

/// 400 circles and boxes falling into a closed room.
fn pile(rng: &mut Rng, restitution: f32) -> World {
    let mut world = world();
    fixed(&mut world, (0.0, -10.0), (WIDTH, 10.0), 0.3);
    fixed(&mut world, (0.0, 150.0), (WIDTH, 10.0), 0.3);
    for side in [-1.0, 1.0] {
        fixed(&mut world, (side * (WIDTH / 2.0 + 10.0), 70.0), (10.0, 90.0), 0.3);
    }
    for index in 0..400 {
        let (row, column) = ((index / 16) as f32, (index % 16) as f32);
        let size = rng.range(0.7, 1.5);
        let shape = if rng.below(2) == 0 {
            Shape::circle(size)
        } else {
            Shape::rect(2.0 * size, 2.0 * rng.range(0.7, 1.5))
        };
        let position = Vec2::new((column - 7.5) * 3.6, 2.0 + row * 3.4);
        add(&mut world, BodyDef { shape, position, restitution, ..BodyDef::default() });
    }
    world
}

/// Takes a step, and before every 30th one changes each velocity by up to 40 units/s in x and in y.
fn shaken_step(world: &mut World, step: u32, rng: &mut Rng) {
    if step % 30 == 29 {
        let bodies: Vec<BodyId> = dynamic(world).collect();
        for id in bodies {
            let change = Vec2::new(rng.range(-40.0, 40.0), rng.range(-40.0, 40.0));
            world.set_velocity(id, world.velocity(id) + change);
        }
    }
    world.step();
}

#[test]
fn a_shaken_pile_takes_bounded_work_and_overlaps_little() {
    let mut rng = Rng::new(1, 21);
    let mut world = pile(&mut rng, 0.0);
    for step in 0..400 {
        shaken_step(&mut world, step, &mut rng);
        // There are about 700 contacts, and with whole sweeps only, up to 660,000 visits were observed.
        assert!(
            world.step_counts().solves <= 40_000,
            "step {step}: {} visits",
            world.step_counts().solves
        );
        assert!(deepest(&world) < 1.0, "step {step}: {} deep", deepest(&world));
        let is_inside = |id| {
            let place = world.position(id);
            place.x.abs() < WIDTH / 2.0 && (0.0..140.0).contains(&place.y)
        };
        assert!(dynamic(&world).all(is_inside), "step {step}");
    }
}

#[test]
fn a_shaken_pile_with_bodies_of_any_weight_takes_bounded_work() {
    for ratio in [50.0, 1000.0, 5000.0, 1e5, 1e6] {
        let mut rng = Rng::new(1, 21);
        let mut world = pile(&mut rng, 0.0);
        let bodies: Vec<BodyId> = dynamic(&world).collect();
        for &id in bodies.iter().skip(7).step_by(50) {
            world.bodies.inverse_mass[id.index as usize] /= ratio;
        }
        for step in 0..400 {
            shaken_step(&mut world, step, &mut rng);
            // More than 130,000 visits were observed when such islands were swept as a whole.
            let visits = world.step_counts().solves;
            // Small islands with such mass ratios are solved by elimination.
            let most = if ratio < 5000.0 { 120_000 } else { 400_000 };
            assert!(visits <= most, "1:{ratio}, step {step}: {visits} visits");
        }
    }
}

#[test]
fn a_pile_that_is_pulled_to_a_point_takes_bounded_work() {
    let mut rng = Rng::new(3, 21);
    let mut world = pile(&mut rng, 0.0);
    world.set_gravity(Vec2::ZERO);
    let mut point = Vec2::ZERO;
    for step in 0..400 {
        if step % 90 == 0 {
            point = Vec2::new(rng.range(-0.5, 0.5) * WIDTH, rng.range(0.0, 140.0));
        }
        let bodies: Vec<BodyId> = dynamic(&world).collect();
        for id in bodies {
            let gain = (point - world.position(id)).normalize_or_zero() * 2.0;
            world.set_velocity(id, world.velocity(id) + gain);
        }
        world.step();
        let visits = world.step_counts().solves;
        assert!(visits <= 40_000, "step {step}: {visits} visits");
    }
}

#[test]
fn an_elastic_gas_that_is_pulled_to_a_point_takes_bounded_work_and_gains_no_energy() {
    let mut rng = Rng::new(3, 21);
    let mut world = pile(&mut rng, 1.0);
    world.set_gravity(Vec2::ZERO);
    let energy = |world: &World| -> f64 {
        let of =
            |id| world.velocity(id).as_dvec2().length_squared() / f64::from(world.inverse_mass(id));
        dynamic(world).map(of).sum()
    };
    for step in 0..400 {
        let point = Vec2::new(0.0, 70.0);
        let bodies: Vec<BodyId> = dynamic(&world).collect();
        for id in bodies {
            let gain = (point - world.position(id)).normalize_or_zero() * 2.0;
            world.set_velocity(id, world.velocity(id) + gain);
        }
        let before = energy(&world);
        world.step();
        let visits = world.step_counts().solves;
        // Up to 280,000 visits were observed without a limit.
        assert!(visits <= 140_000, "step {step}: {visits} visits and predictions");
        let gained = energy(&world) / before - 1.0;
        assert!(gained < 1e-5, "step {step}: {gained}");
    }
}

#[test]
fn a_shaken_pile_that_bounces_takes_bounded_work() {
    for restitution in [0.3, 0.8, 1.0] {
        let mut rng = Rng::new(1, 21);
        let mut world = pile(&mut rng, restitution);
        for step in 0..400 {
            shaken_step(&mut world, step, &mut rng);
            // Up to 230,000 visits were observed without a limit for crowds.
            let visits = world.step_counts().solves;
            assert!(visits <= 120_000, "restitution {restitution}, step {step}: {visits} visits");
        }
    }
}

#[test]
fn a_shaken_pile_that_was_saved_continues_by_the_same_bits() {
    let mut rng = Rng::new(2, 21);
    let mut world = pile(&mut rng, 0.0);
    (0..200).for_each(|step| shaken_step(&mut world, step, &mut rng));
    for _ in 0..5 {
        let mut saved = StateWriter::default();
        world.save(&mut saved);
        let mut twin = World::restore(world.settings().clone(), &mut StateReader::new(&saved.0))
            .expect("what was saved is a state");
        let mut other_rng = rng.clone();
        for step in 0..37 {
            shaken_step(&mut world, step, &mut rng);
            shaken_step(&mut twin, step, &mut other_rng);
            assert_eq!(world.hash(), twin.hash(), "step {step}");
        }
    }
}

/// A finer tolerance takes more sweeps even where islands in motion usually take few.
#[test]
fn a_finer_tolerance_takes_more_sweeps() {
    let visits = |tolerance: f32| {
        let mut world = world_with(Conjugate { tolerance, ..Conjugate::default() }, 50.0);
        floor(&mut world);
        for index in 0..60 {
            let (column, row) = ((index % 8) as f32, (index / 8) as f32);
            let velocity = Vec2::new(20.0 * (index % 3) as f32 - 20.0, 0.0);
            let at = ball_at(2.05 * column + 0.3 * (row % 2.0), 1.0 + 2.02 * row);
            add(&mut world, BodyDef { velocity, ..at });
        }
        steps(&mut world, 12);
        world.step_counts().solves
    };
    let (few, many) = (visits(0.005), visits(0.0005));
    assert!(2 * many > 3 * few, "{few} and {many} visits");
}
