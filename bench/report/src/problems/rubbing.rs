//! Problem 10 with friction. The contacts form a tree, so that the velocities determine every impulse.
//!
//! With at most as many contacts as bodies, the impulses are unique, and Coulomb's law can be checked. The impulse
//! through a contact is the momentum gained by the bodies beyond it, p = sum of m (v - v*).

use super::pile::program;
use super::worst;
use crate::engine::Trace;
use crate::reference::coulomb::Coulomb;
use crate::scene::{Body, Mulberry, Scene, Shape, TICK_S};
use crate::study::{Norm, Problem};
use glam::DVec2;
use std::sync::OnceLock;

const DISCS: usize = 100;
const FRICTION: f64 = 0.5;
/// The same overlap and step as in the rest of problem 10.
const PRESSED: f64 = 0.002;
const SHORT_S: f64 = TICK_S / 100.0;
/// Minimum distance between discs that do not touch.
const CLEAR: f64 = 0.1;

pub const PROBLEMS: [Problem; 1] = [Problem {
    id: "10c",
    title: "One step of a pressed cluster with friction",
    about: "100 equal discs, each pressed by 0.002 against one of those before it and clear of all others, with \
            random velocities to 1 unit/s; friction 0.5, no gravity, e = 0. One step of 1/6000 s from cold. The \
            contacts form a tree, so the velocities tell the impulses.",
    reference: "Coulomb's law in f64: Gauss-Seidel to 10⁻¹³, a fixed point of bounded programs agrees to 10⁻⁹",
    scene: cluster,
    ticks: 1,
    norms: &[
        Norm {
            name: "largest velocity error",
            unit: "units/s",
            of: |scene, trace| {
                let exact = solution(scene);
                worst(trace.last().iter().zip(exact).map(|(found, v)| found.velocity.distance(*v)))
            },
        },
        Norm {
            name: "fastest approach left (Signorini violation)",
            unit: "units/s",
            of: |scene, trace| worst(contacts(scene, trace).map(|c| (-c.relative.x).max(0.0))),
        },
        Norm {
            name: "friction beyond its limit (Coulomb violation)",
            unit: "units/s a mass",
            of: |scene, trace| {
                let mass = scene.bodies[0].mass;
                let beyond = |c: Passed| (c.impulse.y.abs() - FRICTION * c.impulse.x).max(0.0);
                worst(contacts(scene, trace).map(|c| beyond(c) / mass))
            },
        },
        Norm {
            name: "dissipation that is missing (maximum dissipation)",
            unit: "units²/s² a mass",
            of: |scene, trace| {
                let mass = scene.bodies[0].mass;
                let most = |c: &Passed| FRICTION * c.impulse.x.max(0.0) * c.relative.y.abs();
                let missing = |c: Passed| (most(&c) + c.impulse.y * c.relative.y).max(0.0);
                worst(contacts(scene, trace).map(|c| missing(c) / mass))
            },
        },
    ],
    magnitude: 1.0,
}];

/// The scene, in which each disc except the first touches one earlier disc.
fn cluster() -> Scene {
    let mut scene = Scene { tick_s: SHORT_S, ..Scene::new(0.0) };
    let mut draws = Mulberry(0x10C);
    let shape = Shape::Circle { radius: 1.0 };
    while scene.bodies.len() < DISCS {
        let turn = draws.range(0.0, std::f64::consts::TAU);
        let carrier = (draws.unit() * scene.bodies.len() as f64) as usize;
        let position = match scene.bodies.get(carrier) {
            Some(body) => body.position + DVec2::from_angle(turn) * (2.0 - PRESSED),
            None => DVec2::ZERO,
        };
        let mut others = scene.bodies.iter().enumerate().filter(|(other, _)| *other != carrier);
        let clear = |(_, body): (usize, &Body)| body.position.distance(position) > 2.0 + CLEAR;
        let velocity = (draws.range(-1.0, 1.0), draws.range(-1.0, 1.0));
        if others.all(clear) {
            let disc = Body::new(shape, position.x, position.y).moving(velocity.0, velocity.1);
            scene.add(disc.of_stuff(FRICTION, 0.0));
        }
    }
    scene
}

/// Returns the reference solution, which is computed only once.
fn solution(scene: &Scene) -> &'static [DVec2] {
    static VELOCITIES: OnceLock<Vec<DVec2>> = OnceLock::new();
    VELOCITIES.get_or_init(|| {
        let program = program(scene);
        Coulomb { program: &program, friction: FRICTION }.gauss_seidel(1e-13, 1_000_000)
    })
}

/// The impulse through a contact, and the relative velocity after it, each along the normal and along the tangent.
#[derive(Clone, Copy)]
struct Passed {
    impulse: DVec2,
    relative: DVec2,
}

/// All contacts at the end of a run. Each disc touches only one earlier disc, so when going backwards from the last
/// disc, the impulses beyond a disc are known before its own.
fn contacts(scene: &Scene, trace: &Trace) -> impl Iterator<Item = Passed> {
    let last = trace.last();
    let gain =
        |body: usize| (last[body].velocity - scene.bodies[body].velocity) * scene.bodies[body].mass;
    let mut gained: Vec<DVec2> = (0..scene.bodies.len()).map(gain).collect();
    let mut contacts = program(scene).contacts;
    contacts.sort_by_key(|contact| std::cmp::Reverse(contact.b));
    let mut passed = Vec::new();
    for contact in contacts {
        let (through, normal) = (gained[contact.b], contact.normal);
        gained[contact.a] += through;
        let relative = last[contact.b].velocity - last[contact.a].velocity;
        let parts = |v: DVec2| DVec2::new(normal.dot(v), normal.perp().dot(v));
        passed.push(Passed { impulse: parts(through), relative: parts(relative) });
    }
    passed.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::State;

    #[test]
    fn both_references_agree_and_keep_the_laws() {
        let scene = cluster();
        let program = program(&scene);
        assert_eq!(program.contacts.len(), DISCS - 1, "a tree");
        let coulomb = Coulomb { program: &program, friction: FRICTION };
        let (one, other) = (solution(&scene), coulomb.fixed_point(1e-13, 10_000));
        for (a, b) in one.iter().zip(&other) {
            assert!(a.distance(*b) < 1e-9, "{a} and {b}");
        }
        let states = scene.bodies.iter().zip(one);
        let last = states.map(|(b, &velocity)| State { position: b.position, velocity }).collect();
        let trace = Trace { tick_s: SHORT_S, states: vec![last] };
        for norm in PROBLEMS[0].norms {
            let error = (norm.of)(&scene, &trace);
            assert!(error < 1e-10, "{}: {error}", norm.name);
        }
        let sliding =
            contacts(&scene, &trace).filter(|c| c.relative.y.abs() > 1e-3 && c.impulse.x > 0.0);
        let sticking = contacts(&scene, &trace).filter(|c| c.relative.length() < 1e-9);
        assert!(sliding.count() > 5 && sticking.count() > 5, "both kinds are in it");
    }
}
