//! Forces far stiffer than a step can resolve: bodies subject to them must stay bounded and end up at the correct
//! position.

use super::{Case, Outcome, Subject, largest, outcome};
use crate::scene::{Body, Drag, Hook, Scene, Shape, Spring};
use glam::DVec2;

pub const CASES: [Case; 1] =
    [Case { id: "S21", title: "Stiff springs and drag, wind", run: forces }];

/// Rates per step, or radians per step.
const STIFF: [f64; 5] = [0.1, 1.0, 10.0, 100.0, 1000.0];
const TICKS: u32 = 1200;
const WIND: DVec2 = DVec2::new(3.0, 0.0);

fn forces(subject: &Subject) -> Outcome {
    outcome(|out| {
        for stiff in STIFF {
            drag(subject, stiff, out)?;
        }
        for length in [0.0, 2.0] {
            for stiff in STIFF {
                swing(subject, length, stiff, out)?;
                settle(subject, length, stiff, out)?;
            }
        }
        Ok(())
    })
}

/// Checks that a body thrown against the wind approaches w + g / k without ever exceeding it.
fn drag(subject: &Subject, stiff: f64, out: &mut Outcome) -> Result<(), String> {
    let mut scene = Scene { collides: false, wind: WIND, ..Scene::new(10.0) };
    let rate = stiff / scene.tick_s;
    scene.drag = Drag::Linear(rate);
    scene.add(Body::new(Shape::rect(0.5, 0.5), 0.0, 0.0).moving(-10.0, 5.0));
    let terminal = WIND + scene.gravity / rate;
    let mut engine = subject.build(&scene)?;
    let (mut last, mut passed) = (DVec2::new(-10.0, 5.0) - terminal, 0.0);
    for _ in 0..TICKS {
        engine.tick();
        let now = engine.state(0).velocity - terminal;
        passed = largest([passed, now.x, -now.y, last.x - now.x, now.y - last.y].into_iter());
        last = now;
    }
    let variant = format!("drag, k h = {stiff}");
    out.check(&variant, "speed beyond the final one, or back, units/s", 1e-4, passed);
    out.check(&variant, "error of the final speed, units/s", 1e-4, last.length());
    Ok(())
}

/// A body that hangs from a fixed point on a spring, one unit away from equilibrium.
fn sprung(length: f64, stiff: f64, ratio: f64, gravity: f64) -> Scene {
    let mut scene = Scene { collides: false, ..Scene::new(gravity) };
    let turn = stiff / scene.tick_s;
    let ball = Body::new(Shape::Circle { radius: 0.1 }, 0.0, -(length + 1.0));
    let body = scene.add(ball.of_mass(1.0));
    scene.springs.push(Spring {
        body,
        to: Hook::Point(DVec2::ZERO),
        length,
        stiffness: turn * turn,
        damping: 2.0 * ratio * turn,
    });
    scene
}

/// Checks that no oscillation of an undamped spring is wider than the first.
fn swing(subject: &Subject, length: f64, stiff: f64, out: &mut Outcome) -> Result<(), String> {
    let scene = sprung(length, stiff, 0.0, 0.0);
    let mut engine = subject.build(&scene)?;
    let mut widest = 0.0;
    for _ in 0..TICKS {
        engine.tick();
        let stretch = (engine.state(0).position.length() - length).abs();
        widest = largest([widest, stretch].into_iter());
    }
    let variant = format!("length {length}, undamped, w h = {stiff}");
    out.check(&variant, "widest swing, of the first", 1.01, widest);
    Ok(())
}

/// Checks that a body on a critically damped spring under gravity moves directly to equilibrium.
fn settle(subject: &Subject, length: f64, stiff: f64, out: &mut Outcome) -> Result<(), String> {
    let scene = sprung(length, stiff, 1.0, 10.0);
    let rest = -length - 10.0 / scene.springs[0].stiffness;
    let mut engine = subject.build(&scene)?;
    let (mut last, mut passed) = (engine.state(0).position.y - rest, 0.0);
    // If gravity stretches the spring further than it was initially stretched, all signs are reversed.
    let side = if last > 0.0 { -1.0 } else { 1.0 };
    for _ in 0..TICKS {
        engine.tick();
        let now = engine.state(0).position.y - rest;
        passed = largest([passed, side * now, side * (last - now)].into_iter());
        last = now;
    }
    let variant = format!("length {length}, critically damped, w h = {stiff}");
    out.check(&variant, "way beyond the rest point, or back, units", 1e-4, passed);
    out.check(&variant, "distance from the rest point, units", 1e-4, last.abs());
    Ok(())
}
