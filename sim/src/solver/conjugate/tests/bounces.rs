//! Tests that elastic bounces conserve energy.

use super::*;

/// Elastic bodies in rows in a closed square, without gravity or friction, with random sizes, masses and velocities.
struct Gas {
    rows: u32,
    /// Distance between neighbours in a row.
    pitch: f32,
    sizes: [f32; 2],
    /// Largest speed on each axis.
    speed: f32,
    boxes: bool,
}

impl Gas {
    /// Returns the share of the kinetic energy that is left after some steps.
    fn energy_left(&self, seed: u64, count: usize) -> f64 {
        let &Gas { rows, pitch, sizes, speed, boxes } = self;
        let settings = Conjugate { bounce_threshold: 0.0, ..Conjugate::default() };
        let mut world = World::new(WorldSettings {
            gravity: Vec2::ZERO,
            speed_max: 1e5,
            solver: Some(Solver::Conjugate(settings)),
            ..WorldSettings::default()
        });
        let half = rows as f32 * pitch / 2.0;
        let far = half + 10.0;
        for (center, half) in [
            ((half, -10.0), (half + 20.0, 10.0)),
            ((half, half + far), (half + 20.0, 10.0)),
            ((-10.0, half), (10.0, half)),
            ((half + far, half), (10.0, half)),
        ] {
            fixed(&mut world, center, half, 0.0);
        }
        let mut rng = Rng::new(seed, 0);
        for index in 0..rows * rows {
            let at = [index % rows, index / rows].map(|row| (row as f32 + 0.5) * pitch);
            let size = rng.range(sizes[0], sizes[1]);
            let shape = if boxes { Shape::rect(size, size) } else { Shape::circle(size / 2.0) };
            let velocity = Vec2::new(rng.range(-speed, speed), rng.range(-speed, speed));
            let mass = rng.range(1.0, 4.0);
            let def = BodyDef { shape, mass, velocity, ..ball_at(at[0], at[1]) };
            add(&mut world, BodyDef { restitution: 1.0, ..def });
        }
        let before = kinetic(&world);
        steps(&mut world, count);
        let inside = |axis: f32| (0.0..2.0 * half).contains(&axis);
        let positions = || dynamic(&world).map(|id| world.position(id));
        assert!(positions().all(|position| inside(position.x) && inside(position.y)));
        assert_eq!(positions().count(), (rows * rows) as usize);
        kinetic(&world) / before
    }
}

#[test]
fn a_gas_keeps_its_energy() {
    let slow = Gas { rows: 10, pitch: 12.0, sizes: [2.0, 7.0], speed: 50.0, boxes: false };
    // Discs that are close together meet several others in a step.
    let crowded = Gas { rows: 10, pitch: 3.0, sizes: [2.0, 2.0], speed: 30.0, boxes: false };
    let fast = |speed, boxes| Gas { rows: 5, pitch: 20.0, sizes: [4.0, 10.0], speed, boxes };
    for (gas, count) in [
        (slow, 2000),
        (crowded, 2000),
        (fast(300.0, true), 600),
        (fast(600.0, false), 600),
        (fast(1000.0, true), 600),
        (fast(2000.0, false), 600),
        (fast(2000.0, true), 600),
    ] {
        let share = gas.energy_left(7, count);
        let Gas { speed, boxes, .. } = gas;
        assert!((share - 1.0).abs() < 2e-4, "{speed} units/s, boxes {boxes}: energy times {share}");
    }
}

/// At such speeds, the rounds in a step do not suffice for all bodies that outrun their reach.
#[test]
fn a_large_gas_at_thousands_of_units_per_second_loses_little_energy() {
    let gas = Gas { rows: 11, pitch: 18.0, sizes: [4.0, 8.0], speed: 2000.0, boxes: false };
    let share = gas.energy_left(7, 20);
    assert!((0.98..1.0).contains(&share), "energy times {share}");
}

/// Greatest relative change in a body's energy while it bounces on a floor for 10 s.
fn energy_error(shape: Shape, thickness: f32, height: f32, across: bool) -> f32 {
    let turn = |v: Vec2| if across { Vec2::new(v.y, v.x) } else { v };
    let mut world = World::new(WorldSettings {
        gravity: turn(Vec2::new(0.0, -50.0)),
        solver: Some(Solver::Conjugate(Conjugate::default())),
        ..WorldSettings::default()
    });
    let floor = Shape::Box { half: turn(Vec2::new(100.0, thickness / 2.0)) };
    let fixed = BodyDef { shape: floor, motion: Motion::Static, ..BodyDef::default() };
    add(&mut world, BodyDef { restitution: 1.0, ..fixed });
    let rest = thickness / 2.0 + shape.half_extent().y;
    let position = turn(Vec2::new(0.0, rest + height));
    let def = BodyDef { shape, position, restitution: 1.0, friction: 0.0, ..BodyDef::default() };
    let id = add(&mut world, def);
    let mut worst = 0.0;
    for _ in 0..600 {
        world.step();
        let above = turn(world.position(id)).y - rest;
        let energy = 50.0 * above + 0.5 * world.velocity(id).length_squared();
        worst = max(worst, (energy / (50.0 * height) - 1.0).abs());
    }
    worst
}

#[test]
fn a_bounce_at_the_end_of_a_step_keeps_its_energy() {
    for (shape, thickness) in [
        (Shape::circle(5.0), 20.0),
        (Shape::circle(0.5), 0.5),
        (Shape::rect(0.4, 0.4), 0.5),
        (Shape::rect(10.0, 10.0), 0.5),
    ] {
        // A fall from a height of 25 takes a second.
        for height in (0..160).map(|index| 9.0 + 0.1 * index as f32) {
            for across in [false, true] {
                let error = energy_error(shape, thickness, height, across);
                assert!(error < 5e-6, "{shape:?} from {height}, across {across}: {error}");
            }
        }
    }
}

/// A single ball that falls from a height and leaves at e times its speed, again and again, bounces at the exact times.
#[test]
fn a_ball_alone_bounces_at_the_exact_times() {
    let (restitution, gravity, drop) = (0.9, 50.0, 20.0);
    let mut world = bouncy_world(gravity);
    let ground =
        BodyDef { shape: Shape::rect(40.0, 2.0), motion: Motion::Static, ..ball_at(0.0, -1.0) };
    add(&mut world, BodyDef { restitution, ..ground });
    let ball = BodyDef { shape: Shape::circle(1.0), ..ball_at(0.0, 1.0 + drop) };
    let ball = add(&mut world, BodyDef { restitution, ..ball });
    // The start of the current flight, and its initial speed.
    let (mut begin, mut speed) =
        ((2.0 * drop / gravity).sqrt(), (2.0 * gravity * drop).sqrt() * restitution);
    for step in 1..=300 {
        world.step();
        let time = step as f32 / 60.0;
        while time - begin > 2.0 * speed / gravity {
            begin += 2.0 * speed / gravity;
            speed *= restitution;
        }
        let flown = time - begin;
        let height = match step {
            ..=53 => drop - 0.5 * gravity * time * time,
            _ => speed * flown - 0.5 * gravity * flown * flown,
        };
        let error = (world.position(ball).y - 1.0 - height).abs();
        assert!(error < 1e-3, "step {step}: {error} from {height}");
    }
}
