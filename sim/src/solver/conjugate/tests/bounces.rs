//! Elastic bounces keep their energy.

use super::*;

/// Elastic bodies without gravity and friction in a closed square, in rows, with random sizes, masses and velocities.
struct Gas {
    rows: u32,
    /// Distance of two in a row.
    pitch: f32,
    sizes: [f32; 2],
    /// Largest speed on each axis.
    speed: f32,
    boxes: bool,
}

impl Gas {
    /// The share of its kinetic energy that is left after some steps.
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
    // Discs close to each other meet several others in a step.
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

/// There the rounds of a step do not suffice for all that outrun their reach.
#[test]
fn a_large_gas_at_thousands_of_units_per_second_loses_little_energy() {
    let gas = Gas { rows: 15, pitch: 18.0, sizes: [4.0, 8.0], speed: 2000.0, boxes: false };
    let share = gas.energy_left(7, 20);
    assert!((0.98..1.0).contains(&share), "energy times {share}");
}
