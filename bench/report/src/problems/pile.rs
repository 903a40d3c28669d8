//! Problems 10 and 14: many simultaneous contacts, compared with quadratic programs solved in f64.

use super::worst;
use crate::engine::{State, Trace};
use crate::reference::moreau::Pile;
use crate::reference::program::{Contact, Program, Solution};
use crate::scene::{Body, Mulberry, Scene, Shape, TICK_S};
use crate::study::{Norm, Problem};
use glam::DVec2;
use std::sync::OnceLock;

/// Overlap of the discs in problem 10, which is less than any engine's slop but more than the discs move.
const PRESSED: f64 = 0.002;
/// A step so short that contact normals do not turn during it.
const SHORT_S: f64 = TICK_S / 100.0;
const SIDE: usize = 10;
/// Steps per tick in the reference, sixteen times as many as any method's finest setting.
const REFERENCE_STEPS: u32 = 512;
const COLUMNS: usize = 6;
const STOREYS: usize = 36;
const EARLY_TICKS: u32 = 30;

const ONE_STEP: &[Norm] = &[
    Norm {
        name: "largest velocity error",
        unit: "units/s",
        of: |scene, trace| {
            let exact = &solution(scene).velocities;
            worst(trace.last().iter().zip(exact).map(|(found, v)| found.velocity.distance(*v)))
        },
    },
    Norm {
        name: "fastest approach left (Signorini violation)",
        unit: "units/s",
        of: |scene, trace| {
            let velocity = |body: usize| trace.last()[body].velocity;
            let program = program(scene);
            let closing = |c: &Contact| -c.normal.dot(velocity(c.b) - velocity(c.a));
            worst(program.contacts.iter().map(|contact| closing(contact).max(0.0)))
        },
    },
];

pub const PROBLEMS: [Problem; 3] = [
    Problem {
        id: "10a",
        title: "One step of a pressed pile",
        about: "100 equal discs packed like honeycomb, each pair overlapping by 0.002, with random \
                velocities to 1 unit/s; no friction, no gravity, e = 0. One step of 1/6000 s from cold.",
        reference: "the quadratic program in f64: Gauss-Seidel to 10⁻¹³, accelerated gradients agree \
                    to 10⁻⁹",
        scene: || pressed(0.0),
        ticks: 1,
        norms: ONE_STEP,
        magnitude: 1.0,
    },
    Problem {
        id: "10b",
        title: "The same with masses from 0.01 to 100",
        about: "As before; the logarithms of the masses are uniform.",
        reference: "as before",
        scene: || pressed(2.0),
        ticks: 1,
        norms: ONE_STEP,
        magnitude: 1.0,
    },
    Problem {
        id: "14",
        title: "Collapse of a tower of discs",
        about: "216 discs of radius 1, 6 wide and 36 high in a honeycomb, on a floor without friction, \
                e = 0, gravity 50: it spreads at once. Compared after half a second, before chaos.",
        reference: "Moreau's time stepping in f64 with 512 steps a tick, every step a quadratic \
                    program solved to 10⁻⁹",
        scene: tower,
        ticks: EARLY_TICKS,
        norms: &[
            Norm { name: "rms position error at 0.5 s", unit: "units", of: tower_error },
            Norm {
                name: "error of the centre's height",
                unit: "units",
                of: |scene, trace| {
                    let mean = |positions: &[DVec2]| {
                        positions.iter().map(|p| p.y).sum::<f64>() / positions.len() as f64
                    };
                    (mean(&positions(scene, trace.last())) - mean(fallen(scene))).abs()
                },
            },
            Norm {
                name: "Wasserstein distance of the heights",
                unit: "units",
                of: |scene, trace| {
                    let sorted = |positions: &[DVec2]| {
                        let mut heights: Vec<f64> = positions.iter().map(|p| p.y).collect();
                        heights.sort_by(f64::total_cmp);
                        heights
                    };
                    let (found, exact) =
                        (sorted(&positions(scene, trace.last())), sorted(fallen(scene)));
                    let distances = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
                    distances.sum::<f64>() / exact.len() as f64
                },
            },
        ],
        magnitude: 63.0,
    },
];

