//! Problems 4, 5 and 6: one body against immovable ones.

use super::worst;
use crate::engine::Trace;
use crate::reference::closed;
use crate::scene::{Body, Scene, Shape};
use crate::study::{Norm, Problem};
use glam::DVec2;

const GRAVITY: f64 = 50.0;
const DROP: f64 = 20.0;
const SLIDE_SPEED: f64 = 20.0;
const FRICTION: f64 = 0.3;
/// The slope of problem 6: tan(angle).
const TILT: f64 = 0.45;
const SLIPPERY: f64 = 0.3;
const ROUGH: f64 = 0.6;
/// Number of bodies in problem 6 that find the onset of sliding. Their friction differs from the tangent of the slope
/// by 10 %, 5 %, 2.5 % and so on in both directions, so that a single run is a bisection.
const PROBES: usize = 22;
/// A body that moves further than this has slipped, in units.
const SLIPS: f64 = 0.01;

pub const PROBLEMS: [Problem; 5] = [
    Problem {
        id: "4a",
        title: "Bouncing ball, e = 0.9",
        about: "A ball of radius 1 falls 20 units onto a floor, gravity 50; five seconds, five bounces.",
        reference: "closed form: bounces at t1 + 2 t1 (e + e² + ...), heights h e^2n",
        scene: || ball(0.9),
        ticks: 300,
        norms: &[
            Norm {
                name: "largest height error",
                unit: "units",
                of: |_, trace| height_error(trace, 0.9),
            },
            Norm {
                name: "relative error of the energy at the end",
                unit: "",
                of: |_, trace| {
                    (energy(trace, trace.states.len() - 1) / (GRAVITY * kept(0.9)) - 1.0).abs()
                },
            },
        ],
        magnitude: 20.0,
    },
    Problem {
        id: "4b",
        title: "Bouncing ball, e = 0.5",
        about: "The same with half of the speed kept: it lies still after 3 t1 = 2.68 s.",
        reference: "closed form, Zeno time t1 + 2 t1 e/(1 - e)",
        scene: || ball(0.5),
        ticks: 300,
        norms: &[
            Norm {
                name: "largest height error",
                unit: "units",
                of: |_, trace| height_error(trace, 0.5),
            },
            Norm {
                name: "height error at the end",
                unit: "units",
                of: |_, trace| (trace.last()[1].position.y - 1.0).abs(),
            },
        ],
        magnitude: 20.0,
    },
    Problem {
        id: "4c",
        title: "Bouncing ball, e = 1: energy",
        about: "The same without loss, for 20 s, some 11 bounces.",
        reference: "energy stays what it was",
        scene: || ball(1.0),
        ticks: 1200,
        norms: &[Norm {
            name: "relative energy error at the end",
            unit: "",
            of: |_, trace| (energy(trace, trace.states.len() - 1) / energy(trace, 0) - 1.0).abs(),
        }],
        magnitude: 1.0,
    },
    Problem {
        id: "5",
        title: "Sliding box, Coulomb friction",
        about: "A box slides at 20 units/s over a floor with friction 0.3, gravity 50, until it stops \
                after 13.33 units and 1.33 s.",
        reference: "closed form d = v0²/(2 mu g)",
        scene: || {
            let mut scene = Scene::new(GRAVITY);
            scene.floor(200.0, FRICTION, 0.0);
            let slider = Body::new(Shape::rect(1.0, 1.0), 0.0, 1.0).moving(SLIDE_SPEED, 0.0);
            scene.add(slider.of_stuff(FRICTION, 0.0));
            scene
        },
        ticks: 180,
        norms: &[
            Norm {
                name: "stop distance error",
                unit: "units",
                of: |_, trace| {
                    let stop = closed::slide(SLIDE_SPEED, FRICTION * GRAVITY, 99.0);
                    (trace.last()[1].position.x - stop).abs()
                },
            },
            Norm {
                name: "largest position error on the way",
                unit: "units",
                of: |_, trace| {
                    let exact = |t| closed::slide(SLIDE_SPEED, FRICTION * GRAVITY, t);
                    worst(trace.of(1).map(|(t, state)| (state.position.x - exact(t)).abs()))
                },
            },
        ],
        magnitude: 13.3,
    },
    Problem {
        id: "6",
        title: "Tilted gravity: slip and stick",
        about: "Gravity 50 turned so that floors have a slope of 0.45. One box with friction 0.3 \
                slides, one with 0.6 must stick, 22 more bisect the angle of onset; 2 s.",
        reference: "slips where tan(angle) > mu, with a = g (sin - mu cos)",
        scene: slope,
        ticks: 120,
        norms: &[
            Norm {
                name: "error of the way slid",
                unit: "units",
                of: |scene, trace| {
                    let acceleration = scene.gravity.x + SLIPPERY * scene.gravity.y;
                    let t = (trace.states.len() - 1) as f64 * trace.tick_s;
                    (way(scene, trace, 0) - acceleration * t * t / 2.0).abs()
                },
            },
            Norm {
                name: "creep of the box that sticks",
                unit: "units",
                of: |scene, trace| way(scene, trace, 1).abs(),
            },
            Norm { name: "error of the angle of onset", unit: "degrees", of: onset_error },
        ],
        magnitude: 35.0,
    },
];

