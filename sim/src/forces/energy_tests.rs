//! Springs never add energy: kinetic energy, that of gravity and that of the springs, summed up over
//! a minute, free and against a floor, with both solvers.

use super::*;
use crate::Conjugate;
use crate::shape::Shape;
use crate::solver::Solver;
use crate::world::{BodyDef, World, WorldSettings};

/// Share of the energy at the start by which rounding may raise it.
const ROUNDING_SHARE: f64 = 2e-3;

fn solvers() -> [Solver; 2] {
    [Solver::default(), Solver::Conjugate(Conjugate::default())]
}

fn world(gravity: f32, solver: Solver) -> World {
    World::new(WorldSettings {
        gravity: Vec2::new(0.0, -gravity),
        forces: Some(ForceSettings { springs_max: 10, ..ForceSettings::default() }),
        solver: Some(solver),
        speed_max: 1e6,
        ..WorldSettings::default()
    })
}

fn add(world: &mut World, def: BodyDef) -> BodyId {
    world.add(&def).expect("there is room")
}

fn ball(radius: f32, mass: f32, position: Vec2) -> BodyDef {
    let shape = Shape::circle(radius);
    BodyDef { shape, mass, position, friction: 0.0, restitution: 0.0, ..BodyDef::default() }
}

/// Energy of all bodies and springs; that of gravity is 0 at this height.
fn energy(world: &World, height: f64) -> f64 {
    let gravity = -f64::from(world.settings().gravity.y);
    let bodies = world.body_arrays();
    let of_bodies = bodies.moving.iter().map(|&slot| {
        let slot = slot as usize;
        let squared = bodies.velocity[slot].as_dvec2().length_squared();
        let height = f64::from(bodies.center[slot].y) - height;
        (squared / 2.0 + gravity * height) / f64::from(bodies.inverse_mass[slot])
    });
    let of_springs = world.springs().iter().map(|spring| {
        let far = match spring.end {
            SpringEnd::Point(point) => point,
            SpringEnd::Body(other) => world.position(other),
        };
        let length = (world.position(spring.body).as_dvec2() - far.as_dvec2()).length();
        let stretch = length - f64::from(spring.rest_length);
        f64::from(spring.stiffness) * stretch * stretch / 2.0
    });
    of_bodies.sum::<f64>() + of_springs.sum::<f64>()
}

/// The least and the most energy in so many steps, as shares of that at the start.
fn extremes(world: &mut World, height: f64, steps: u32) -> (f64, f64) {
    let start = energy(world, height);
    let (mut least, mut most) = (1.0f64, 1.0f64);
    for _ in 0..steps {
        world.step();
        let share = energy(world, height) / start;
        assert!(share.is_finite());
        (least, most) = (least.min(share), most.max(share));
    }
    (least, most)
}

/// A ball that a spring of this length holds to a point or to a second ball, stretched by `amplitude`.
fn stretched(
    solver: Solver,
    frequency: f32,
    mass: f32,
    (length, amplitude): (f32, f32),
    is_pair: bool,
) -> World {
    let mut world = world(0.0, solver);
    let id = add(&mut world, ball(1.0, mass, Vec2::new(100.0 + length + amplitude, 50.0)));
    let far = Vec2::new(100.0, 50.0);
    let (end, mass) = match is_pair {
        true => (SpringEnd::Body(add(&mut world, ball(1.0, mass, far))), mass / 2.0),
        false => (SpringEnd::Point(far), mass),
    };
    let spring = Spring::tuned(id, end, frequency, 0.0, mass);
    world.add_spring(Spring { rest_length: length, ..spring });
    world
}

const FREQUENCIES: [f32; 12] =
    [0.5, 1.6, 2.8, 4.7, 10.5, 15.9, 20.0, 34.0, 60.0, 159.0, 300.0, 600.0];
const MASSES: [f32; 3] = [0.01, 1.0, 1000.0];

#[test]
fn a_free_spring_keeps_its_energy() {
    for solver in [solvers()[0]] {
        for (index, frequency) in FREQUENCIES.into_iter().enumerate() {
            for (length, amplitude, is_pair) in
                [(0.0, 5.0, false), (10.0, 5.0, false), (10.0, 1.0, false), (10.0, 5.0, true)]
            {
                let (mass, stretch) = (MASSES[index % 3], (length, amplitude));
                let mut world = stretched(solver, frequency, mass, stretch, is_pair);
                let (least, most) = extremes(&mut world, 0.0, 3600);
                let what = format!("{solver:?} {frequency} Hz {mass} {stretch:?} {is_pair}");
                assert!(most < 1.0 + ROUNDING_SHARE, "{what}: {most}");
                assert!(least > 1.0 - ROUNDING_SHARE, "{what}: {least}");
            }
        }
    }
}
