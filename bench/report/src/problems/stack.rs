//! Problem 9: bodies at rest must stay at rest under any load.

use super::worst;
use crate::engine::{State, Trace};
use crate::scene::{Body, Scene, Shape};
use crate::shape::deepest_overlap;
use crate::study::{Norm, Problem};

const GRAVITY: f64 = 50.0;
/// The norm that shows how many sweeps a stack needs.
pub const FORCE_ERROR: &str = "largest relative error of a contact force, last second";

const NORMS: &[Norm] = &[
    Norm {
        name: "largest displacement at the end",
        unit: "units",
        of: |scene, trace| {
            let moved =
                |index: usize| trace.last()[index].position.distance(scene.bodies[index].position);
            worst(scene.dynamic().map(moved))
        },
    },
    Norm {
        name: "deepest overlap at the end",
        unit: "units",
        of: |s, t| deepest_overlap(&s.bodies, t.last()),
    },
    Norm { name: "rms speed, last second", unit: "units/s", of: rms_speed },
    Norm { name: FORCE_ERROR, unit: "", of: force_error },
];

pub const PROBLEMS: [Problem; 3] = [
    Problem {
        id: "9a",
        title: "Stack of 20 boxes at rest",
        about: "20 boxes 2 high, touching, on a floor, gravity 50; 3 s.",
        reference: "nothing moves: the contact forces carry the sum of the weights above",
        scene: || stack(&[1.0; 20]),
        ticks: 180,
        norms: NORMS,
        magnitude: 40.0,
    },
    Problem {
        id: "9b",
        title: "Stack of 100 boxes at rest",
        about: "100 boxes 2 high, touching, on a floor, gravity 50; 3 s.",
        reference: "nothing moves",
        scene: || stack(&[1.0; 100]),
        ticks: 180,
        norms: NORMS,
        magnitude: 200.0,
    },
    Problem {
        id: "9c",
        title: "Mass 1000 on mass 1",
        about: "Two boxes 2 high, touching, the upper one of mass 1000, gravity 50; 3 s.",
        reference: "nothing moves",
        scene: || stack(&[1.0, 1000.0]),
        ticks: 180,
        norms: NORMS,
        magnitude: 4.0,
    },
];

fn stack(masses: &[f64]) -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.floor(100.0, 0.3, 0.0);
    for (row, &mass) in masses.iter().enumerate() {
        scene.add(Body::new(Shape::rect(1.0, 1.0), 0.0, 1.0 + 2.0 * row as f64).of_mass(mass));
    }
    scene
}

fn rms_speed(scene: &Scene, trace: &Trace) -> f64 {
    let last = &trace.states[trace.states.len().saturating_sub(60)..];
    let squares =
        last.iter().flat_map(|bodies| scene.dynamic().map(|i| bodies[i].velocity.length_squared()));
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
    (sum / count).sqrt()
}

/// Error of the contact forces. The force under a box supports and accelerates everything above it, so it follows from
/// the speeds, as the sum of m_j (g + dv_j/dt) over these boxes.
fn force_error(scene: &Scene, trace: &Trace) -> f64 {
    let late = &trace.states[trace.states.len().saturating_sub(61)..];
    let of_tick = |pair: &[Vec<State>]| {
        let (mut surplus, mut weight, mut largest) = (0.0, 0.0, 0.0f64);
        let boxes: Vec<usize> = scene.dynamic().collect();
        for &index in boxes.iter().rev() {
            let mass = scene.bodies[index].mass;
            let gain = pair[1][index].velocity.y - pair[0][index].velocity.y;
            surplus += mass * gain / trace.tick_s;
            weight += mass * GRAVITY;
            largest = worst([largest, (surplus / weight).abs()].into_iter());
        }
        largest
    };
    worst(late.windows(2).map(of_tick))
}
