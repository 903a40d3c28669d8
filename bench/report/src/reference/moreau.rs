//! Moreau's time stepping for frictionless discs on a floor, in f64: every step is a quadratic program for the
//! velocities at its end (Moreau 1988; Jean and Moreau 1992).

use super::program::{Contact, Program};
use crate::scene::Scene;
use glam::DVec2;
use std::collections::BTreeMap;

/// A step's sweeps end when no velocity changes by more than this, in units/s.
const TOLERANCE: f64 = 1e-9;
const SWEEPS_MAX: u32 = 100_000;
/// Pairs further apart than this, in units, are not contacts in a step.
const NEAR: f64 = 0.5;

/// Discs above the floor y = 0, all subject to the same gravity.
pub struct Pile {
    pub positions: Vec<DVec2>,
    /// Velocities in units/s.
    pub velocities: Vec<DVec2>,
    radii: Vec<f64>,
    inverse_masses: Vec<f64>,
    gravity: DVec2,
    /// Impulses of the previous step, to warm-start the next one.
    impulses: BTreeMap<(usize, usize), f64>,
}

impl Pile {
    /// Creates a pile from a scene's dynamic bodies, which must all be discs.
    pub fn new(scene: &Scene) -> Pile {
        let bodies: Vec<_> = scene.dynamic().map(|index| scene.bodies[index]).collect();
        Pile {
            positions: bodies.iter().map(|body| body.position).collect(),
            velocities: bodies.iter().map(|body| body.velocity).collect(),
            radii: bodies.iter().map(|body| body.shape.half_extent().x).collect(),
            inverse_masses: bodies.iter().map(|body| 1.0 / body.mass).collect(),
            gravity: scene.gravity,
            impulses: BTreeMap::new(),
        }
    }

    /// Advances by `time_s` seconds in equal steps.
    pub fn advance(&mut self, time_s: f64, steps: u32) {
        let step_s = time_s / f64::from(steps);
        for _ in 0..steps {
            self.step(step_s);
        }
    }

    fn step(&mut self, step_s: f64) {
        let program = self.program(step_s);
        let start: Vec<f64> = program.contacts.iter().map(|c| self.impulse(c)).collect();
        let solution = program.gauss_seidel_from(&start, TOLERANCE, SWEEPS_MAX);
        let keys = program.contacts.iter().map(|contact| (contact.a, contact.b));
        self.impulses = keys.zip(solution.impulses).collect();
        // The floor comes last and does not move.
        self.velocities = solution.velocities[..self.positions.len()].to_vec();
        for (position, velocity) in self.positions.iter_mut().zip(&self.velocities) {
            *position += *velocity * step_s;
        }
    }

    fn impulse(&self, contact: &Contact) -> f64 {
        self.impulses.get(&(contact.a, contact.b)).copied().unwrap_or(0.0)
    }

    fn program(&self, step_s: f64) -> Program {
        let floor = self.positions.len();
        let mut inverse_masses = self.inverse_masses.clone();
        inverse_masses.push(0.0);
        let mut free: Vec<DVec2> =
            self.velocities.iter().map(|velocity| *velocity + self.gravity * step_s).collect();
        free.push(DVec2::ZERO);
        let mut contacts = Vec::new();
        let mut offer = |a: usize, b: usize, normal: DVec2, separation: f64| {
            if separation < NEAR {
                contacts.push(Contact { a, b, normal, min_normal_velocity: -separation / step_s });
            }
        };
        for (a, &position) in self.positions.iter().enumerate() {
            offer(a, floor, DVec2::NEG_Y, position.y - self.radii[a]);
            for (b, &other) in self.positions.iter().enumerate().skip(a + 1) {
                let (offset, reach) = (other - position, self.radii[a] + self.radii[b]);
                if offset.y.abs() < reach + NEAR && offset.length() < reach + NEAR {
                    offer(a, b, offset.normalize(), offset.length() - reach);
                }
            }
        }
        Program { inverse_masses, free, contacts }
    }
}

#[cfg(test)]
mod tests {
    use super::Pile;
    use crate::scene::{Body, Scene, Shape};

    fn tower() -> Scene {
        let mut scene = Scene::new(50.0);
        for storey in 0..6 {
            for column in 0..3 {
                let x = f64::from(column) * 2.0 + if storey % 2 == 1 { 1.0 } else { 0.0 };
                let y = 1.0 + f64::from(storey) * 3f64.sqrt();
                scene.add(Body::new(Shape::Circle { radius: 1.0 }, x, y));
            }
        }
        scene
    }

    fn after(steps: u32) -> Pile {
        let mut pile = Pile::new(&tower());
        pile.advance(0.25, steps);
        pile
    }

    #[test]
    fn halving_the_step_halves_the_error_and_nothing_overlaps() {
        let [coarse, middle, fine] = [120, 240, 480].map(after);
        let distance = |a: &Pile, b: &Pile| -> f64 {
            a.positions.iter().zip(&b.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
        };
        let (first, second) = (distance(&coarse, &middle), distance(&middle, &fine));
        assert!(second < 0.75 * first && second < 0.1, "{first} then {second}");
        for (a, one) in fine.positions.iter().enumerate() {
            assert!(one.y > 0.999);
            assert!(fine.positions[a + 1..].iter().all(|other| one.distance(*other) > 1.99));
        }
    }
}