/// The scene of problem 10. Masses are 10^x with x between -`spread` and `spread`.
fn pressed(spread: f64) -> Scene {
    let mut scene = Scene { tick_s: SHORT_S, ..Scene::new(0.0) };
    let mut draws = Mulberry(10);
    let (across, up) = (2.0 - PRESSED, (2.0 - PRESSED) * 0.75f64.sqrt());
    for row in 0..SIDE {
        for column in 0..SIDE {
            let x = (column as f64 + if row % 2 == 1 { 0.5 } else { 0.0 }) * across;
            let velocity = (draws.range(-1.0, 1.0), draws.range(-1.0, 1.0));
            let mass = 10f64.powf(draws.range(-spread, spread));
            let disc = Body::new(Shape::Circle { radius: 1.0 }, x, row as f64 * up);
            let disc = disc.moving(velocity.0, velocity.1).of_mass(mass);
            scene.add(disc.of_stuff(0.0, 0.0));
        }
    }
    scene
}

/// Builds a quadratic program from all touching pairs in a scene of discs.
pub fn program(scene: &Scene) -> Program {
    let mut program = Program {
        inverse_masses: scene.bodies.iter().map(|body| 1.0 / body.mass).collect(),
        free: scene.bodies.iter().map(|body| body.velocity).collect(),
        contacts: Vec::new(),
    };
    for (a, one) in scene.bodies.iter().enumerate() {
        for (b, other) in scene.bodies.iter().enumerate().skip(a + 1) {
            let offset = other.position - one.position;
            if offset.length() < one.shape.half_extent().x + other.shape.half_extent().x {
                program.contacts.push(Contact {
                    a,
                    b,
                    normal: offset.normalize(),
                    min_normal_velocity: 0.0,
                });
            }
        }
    }
    program
}

/// Returns the reference solution, which is computed only once for each of the two scenes.
fn solution(scene: &Scene) -> &'static Solution {
    static EQUAL: OnceLock<Solution> = OnceLock::new();
    static UNEQUAL: OnceLock<Solution> = OnceLock::new();
    let equal = scene.bodies[0].mass == scene.bodies[1].mass;
    let cell = if equal { &EQUAL } else { &UNEQUAL };
    cell.get_or_init(|| program(scene).gauss_seidel(1e-13, 1_000_000))
}

fn tower() -> Scene {
    let mut scene = Scene::new(50.0);
    scene.floor(500.0, 0.0, 0.0);
    for storey in 0..STOREYS {
        for column in 0..COLUMNS {
            let shift = if storey % 2 == 1 { 0.5 } else { 0.0 };
            let x = (column as f64 + shift) * 2.0;
            let y = 1.0 + storey as f64 * 3f64.sqrt();
            scene.add(Body::new(Shape::Circle { radius: 1.0 }, x, y).of_stuff(0.0, 0.0));
        }
    }
    scene
}

/// Positions of the discs after half a second, computed only once.
fn fallen(scene: &Scene) -> &'static [DVec2] {
    static PLACES: OnceLock<Vec<DVec2>> = OnceLock::new();
    PLACES.get_or_init(|| {
        let mut pile = Pile::new(scene);
        pile.advance(f64::from(EARLY_TICKS) * scene.tick_s, EARLY_TICKS * REFERENCE_STEPS);
        pile.positions
    })
}

fn positions(scene: &Scene, states: &[State]) -> Vec<DVec2> {
    scene.dynamic().map(|body| states[body].position).collect()
}

fn tower_error(scene: &Scene, trace: &Trace) -> f64 {
    let exact = fallen(scene);
    let found = positions(scene, trace.last());
    let squares: f64 = found.iter().zip(exact).map(|(a, b)| a.distance_squared(*b)).sum();
    (squares / exact.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{pressed, program};

    #[test]
    fn both_references_of_the_pressed_pile_agree() {
        for spread in [0.0, 2.0] {
            let program = program(&pressed(spread));
            let one = program.gauss_seidel(1e-13, 1_000_000);
            let other = program.accelerated(1e-11, 1_000_000);
            assert!(program.contacts.len() > 250);
            for (a, b) in one.velocities.iter().zip(&other.velocities) {
                assert!(a.distance(*b) < 1e-9, "spread {spread}: {a} and {b}");
            }
        }
    }
}
