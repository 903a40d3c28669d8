//! Tests gaps and seams between immovable bodies by shooting bodies at them.

use super::*;
use crate::rng::Rng;

/// Two boxes side by side, and shots at the place where they meet. x and y are swapped if `turned`.
#[derive(Clone, Copy, Debug)]
struct Shots {
    turned: bool,
    /// Width of the gap between the two boxes.
    gap: f32,
    /// Thickness of the two boxes, and their speed towards the shots.
    thickness: f32,
    wall_speed: f32,
    shape: Shape,
    speeds: [f32; 2],
    gravity: f32,
    restitution: f32,
}

/// Returns how many of a hundred shots pass.
fn pass(shots: Shots) -> usize {
    let Shots { turned, gap, thickness, wall_speed, shape, restitution, .. } = shots;
    let turn = |v: Vec2| if turned { Vec2::new(v.y, v.x) } else { v };
    let mut rng = Rng::new(5, 0);
    let shot = |_: &usize| {
        let mut world = World::new(WorldSettings {
            gravity: turn(Vec2::new(0.0, -shots.gravity)),
            solver: Some(Solver::Relaxation(Relaxation::default())),
            ..WorldSettings::default()
        });
        let motion = if wall_speed == 0.0 { Motion::Static } else { Motion::Kinematic };
        let walls = [-1.0, 1.0].map(|sign| {
            let position = turn(Vec2::new(sign * (20.0 + gap / 2.0), -thickness / 2.0));
            let shape = Shape::Box { half: turn(Vec2::new(20.0, thickness / 2.0)) };
            let velocity = turn(Vec2::new(0.0, wall_speed));
            add(&mut world, BodyDef { shape, position, velocity, motion, ..BodyDef::default() })
        });
        let half = shape.half_extent().y;
        let from = Vec2::new(rng.range(-1.5, 1.5) * half, half + rng.range(1.0, 20.0));
        let aim = Vec2::new(rng.range(-0.3, 0.3) * half, 0.0);
        let velocity = (aim - from).normalize() * rng.range(shots.speeds[0], shots.speeds[1]);
        let (position, velocity) = (turn(from), turn(velocity));
        let def = BodyDef { shape, position, velocity, restitution, ..BodyDef::default() };
        let id = add(&mut world, def);
        steps(&mut world, 120);
        let [end, left, right] = [id, walls[0], walls[1]].map(|id| turn(world.position(id)));
        end.y < left.y && left.x < end.x && end.x < right.x
    };
    (0..100).filter(shot).count()
}

const BALL: Shots = Shots {
    turned: false,
    gap: 9.9,
    thickness: 10.0,
    wall_speed: 0.0,
    shape: Shape::Circle { radius: 5.0 },
    speeds: [20.0, 150.0],
    gravity: 50.0,
    restitution: 0.0,
};

#[test]
fn a_ball_passes_no_gap_that_is_narrower() {
    for share in [0.8, 0.95, 0.98, 0.99, 0.999] {
        for radius in [0.5, 1.5, 5.0, 15.0] {
            let (shape, gap) = (Shape::circle(radius), 2.0 * radius * share);
            let first = Shots { shape, gap, thickness: 2.0 * radius, ..BALL };
            for shots in [
                first,
                Shots { turned: true, ..first },
                Shots { gravity: 0.0, ..first },
                Shots { restitution: 0.8, ..first },
                Shots { speeds: [0.0, 5.0], ..first },
                Shots { wall_speed: 5.0, turned: true, ..first },
            ] {
                assert_eq!(pass(shots), 0, "{shots:?}");
            }
        }
    }
}

#[test]
fn nothing_falls_through_a_seam() {
    for size in [0.2, 0.4, 1.0, 2.0, 6.0] {
        for shape in [Shape::rect(size, size), Shape::circle(size / 2.0)] {
            let first = Shots { shape, gap: 0.0, thickness: 5.0, gravity: 0.0, ..BALL };
            for shots in [
                first,
                Shots { turned: true, ..first },
                Shots { gravity: 50.0, ..first },
                Shots { restitution: 0.8, ..first },
                Shots { speeds: [150.0, 150.0], ..first },
                Shots { wall_speed: 20.0, ..first },
            ] {
                assert_eq!(pass(shots), 0, "{shots:?}");
            }
        }
    }
}

/// See A0.7 in docs/physics.md.
#[test]
fn a_body_skips_a_platform_from_the_speed_at_which_its_center_may_miss_it() {
    let passes = |radius: f32, speed: f32| {
        let from = |share: f32| {
            let settings = WorldSettings {
                speed_max: 1000.0,
                gravity: Vec2::ZERO,
                ..WorldSettings::default()
            };
            let mut world = World::new(settings);
            let fixed = BodyDef { shape: Shape::rect(60.0, 3.0), ..crate_at(0.0, -1.5) };
            add(&mut world, BodyDef { motion: Motion::Static, ..fixed });
            let position = Vec2::new(0.0, radius + share * speed / 60.0);
            let def = BodyDef { shape: Shape::circle(radius), position, ..BodyDef::default() };
            let id = add(&mut world, BodyDef { velocity: Vec2::new(0.0, -speed), ..def });
            steps(&mut world, 10);
            world.position(id).y < -1.5
        };
        (1..100).any(|share| from(share as f32 / 100.0))
    };
    for (radius, speed) in [(1.5, 270.0), (6.5, 570.0), (11.0, 840.0)] {
        assert!(!passes(radius, speed * 0.99) && passes(radius, speed * 1.02), "radius {radius}");
    }
}

#[test]
fn a_ball_passes_a_gap_that_is_wider() {
    for shots in [Shots { gap: 13.0, ..BALL }, Shots { gap: 13.0, turned: true, ..BALL }] {
        assert!(pass(shots) > 50, "{shots:?}");
    }
}

/// A box that rests on both sides of a gap does not get stuck in it, and a box between two lifts is carried.
#[test]
fn a_box_rests_on_both_sides_of_a_gap() {
    for wall_speed in [0.0, 5.0] {
        let mut world = world(Relaxation::default(), 50.0);
        for x in [-22.0, 22.0] {
            let motion = Motion::Kinematic;
            let def = BodyDef { shape: Shape::rect(40.0, 4.0), motion, ..crate_at(x, -2.0) };
            add(&mut world, BodyDef { velocity: Vec2::new(0.0, wall_speed), ..def });
        }
        let id = add(&mut world, BodyDef { shape: Shape::rect(6.0, 6.0), ..crate_at(0.0, 6.0) });
        steps(&mut world, 120);
        close(world.position(id).y, 3.0 + 2.0 * wall_speed, 0.02);
        close(world.velocity(id).y, wall_speed, 0.01);
    }
}
