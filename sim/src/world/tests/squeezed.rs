//! Tests bodies whose constraints the relaxation solver cannot all satisfy, because they are squeezed, pressed
//! into walls, or piled up at one point.

use super::*;
use crate::Conjugate;
use crate::math::{max, min};

/// Adds a wall or lift.
fn slab(world: &mut World, motion: Motion, center: Vec2, size: Vec2) -> BodyId {
    let shape = Shape::rect(size.x, size.y);
    add(world, BodyDef { shape, position: center, motion, ..BodyDef::default() })
}

/// Steps the world and checks that no body moves further than its speed and its correction allow.
fn step_within_limits(world: &mut World) {
    let state = |world: &World, id| (id, world.position(id), world.velocity(id).length());
    let before: Vec<_> = world.ids().map(|id| state(world, id)).collect();
    world.step();
    let WorldSettings { speed_max, dt, gravity, .. } = world.settings;
    for (id, position, speed) in before {
        let moved = (world.position(id) - position).length();
        let correction = min(world.shape(id).thickness(), speed_max * dt);
        let allowed = (min(speed, speed_max) + 9.0 * gravity.length() * dt) * dt + correction;
        assert!(moved <= allowed * 1.001, "body {} moved by {moved} of {allowed}", id.index);
    }
}

/// Raises a lift under a ceiling with bodies in between, and returns the greatest height that any of them reaches.
fn squeeze(solver: Solver, lift_speed: f32, thickness: f32, bodies: &[BodyDef]) -> f32 {
    let mut world = world(Relaxation::default(), 50.0);
    world.settings.solver = Some(solver);
    slab(&mut world, Motion::Static, Vec2::new(0.0, thickness / 2.0), Vec2::new(60.0, thickness));
    let lift = slab(&mut world, Motion::Kinematic, Vec2::new(0.0, -31.5), Vec2::new(24.0, 3.0));
    let ids: Vec<BodyId> = bodies.iter().map(|&body| add(&mut world, body)).collect();
    steps(&mut world, 60);
    world.set_velocity(lift, Vec2::new(0.0, lift_speed));
    let mut highest = f32::NEG_INFINITY;
    while world.position(lift).y < 5.0 {
        step_within_limits(&mut world);
        highest = ids.iter().map(|&id| world.position(id).y).fold(highest, max);
    }
    highest
}

#[test]
fn a_lift_shoots_nothing_through_a_ceiling() {
    let passes =
        |iterations| Solver::Relaxation(Relaxation { iterations, ..Relaxation::default() });
    let conjugate = Solver::Conjugate(Conjugate::default());
    for (solver, lift_speed, thickness) in [
        (passes(15), 20.0, 3.0),
        (passes(15), 30.0, 10.0),
        (passes(60), 5.0, 3.0),
        (passes(240), 1.0, 3.0),
        (conjugate, 20.0, 3.0),
        (conjugate, 100.0, 10.0),
        (conjugate, 1.0, 3.0),
    ] {
        for size in [8.0, 9.0] {
            let at = |x: f32, y: f32| BodyDef {
                shape: Shape::rect(size, size),
                ..crate_at(x, y - 30.0 + size / 2.0)
            };
            let ball = |x: f32, y: f32| BodyDef { shape: Shape::circle(size / 2.0), ..at(x, y) };
            for bodies in [
                &[at(0.0, 0.0)][..],
                &[at(3.0, 0.0), at(3.0, size)],
                &[ball(-3.0, 0.0)],
                &[ball(-4.5, 0.0), at(4.5, 0.0), ball(-2.0, size)],
                &[at(14.0, 0.0)],
            ] {
                let highest = squeeze(solver, lift_speed, thickness, bodies);
                assert!(highest < 0.0, "{lift_speed} units/s, {bodies:?}: up to {highest}");
            }
        }
    }
}

#[test]
fn a_body_whose_load_is_gone_stays_where_it_is() {
    let mut world = world(Relaxation::default(), 50.0);
    floor(&mut world, 0.3);
    let stack: Vec<BodyId> =
        (0..10).map(|index| add(&mut world, crate_at(0.0, 1.0 + 2.0 * index as f32))).collect();
    steps(&mut world, 300);
    let before = world.position(stack[0]).y;
    for &id in &stack[1..] {
        world.remove(id);
    }
    for _ in 0..60 {
        step_within_limits(&mut world);
        close(world.position(stack[0]).y, before, 0.02);
    }
}

#[test]
fn bodies_pressed_into_a_wall_stay_on_their_side() {
    let mut world = world(Relaxation::default(), 50.0);
    for (center, size) in [
        (Vec2::new(0.0, -1.0), Vec2::new(40.0, 2.0)),
        (Vec2::new(-16.0, 200.0), Vec2::new(2.0, 404.0)),
        (Vec2::new(16.0, 200.0), Vec2::new(2.0, 404.0)),
    ] {
        slab(&mut world, Motion::Static, center, size);
    }
    let ball = BodyDef { shape: Shape::circle(3.0), restitution: 0.0, ..BodyDef::default() };
    let balls: Vec<BodyId> = (0..60)
        .map(|index| {
            let place = Vec2::new(-12.0 + (index % 5) as f32, 3.0 + (index / 5) as f32 * 0.5);
            add(&mut world, BodyDef { position: place, ..ball })
        })
        .collect();
    for tick in 0..600 {
        step_within_limits(&mut world);
        for &ball in &balls {
            let place = world.position(ball);
            assert!(place.x.abs() < 16.0 && place.y > -1.0, "tick {tick}: {place}");
        }
    }
}

#[test]
fn circles_at_one_point_leave_in_all_directions() {
    let mut world = world(Relaxation::default(), 0.0);
    let circles: Vec<BodyId> = (0..12).map(|_| add(&mut world, BodyDef::default())).collect();
    steps(&mut world, 120);
    let spread = |axis: usize| {
        let places = circles.iter().map(|&id| world.position(id)[axis]);
        let (low, high) = places
            .fold((f32::MAX, f32::MIN), |(low, high), place| (min(low, place), max(high, place)));
        high - low
    };
    let (x, y) = (spread(0), spread(1));
    assert!(x > 2.0 && y > 2.0 && x < 12.0 && y < 12.0, "{x} by {y}");
    for (index, &a) in circles.iter().enumerate() {
        for &b in &circles[..index] {
            let distance = (world.position(a) - world.position(b)).length();
            assert!(distance > 1.9, "two circles are {distance} apart");
        }
    }
}
