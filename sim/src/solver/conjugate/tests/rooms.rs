//! Tests rooms so small that a body falls across them in less than a step, with bodies thinner than the slop. These
//! are failures found by random extreme scenes, each with a single cause.

use super::*;

const DT: f32 = 0.02;
const GRAVITY: f32 = 500.0;
/// Side of a room. A body falls ten times as far in a step.
const SIDE: f32 = 0.02;
const RADIUS: f32 = 0.001;

/// A room from (0, 0) to (side, side) with walls as thick as it is wide.
fn room(side: f32, gravity: f32, dt: f32, restitution: f32) -> World {
    let settings = Conjugate { bounce_threshold: 0.0, ..Conjugate::default() };
    let mut world = World::new(WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        dt,
        solver: Some(Solver::Conjugate(settings)),
        ..WorldSettings::default()
    });
    for (x, y) in [(-0.5, 0.5), (1.5, 0.5), (0.5, -0.5), (0.5, 1.5)] {
        let shape = Shape::rect(side, if y == 0.5 { 3.0 * side } else { side });
        let (position, motion) = (Vec2::new(x, y) * side, Motion::Static);
        let def = BodyDef { shape, position, motion, ..BodyDef::default() };
        add(&mut world, BodyDef { restitution, friction: 0.0, ..def });
    }
    world
}

fn ball(x: f32, y: f32, velocity: (f32, f32), restitution: f32) -> BodyDef {
    let (shape, velocity) = (Shape::circle(RADIUS), Vec2::from(velocity));
    BodyDef { shape, velocity, restitution, ..ball_at(x, y) }
}

/// Steps a room and checks that every body stays inside.
#[track_caller]
fn holds(world: &mut World, side: f32) {
    for step in 1..=30 {
        world.step();
        for id in dynamic(world) {
            let position = world.position(id);
            let inside =
                position.cmpge(Vec2::ZERO).all() && position.cmple(Vec2::splat(side)).all();
            assert!(inside, "body {} at {position} in step {step}", id.index);
        }
    }
}

#[test]
fn a_room_smaller_than_the_slop_and_the_fall_of_a_step_has_walls_too() {
    let mut world = room(SIDE, GRAVITY, DT, 1.0);
    add(&mut world, ball(0.01, 0.018, (3.5, 2.25), 1.0));
    holds(&mut world, SIDE);
}

#[test]
fn a_curved_fall_hits_the_wall_that_its_chord_misses() {
    let mut world = room(0.008, 860.0, 0.018, 1.0);
    let (shape, velocity) = (Shape::rect(0.001, 0.001), Vec2::new(1.8, 2.5));
    let def = BodyDef { shape, velocity, friction: 0.0, ..crate_at(0.001_25, 0.0011) };
    add(&mut world, BodyDef { restitution: 0.1, ..def });
    holds(&mut world, 0.008);
}

#[test]
fn a_resting_body_is_held_until_an_impact() {
    let mut world = room(SIDE, GRAVITY, DT, 1.0);
    add(&mut world, ball(0.005, RADIUS, (0.0, 0.0), 1.0));
    add(&mut world, ball(0.015, RADIUS, (-0.2, 0.0), 1.0));
    holds(&mut world, SIDE);
}

#[test]
fn an_obstruction_may_rest_on_another_one() {
    let mut world = room(SIDE, GRAVITY, DT, 0.0);
    add(&mut world, ball(SIDE / 6.0, 0.002, (-0.4, 0.475), 0.0));
    add(&mut world, ball(SIDE / 2.0, RADIUS, (-2.5, -4.75), 1.0));
    add(&mut world, ball(SIDE / 1.2, 0.017, (-0.2, 0.3), 1.0));
    holds(&mut world, SIDE);
}

#[test]
fn a_body_held_after_its_bounce_lifts_no_other() {
    let mut world = room(0.7, 110.0, 0.044, 0.3);
    let shape = Shape::rect(0.1, 0.1);
    let heavy = BodyDef { shape, mass: 1e5, friction: 0.0, ..crate_at(0.35, 0.05) };
    let heavy = add(&mut world, BodyDef { velocity: Vec2::new(0.0, -1.5), ..heavy });
    let light = BodyDef { shape, mass: 1.0, restitution: 0.1, ..crate_at(0.35, 0.15) };
    add(&mut world, BodyDef { velocity: Vec2::new(0.0, -4.0), ..light });
    for _ in 0..10 {
        world.step();
        assert!(world.position(heavy).y <= 0.05 + SLOP, "lifted to {}", world.position(heavy).y);
    }
}
