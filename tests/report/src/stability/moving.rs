//! Cases in which what moves must go on moving as it should.

use super::watch::largest;
use super::{Case, Outcome, Subject, outcome};
use crate::scene::{Body, Scene, Shape};
use glam::DVec2;

pub const CASES: [Case; 2] = [
    Case { id: "S15", title: "Newton's cradle of five, e = 1", run: cradle },
    Case { id: "S16", title: "Sliding over 1000 flush tiles without friction", run: tiles },
];

const SPEED: f64 = 20.0;

/// Five balls between two walls that throw them back, the first one thrown.
fn row(gap: f64, reversed: bool) -> Scene {
    let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
    let mut balls: Vec<Body> = (0..5)
        .map(|i| {
            let x = if i == 0 { -4.0 } else { f64::from(i) * (1.0 + gap) };
            let ball = Body::new(Shape::Circle { radius: 0.5 }, x, 0.0).of_stuff(0.0, 1.0);
            if i == 0 { ball.moving(SPEED, 0.0) } else { ball }
        })
        .collect();
    if reversed {
        balls.reverse();
    }
    for ball in balls {
        scene.add(ball);
    }
    scene
}

/// Steps until the last ball has left the row.
fn cradle(subject: &Subject) -> Outcome {
    outcome(|out| {
        for (gap, reversed) in [(0.0, false), (0.0, true), (0.001, false), (0.001, true)] {
            let scene = row(gap, reversed);
            let mut engine = subject.build(&scene)?;
            (0..30).for_each(|_| engine.tick());
            let speed = |i: usize| engine.state(if reversed { 4 - i } else { i }).velocity;
            let order = if reversed { "last to first" } else { "first to last" };
            let variant = format!("gap {gap}, bodies {order}");
            let others = largest((0..4).map(|i| speed(i).length() / SPEED));
            out.check(
                &variant,
                "error of the last ball's speed",
                1e-3,
                (speed(4).x / SPEED - 1.0).abs(),
            );
            out.check(&variant, "speed left in the others", 1e-3, others);
        }
        let energy = thousand_hits(subject)?;
        out.check("1000 hits between walls", "relative energy error", 1e-5, energy);
        Ok(())
    })
}

/// The row between two walls for about 10^3 hits.
fn thousand_hits(subject: &Subject) -> Result<f64, String> {
    let mut scene = row(0.001, false);
    for x in [-10.0, 10.0] {
        scene.add(Body::fixed(Shape::rect(1.0, 5.0), x, 0.0).of_stuff(0.0, 1.0));
    }
    let run = subject.watch(&scene, 80.0)?;
    let (first, last) = (run.samples[0].energy, run.samples[run.samples.len() - 1].energy);
    Ok((last / first - 1.0).abs())
}

fn tiles(subject: &Subject) -> Outcome {
    outcome(|out| {
        let slider = [("box", Shape::rect(0.5, 0.5)), ("circle", Shape::Circle { radius: 0.5 })];
        for (name, shape) in slider {
            for speed in [0.1, 1.0, 10.0, 50.0] {
                for upright in [false, true] {
                    let (lifted, lost) = slide(subject, shape, speed, upright)?;
                    let on = if upright { "wall" } else { "floor" };
                    let variant = format!("{name} at {speed} along a {on}");
                    out.check(&variant, "speed off the tiles, units/s", 1e-4, lifted);
                    out.check(&variant, "share of the speed lost", 1e-5, lost);
                }
            }
        }
        Ok(())
    })
}

/// Largest speed away from the tiles after a tenth of a second, and the share of speed lost.
fn slide(subject: &Subject, shape: Shape, speed: f64, upright: bool) -> Result<(f64, f64), String> {
    let turn = |along: f64, off: f64| {
        if upright { DVec2::new(off, along) } else { DVec2::new(along, off) }
    };
    let mut scene = Scene::new(0.0);
    scene.gravity = turn(0.0, -10.0);
    for tile in 0..1000 {
        let at = turn(f64::from(tile), -0.5);
        scene.add(Body::fixed(Shape::rect(0.5, 0.5), at.x, at.y).of_stuff(0.0, 0.0));
    }
    let (start, velocity) = (turn(3.25, 0.5), turn(speed, 0.0));
    let body = Body::new(shape, start.x, start.y).moving(velocity.x, velocity.y);
    let body = scene.add(body.of_stuff(0.0, 0.0));
    let mut engine = subject.build(&scene)?;
    let mut lifted = 0.0;
    // As far as the tiles reach, and at most 20 s.
    let ticks = (990.0 / speed * 60.0).min(1200.0) as u32;
    for tick in 0..ticks {
        engine.tick();
        let off = engine.state(body).velocity.dot(turn(0.0, 1.0));
        lifted = largest([lifted, if tick < 6 { 0.0 } else { off.abs() }].into_iter());
    }
    let left = engine.state(body).velocity.dot(turn(1.0, 0.0));
    Ok((lifted, (left / speed - 1.0).abs()))
}
