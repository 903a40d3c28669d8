//! Problems 1, 2, 3 and 12: nothing touches, so only the integrator is measured.

use super::worst;
use crate::engine::{State, Trace};
use crate::reference::{closed, fine};
use crate::scene::{Body, Drag, Mulberry, Scene, Shape};
use crate::study::{Norm, Problem};
use glam::DVec2;

const START: DVec2 = DVec2::new(30.0, 40.0);
const GRAVITY: f64 = 50.0;
const RATE: f64 = 2.0;
const RATE_SQUARED: f64 = 0.05;
const PARTICLES: u32 = 200;

pub const PROBLEMS: [Problem; 5] = [
    Problem {
        id: "1",
        title: "Ballistic flight, 10 s",
        about: "One body, thrown with (30, 40) units/s under gravity 50, nothing to meet.",
        reference: "closed form x0 + v0 t + g t²/2",
        scene: ballistic,
        ticks: 600,
        norms: &[Norm {
            name: "largest position error",
            unit: "units",
            of: |scene, trace| {
                let exact = |t| closed::flight(DVec2::ZERO, START, scene.gravity, t);
                worst(trace.of(0).map(|(t, state)| state.position.distance(exact(t))))
            },
        }],
        magnitude: 2100.0,
    },
    Problem {
        id: "2",
        title: "Linear drag",
        about: "One body, thrown with (30, 40) units/s under gravity 50 and drag 2/s, for 3 s: it \
                reaches its terminal speed of 25.",
        reference: "closed form v = g/k + (v0 - g/k) e^(-kt)",
        scene: || dragged(Drag::Linear(RATE)),
        ticks: 180,
        norms: &[
            Norm {
                name: "largest position error",
                unit: "units",
                of: |s, t| drag_error(s, t, position),
            },
            Norm {
                name: "largest velocity error",
                unit: "units/s",
                of: |s, t| drag_error(s, t, speed),
            },
        ],
        magnitude: 60.0,
    },
    Problem {
        id: "3a",
        title: "Fall with quadratic drag",
        about: "One body falls from rest for 3 s under gravity 50 and drag 0.05 |v| v.",
        reference: "closed form v = vt tanh(gt/vt), x = vt²/g ln cosh(gt/vt)",
        scene: || {
            let mut scene = dragged(Drag::Quadratic(RATE_SQUARED));
            scene.bodies[0].velocity = DVec2::ZERO;
            scene
        },
        ticks: 180,
        norms: &[
            Norm {
                name: "largest position error",
                unit: "units",
                of: |_, trace| {
                    let way = |t| closed::quadratic_fall(GRAVITY, RATE_SQUARED, t).0;
                    worst(trace.of(0).map(|(t, state)| (state.position.y + way(t)).abs()))
                },
            },
            Norm {
                name: "largest velocity error",
                unit: "units/s",
                of: |_, trace| {
                    let speed = |t| closed::quadratic_fall(GRAVITY, RATE_SQUARED, t).1;
                    worst(trace.of(0).map(|(t, state)| (state.velocity.y + speed(t)).abs()))
                },
            },
        ],
        magnitude: 90.0,
    },
    Problem {
        id: "3b",
        title: "Throw with quadratic drag",
        about: "One body, thrown with (30, 40) units/s under gravity 50 and drag 0.05 |v| v, for 3 s: \
                no closed form knows its path.",
        reference: "Runge-Kutta of fourth order in f64, 64 steps a tick, itself compared with the \
                    closed form of 3a",
        scene: || dragged(Drag::Quadratic(RATE_SQUARED)),
        ticks: 180,
        norms: &[
            Norm {
                name: "largest position error",
                unit: "units",
                of: |scene, trace| throw_error(scene, trace, position),
            },
            Norm {
                name: "largest velocity error",
                unit: "units/s",
                of: |scene, trace| throw_error(scene, trace, speed),
            },
        ],
        magnitude: 90.0,
    },
    Problem {
        id: "12",
        title: "Particles of an emitter",
        about: "200 particles, which do not meet, leave one point within a cone, under gravity 50 and drag 2/s, for 3 s. \
                Bodies that meet nobody take part beside Jostle's particles, whose steps are the \
                chapter's: v = (v + a dt) drag, x += v dt. Time and error are those of all 200.",
        reference: "problem 2's closed form for each particle",
        scene: fountain,
        ticks: 180,
        norms: &[
            Norm {
                name: "largest position error",
                unit: "units",
                of: |s, t| drag_error(s, t, position),
            },
            Norm {
                name: "largest velocity error",
                unit: "units/s",
                of: |s, t| drag_error(s, t, speed),
            },
        ],
        magnitude: 60.0,
    },
];

fn ballistic() -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.add(Body::new(Shape::Circle { radius: 1.0 }, 0.0, 0.0).moving(START.x, START.y));
    scene
}

fn dragged(drag: Drag) -> Scene {
    Scene { drag, ..ballistic() }
}

fn fountain() -> Scene {
    let mut scene = Scene { drag: Drag::Linear(RATE), collides: false, ..Scene::new(GRAVITY) };
    let mut draws = Mulberry(12);
    for _ in 0..PARTICLES {
        let (x, y) = (draws.range(-20.0, 20.0), draws.range(20.0, 50.0));
        scene.add(Body::new(Shape::Circle { radius: 0.1 }, 0.0, 0.0).moving(x, y));
    }
    scene
}

fn throw_error(scene: &Scene, trace: &Trace, part: fn(State) -> DVec2) -> f64 {
    let exact = fine::flight(scene, trace.states.len() - 1, 64);
    let readings = trace.states.iter().zip(&exact);
    worst(readings.map(|(found, exact)| part(found[0]).distance(part(exact[0]))))
}

fn position(state: State) -> DVec2 {
    state.position
}

fn speed(state: State) -> DVec2 {
    state.velocity
}

fn drag_error(scene: &Scene, trace: &Trace, part: fn(State) -> DVec2) -> f64 {
    let Drag::Linear(rate) = scene.drag else { return f64::NAN };
    let of_body = |index: usize| {
        let body = scene.bodies[index];
        worst(trace.of(index).map(|(t, state)| {
            let (position, velocity) =
                closed::linear_drag(body.position, body.velocity, scene.gravity, rate, t);
            part(state).distance(part(State { position, velocity }))
        }))
    };
    worst((0..scene.bodies.len()).map(of_body))
}