fn ball(restitution: f64) -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.floor(50.0, 0.0, restitution);
    let ball = Body::new(Shape::Circle { radius: 1.0 }, 0.0, 1.0 + DROP);
    scene.add(ball.of_stuff(0.0, restitution));
    scene
}

fn height_error(trace: &Trace, restitution: f64) -> f64 {
    let exact = |t| 1.0 + closed::bounce(DROP, GRAVITY, restitution, t);
    worst(trace.of(1).map(|(t, state)| (state.position.y - exact(t)).abs()))
}

/// Share of the drop height that is left after bouncing for five seconds.
fn kept(restitution: f64) -> f64 {
    let (mut next, mut height) = ((2.0 * DROP / GRAVITY).sqrt(), DROP);
    while next < 5.0 {
        height *= restitution * restitution;
        next += 2.0 * (2.0 * height / GRAVITY).sqrt();
    }
    height
}

/// The ball's energy per unit of mass.
fn energy(trace: &Trace, tick: usize) -> f64 {
    let state = trace.states[tick][1];
    state.velocity.length_squared() / 2.0 + GRAVITY * (state.position.y - 1.0)
}

/// Each box has a separate floor; the bodies alternate between floor and box.
fn slope() -> Scene {
    let mut scene = Scene::new(0.0);
    let cosine = 1.0 / (1.0 + TILT * TILT).sqrt();
    scene.gravity = DVec2::new(TILT * cosine, -cosine) * GRAVITY;
    let probes = (0..PROBES).map(probe);
    for (row, friction) in [SLIPPERY, ROUGH].into_iter().chain(probes).enumerate() {
        let y = row as f64 * 10.0;
        scene.add(Body::fixed(Shape::rect(200.0, 1.0), 0.0, y - 1.0).of_stuff(friction, 0.0));
        scene.add(Body::new(Shape::rect(1.0, 1.0), 0.0, y + 1.0).of_stuff(friction, 0.0));
    }
    scene
}

/// The friction of a probe; index 0 is the smoothest.
fn probe(index: usize) -> f64 {
    let half = PROBES / 2;
    let (side, step) = if index < half { (-1.0, index) } else { (1.0, PROBES - 1 - index) };
    TILT * (1.0 + side * 0.1 * 0.5f64.powi(step as i32))
}

fn way(scene: &Scene, trace: &Trace, row: usize) -> f64 {
    let index = 2 * row + 1;
    trace.last()[index].position.x - scene.bodies[index].position.x
}

/// The error in the onset, taken as midway between the roughest box that slipped and the next one; 0 if they bracket
/// the true value as closely as the probes allow.
fn onset_error(scene: &Scene, trace: &Trace) -> f64 {
    let slid = (0..PROBES).filter(|&i| way(scene, trace, i + 2).abs() > SLIPS).count();
    let degrees = |friction: f64| friction.atan().to_degrees();
    let (low, high) = match slid {
        0 => (0.0, probe(0)),
        PROBES => (probe(PROBES - 1), 2.0 * TILT),
        _ => (probe(slid - 1), probe(slid)),
    };
    (degrees((low + high) / 2.0) - degrees(TILT)).abs()
}
