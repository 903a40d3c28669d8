//! Tests few and many bodies that are created inside each other.

use crate::Conjugate;
use crate::math::max;
use crate::solver::Solver;
use crate::world::{BodyDef, BodyId, Motion, World, WorldSettings};
use crate::{Shape, Vec2};

const SLOP: f32 = 0.005;
/// Half of the container's inner width.
const HALF: f32 = 30.0;

/// A container with crates and balls of size 1 at these positions.
fn container(gravity: f32, positions: impl Iterator<Item = Vec2>) -> World {
    let mut world = World::new(WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        ..WorldSettings::default()
    });
    let wall = BodyDef { motion: Motion::Static, friction: 0.3, ..BodyDef::default() };
    for side in [Vec2::X, Vec2::Y, Vec2::NEG_X, Vec2::NEG_Y] {
        let along = side.perp().abs() * (2.0 * HALF + 40.0);
        let size = along + side.abs() * 20.0;
        let position = side * (HALF + 10.0);
        add(&mut world, &BodyDef { shape: Shape::rect(size.x, size.y), position, ..wall });
    }
    for (count, position) in positions.enumerate() {
        let shape = if count % 2 == 0 { Shape::rect(1.0, 1.0) } else { Shape::circle(0.5) };
        add(&mut world, &BodyDef { shape, position, friction: 0.3, ..BodyDef::default() });
    }
    world
}

fn add(world: &mut World, def: &BodyDef) -> BodyId {
    world.add(def).expect("there is room")
}

/// The largest overlap of crates and balls of size 1 with each other and with the walls.
fn deepest(world: &World) -> f32 {
    let bodies: Vec<(Vec2, bool)> = world
        .ids()
        .filter(|&id| world.motion(id) == Motion::Dynamic)
        .map(|id| (world.position(id), matches!(world.shape(id), Shape::Circle { .. })))
        .collect();
    let mut deepest = 0.0;
    for (index, &(position, round)) in bodies.iter().enumerate() {
        let out = max(position.x.abs(), position.y.abs()) + 0.5 - HALF;
        deepest = max(deepest, out);
        for &(other, other_round) in &bodies[index + 1..] {
            let way = (other - position).abs();
            let depth = match (round, other_round) {
                (true, true) => 1.0 - way.length(),
                (false, false) => 1.0 - max(way.x, way.y),
                _ => 0.5 - Vec2::new(max(way.x - 0.5, 0.0), max(way.y - 0.5, 0.0)).length(),
            };
            deepest = max(deepest, depth);
        }
    }
    deepest
}

#[test]
fn three_hundred_bodies_at_one_point_are_apart_within_a_second() {
    // With gravity they fall back into a pile, which keeps moving for another second.
    for (gravity, steps) in [(0.0, 60), (50.0, 120)] {
        let mut world = container(gravity, (0..300).map(|_| Vec2::new(0.0, -HALF + 3.0)));
        (0..60).for_each(|_| world.step());
        assert!(deepest(&world) < 20.0 * SLOP, "gravity {gravity}: {} deep", deepest(&world));
        (60..steps).for_each(|_| world.step());
        assert!(deepest(&world) < 2.0 * SLOP, "gravity {gravity}: {} deep", deepest(&world));
    }
}

#[test]
fn a_heap_at_one_point_has_constraints_by_the_body_and_not_by_the_pair() {
    let count = 300;
    let mut world = container(0.0, (0..count).map(|_| Vec2::ZERO));
    world.step();
    let constraints = world.solvers.conjugate.contacts.constraints.len();
    assert!(constraints <= 32 * count, "{constraints} constraints of {count} bodies");
}

#[test]
fn an_overfull_row_between_two_walls_gives_way_upwards() {
    let positions = (0..90).map(|k| Vec2::new(-HALF + 0.5 + 59.0 / 89.0 * k as f32, -HALF + 0.5));
    let mut world = container(50.0, positions);
    (0..120).for_each(|_| world.step());
    let deepest = deepest(&world);
    assert!(deepest < 2.0 * SLOP, "{deepest} deep");
}
