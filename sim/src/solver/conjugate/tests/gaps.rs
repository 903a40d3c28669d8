//! Tests passages between two immovable bodies that are too narrow for the balls shot at them.

use super::*;

/// A passage, and the shots at it. The passage runs along y unless it is `across`.
#[derive(Clone, Copy, Debug)]
struct Passage {
    across: bool,
    /// Width, in diameters of the ball.
    width: f32,
    radius: f32,
    speeds: [f32; 2],
    /// Half-sizes of the two sides, in radii of the ball. If they are round, the sides are circles.
    side: Vec2,
    round: bool,
    /// Velocity of the sides along the passage.
    side_speed: f32,
    gravity: f32,
    friction: f32,
    restitution: f32,
}

const PASSAGE: Passage = Passage {
    across: false,
    width: 0.999,
    radius: 5.0,
    speeds: [20.0, 150.0],
    side: Vec2::new(5.0, 1.0),
    round: false,
    side_speed: 0.0,
    gravity: 0.0,
    friction: 0.0,
    restitution: 0.0,
};

/// Shoots balls from random positions at random speeds, and returns how many pass.
fn pass(passage: Passage, shots: usize) -> usize {
    let Passage { radius, side_speed, friction, restitution, .. } = passage;
    let turn = |v: Vec2| if passage.across { Vec2::new(v.y, v.x) } else { v };
    let along = |y: f32| turn(Vec2::new(0.0, y));
    let mut rng = Rng::new(12, 0);
    let shot = |_: &usize| {
        let mut world = World::new(WorldSettings {
            gravity: along(-passage.gravity),
            solver: Some(Solver::Conjugate(Conjugate::default())),
            ..WorldSettings::default()
        });
        let half = passage.side * radius;
        let shape =
            if passage.round { Shape::circle(half.x) } else { Shape::Box { half: turn(half) } };
        let motion = if side_speed == 0.0 { Motion::Static } else { Motion::Kinematic };
        let side = BodyDef { shape, motion, friction, restitution: 1.0, ..BodyDef::default() };
        let sides = [-1.0, 1.0].map(|sign| {
            let position = turn(Vec2::new(sign * (passage.width * radius + half.x), 0.0));
            add(&mut world, BodyDef { position, velocity: along(side_speed), ..side })
        });
        let from = Vec2::new(rng.range(-1.5, 1.5), rng.range(1.0, 4.0) + passage.side.y) * radius;
        let aim = Vec2::new(rng.range(-0.3, 0.3) * radius, 0.0);
        let velocity = (aim - from).normalize() * rng.range(passage.speeds[0], passage.speeds[1]);
        let ball = BodyDef { shape: Shape::circle(radius), friction, restitution, ..side };
        let ball = BodyDef { position: turn(from), motion: Motion::Dynamic, ..ball };
        let ball =
            add(&mut world, BodyDef { velocity: turn(velocity) + along(side_speed), ..ball });
        steps(&mut world, 120);
        let [end, left, right] = [ball, sides[0], sides[1]].map(|id| turn(world.position(id)));
        end.y < left.y && left.x < end.x && end.x < right.x
    };
    (0..shots).filter(shot).count()
}

#[test]
fn a_ball_passes_no_gap_that_is_narrower() {
    for width in [0.999, 0.99, 0.97, 0.95, 0.8] {
        let first = Passage { width, ..PASSAGE };
        for passage in [
            first,
            Passage { across: true, ..first },
            Passage { speeds: [1.0, 20.0], ..first },
            Passage { speeds: [150.0, 1000.0], across: true, ..first },
            Passage { radius: 0.5, ..first },
            Passage { radius: 1.0, side: Vec2::new(5.0, 0.1), ..first },
            Passage { radius: 20.0, speeds: [150.0, 1000.0], ..first },
            Passage { side_speed: 30.0, ..first },
            Passage { side_speed: -30.0, across: true, ..first },
            Passage { side: Vec2::ONE, round: true, ..first },
            Passage { side: Vec2::splat(0.2), round: true, side_speed: 10.0, ..first },
            Passage { gravity: 50.0, friction: 0.3, ..first },
            Passage { gravity: 500.0, across: true, ..first },
            Passage { gravity: 50.0, friction: 0.3, restitution: 0.9, ..first },
        ] {
            assert_eq!(pass(passage, 40), 0, "{passage:?}");
        }
    }
}

#[test]
fn a_ball_passes_a_gap_that_is_wider() {
    let straight = Passage { width: 1.3, speeds: [20.0, 150.0], ..PASSAGE };
    for passage in [straight, Passage { across: true, gravity: 50.0, ..straight }] {
        assert!(pass(passage, 40) > 20, "{passage:?}");
    }
}
