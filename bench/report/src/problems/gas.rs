//! Problem 13: an elastic gas between hard walls.

use crate::engine::{State, Trace};
use crate::reference::events::{Disc, Gas};
use crate::scene::{Body, Mulberry, Scene, Shape};
use crate::study::{Norm, Problem};
use glam::DVec2;
use std::sync::OnceLock;

const SIDE: f64 = 120.0;
/// Number of ticks for which trajectories are compared; after that the gas is chaotic.
const EARLY_TICKS: usize = 30;

pub const PROBLEMS: [Problem; 1] = [Problem {
    id: "13",
    title: "Elastic gas",
    about: "100 discs of radius 1 to 3.5 in a box of 120 by 120, speeds to 50 units/s, restitution 1, \
            no friction, no gravity (shared scene B7). Places are compared after half a second, the \
            energy after 10 s.",
    reference: "an event-driven code in f64 without time steps; energy stays what it was",
    scene,
    ticks: 600,
    norms: &[
        Norm { name: "rms position error at 0.5 s", unit: "units", of: place_error },
        Norm { name: "relative energy error at 10 s", unit: "", of: energy_error },
        Norm {
            name: "distance of the energies from Maxwell's law, 5 to 10 s",
            unit: "",
            of: maxwell_error,
        },
    ],
    magnitude: SIDE,
}];

fn scene() -> Scene {
    let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
    scene.contain(SIDE, SIDE, 0.0, 1.0);
    let mut draws = Mulberry(0x0E4E_26F7);
    for i in 0..100 {
        let radius = 1.0 + 2.5 * draws.unit();
        let (x, y) = (12.0 * (f64::from(i % 10) + 0.5), 12.0 * (f64::from(i / 10) + 0.5));
        let (vx, vy) = (draws.range(-50.0, 50.0), draws.range(-50.0, 50.0));
        let disc = Body::new(Shape::Circle { radius }, x, y).moving(vx, vy);
        scene.add(disc.of_stuff(0.0, 1.0));
    }
    scene
}

/// Positions at the end of the early part, computed only once.
fn reference(scene: &Scene) -> &'static [DVec2] {
    static PLACES: OnceLock<Vec<DVec2>> = OnceLock::new();
    PLACES.get_or_init(|| {
        let disc = |index: usize| {
            let body = scene.bodies[index];
            let state = State { position: body.position, velocity: body.velocity };
            Disc { radius: body.shape.half_extent().x, mass: body.mass, state }
        };
        let mut gas = Gas { size: DVec2::splat(SIDE), discs: scene.dynamic().map(disc).collect() };
        gas.advance(EARLY_TICKS as f64 * scene.tick_s);
        gas.discs.iter().map(|disc| disc.state.position).collect()
    })
}

fn place_error(scene: &Scene, trace: &Trace) -> f64 {
    let exact = reference(scene);
    let found = &trace.states[EARLY_TICKS];
    let squares = scene.dynamic().zip(exact).map(|(i, p)| found[i].position.distance_squared(*p));
    (squares.sum::<f64>() / exact.len() as f64).sqrt()
}

fn energy_error(scene: &Scene, trace: &Trace) -> f64 {
    let energy = |states: &[State]| -> f64 {
        scene.dynamic().map(|i| scene.bodies[i].mass * states[i].velocity.length_squared()).sum()
    };
    (energy(trace.last()) / energy(&trace.states[0]) - 1.0).abs()
}

/// Kolmogorov-Smirnov distance between the discs' energies and the exponential distribution, over all discs and every
/// half second. In two dimensions Maxwell's distribution of speeds implies exponentially distributed energies, for
/// large and small discs alike. The initial mean is used, so that cooling counts as an error.
fn maxwell_error(scene: &Scene, trace: &Trace) -> f64 {
    let energies = |states: &[State]| -> Vec<f64> {
        let energy = |i: usize| scene.bodies[i].mass * states[i].velocity.length_squared();
        scene.dynamic().map(energy).collect()
    };
    let start = energies(&trace.states[0]);
    let mean = start.iter().sum::<f64>() / start.len() as f64;
    let late = trace.states.iter().skip(trace.states.len() / 2).step_by(30);
    let mut found: Vec<f64> = late.flat_map(|states| energies(states)).collect();
    found.sort_by(f64::total_cmp);
    let count = found.len() as f64;
    let distance = |(rank, energy): (usize, &f64)| {
        let share = 1.0 - (-energy / mean).exp();
        (share - rank as f64 / count).abs().max((share - (rank + 1) as f64 / count).abs())
    };
    found.iter().enumerate().map(distance).fold(0.0, f64::max)
}
