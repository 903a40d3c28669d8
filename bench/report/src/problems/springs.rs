//! Problem 11: springs, without contacts.

use super::worst;
use crate::engine::{State, Trace};
use crate::reference::{closed, fine};
use crate::scene::{Body, Hook, Scene, Shape, Spring};
use crate::study::{Norm, Problem};
use glam::DVec2;
use std::sync::OnceLock;

/// Angular frequency of one period per second.
const TURN: f64 = std::f64::consts::TAU;
const GRAVITY: f64 = 50.0;
/// Damping in problem 11b, as a share of critical damping.
const RATIO: f64 = 0.1;
const START: DVec2 = DVec2::new(1.0, 0.0);
const THROWN: DVec2 = DVec2::new(0.0, 5.0);
/// The rope: the number of bodies, the distance between them, and a link's oscillations per second.
const LINKS: usize = 10;
const LINK: f64 = 1.0;
const LINK_HZ: f64 = 30.0;
const LINK_RATIO: f64 = 0.05;
const ROPE_TICKS: u32 = 60;

pub const PROBLEMS: [Problem; 3] = [
    Problem {
        id: "11a",
        title: "Spring, 100 periods",
        about: "One body on a spring of one period a second and no length at rest, let go at 1 unit, \
                for 100 periods.",
        reference: "closed form cos(wt)",
        scene: || hooked(0.0, 0.0, DVec2::ZERO),
        ticks: 6000,
        norms: &[
            Norm {
                name: "largest position error",
                unit: "amplitudes",
                of: |_, trace| {
                    worst(trace.of(0).map(|(t, s)| (s.position.x - (TURN * t).cos()).abs()))
                },
            },
            Norm {
                name: "amplitude error at the end",
                unit: "amplitudes",
                of: |_, trace| {
                    let State { position, velocity } = trace.last()[0];
                    (position.x.hypot(velocity.x / TURN) - 1.0).abs()
                },
            },
        ],
        magnitude: 1.0,
    },
    Problem {
        id: "11b",
        title: "Damped spring under gravity",
        about: "The same spring with a tenth of critical damping, under gravity 50, its body thrown \
                upwards at 5 units/s from beside the hook: a spiral to the rest point, for 10 s.",
        reference: "closed form of the damped swing",
        scene: || hooked(GRAVITY, RATIO, THROWN),
        ticks: 600,
        norms: &[
            Norm {
                name: "largest position error",
                unit: "units",
                of: |scene, trace| {
                    worst(trace.of(0).map(|(t, state)| state.position.distance(swing(scene, t))))
                },
            },
            Norm {
                name: "distance from the rest point at the end",
                unit: "units",
                of: |scene, trace| trace.last()[0].position.distance(swing(scene, 10.0)),
            },
        ],
        magnitude: 2.5,
    },
    Problem {
        id: "11c",
        title: "Stiff rope of 10 bodies",
        about: "10 bodies 1 unit apart on springs of 30 swings a second with a twentieth of critical \
                damping, three times too stiff for explicit steps of a tick, hang from a hook at 45 \
                degrees and are let go under gravity 50; 1 s.",
        reference: "Runge-Kutta of fourth order in f64, 256 steps a tick; half as many agree to 10⁻⁸",
        scene: rope,
        ticks: ROPE_TICKS,
        norms: &[
            Norm { name: "largest position error", unit: "units", of: rope_error },
            Norm { name: "rms position error at the end", unit: "units", of: rope_rms },
            Norm {
                name: "largest change of a link's length",
                unit: "units",
                of: |_, trace| worst(trace.states.iter().map(|states| stretch(states))),
            },
        ],
        magnitude: 10.0,
    },
];

fn hooked(gravity: f64, ratio: f64, thrown: DVec2) -> Scene {
    let mut scene = Scene { collides: false, ..Scene::new(gravity) };
    let ball = Body::new(Shape::Circle { radius: 0.1 }, START.x, START.y).of_mass(1.0);
    let body = scene.add(ball.moving(thrown.x, thrown.y));
    let to = Hook::Point(DVec2::ZERO);
    let (stiffness, damping) = (TURN * TURN, 2.0 * ratio * TURN);
    scene.springs.push(Spring { body, to, length: 0.0, stiffness, damping });
    scene
}

fn swing(scene: &Scene, t: f64) -> DVec2 {
    let rate = 2.0 * RATIO * TURN;
    closed::damped(START, THROWN, scene.gravity, TURN * TURN, rate, t).0
}

fn rope() -> Scene {
    let mut scene = Scene { collides: false, ..Scene::new(GRAVITY) };
    let turn = TURN * LINK_HZ;
    let along = DVec2::new(1.0, -1.0).normalize() * LINK;
    for link in 0..LINKS {
        let position = along * (link + 1) as f64;
        let ball = Body::new(Shape::Circle { radius: 0.1 }, position.x, position.y).of_mass(1.0);
        let body = scene.add(ball);
        let to = if link == 0 { Hook::Point(DVec2::ZERO) } else { Hook::Body(link - 1) };
        let stiffness = turn * turn * 0.5;
        let damping = 2.0 * LINK_RATIO * turn * 0.5;
        scene.springs.push(Spring { body, to, length: LINK, stiffness, damping });
    }
    scene
}

/// Returns the reference solution, which is computed only once.
fn exact(scene: &Scene) -> &'static [Vec<State>] {
    static STATES: OnceLock<Vec<Vec<State>>> = OnceLock::new();
    STATES.get_or_init(|| fine::flight(scene, ROPE_TICKS as usize, 256))
}

fn distances<'a>(found: &'a [State], exact: &'a [State]) -> impl Iterator<Item = f64> + 'a {
    found.iter().zip(exact).map(|(a, b)| a.position.distance(b.position))
}

fn rope_error(scene: &Scene, trace: &Trace) -> f64 {
    let readings = trace.states.iter().zip(exact(scene));
    worst(readings.map(|(found, exact)| worst(distances(found, exact))))
}

fn rope_rms(scene: &Scene, trace: &Trace) -> f64 {
    let last = exact(scene).last().expect("the start is always there");
    let squares: f64 = distances(trace.last(), last).map(|distance| distance * distance).sum();
    (squares / last.len() as f64).sqrt()
}

fn stretch(states: &[State]) -> f64 {
    let from_hook = (states[0].position.length() - LINK).abs();
    let links = states.windows(2).map(|pair| pair[0].position.distance(pair[1].position) - LINK);
    worst(links.map(f64::abs).chain([from_hook]))
}

#[cfg(test)]
mod tests {
    use super::{distances, exact, rope};
    use crate::reference::fine;

    #[test]
    fn the_reference_of_the_rope_has_converged() {
        let scene = rope();
        let other = fine::flight(&scene, super::ROPE_TICKS as usize, 128);
        for (one, other) in exact(&scene).iter().zip(&other) {
            assert!(distances(one, other).all(|distance| distance < 1e-8));
        }
    }
}
