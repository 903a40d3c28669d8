//! Cases in which moving bodies must keep moving correctly.

use super::watch::largest;
use super::{Case, Outcome, Subject, outcome};
use crate::engine::Engine;
use crate::scene::{Body, Mulberry, Scene, Shape};
use glam::DVec2;

pub const CASES: [Case; 5] = [
    Case { id: "S14", title: "Stacks that bounce, e = 0.9 and 1", run: bouncing },
    Case { id: "S15", title: "Newton's cradle of five, e = 1", run: cradle },
    Case { id: "S16", title: "Sliding over 1000 flush tiles without friction", run: tiles },
    Case { id: "S19", title: "Gas of 625 discs, e = 1", run: gas },
    Case { id: "S24", title: "Platform with a stack of 5, friction 0.6", run: platform },
];

const SPEED: f64 = 20.0;

/// Five balls between two elastic walls; the first one is thrown.
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

/// Newton's cradle, stepped until the last ball has left the row.
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

/// Plays the row between two walls for about 10^3 collisions.
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

/// Returns the largest speed away from the tiles after a tenth of a second, and the share of speed lost.
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
    // Long enough to reach the end of the tiles, but at most 20 s.
    let ticks = (990.0 / speed * 60.0).min(1200.0) as u32;
    for tick in 0..ticks {
        engine.tick();
        let off = engine.state(body).velocity.dot(turn(0.0, 1.0));
        lifted = largest([lifted, if tick < 6 { 0.0 } else { off.abs() }].into_iter());
    }
    let left = engine.state(body).velocity.dot(turn(1.0, 0.0));
    Ok((lifted, (left / speed - 1.0).abs()))
}

fn bouncing(subject: &Subject) -> Outcome {
    outcome(|out| {
        for (name, shape) in
            [("balls", Shape::Circle { radius: 0.5 }), ("boxes", Shape::rect(0.5, 0.5))]
        {
            for restitution in [0.9, 1.0] {
                let mut scene = Scene::new(10.0);
                scene.floor(50.0, 0.0, restitution);
                for row in 0..10 {
                    let body = Body::new(shape, 0.0, 1.0 + f64::from(row) * 1.5);
                    scene.add(body.of_stuff(0.0, restitution));
                }
                let run = subject.watch(&scene, 20.0)?;
                let variant = format!("10 {name}, e = {restitution}");
                out.check(&variant, "energy gained, share", 1e-3, run.gain(run.samples[0].energy));
                if restitution < 1.0 {
                    out.check(&variant, "rms speed at 18 to 20 s, units/s", 1e-3, run.jitter());
                }
                out.draw(&variant, &run);
            }
        }
        Ok(())
    })
}

fn gas(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut scene = Scene { bounce_threshold: 0.0, ..Scene::new(0.0) };
        scene.contain(100.0, 100.0, 0.0, 1.0);
        let mut draws = Mulberry(19);
        for i in 0..625 {
            let (x, y) = (f64::from(i % 25) * 4.0 + 2.0, f64::from(i / 25) * 4.0 + 2.0);
            let disc = Body::new(Shape::Circle { radius: 1.0 }, x, y).of_stuff(0.0, 1.0);
            scene.add(disc.moving(draws.range(-20.0, 20.0), draws.range(-20.0, 20.0)));
        }
        let mut engine = subject.build(&scene)?;
        let energy = |engine: &dyn Engine| -> f64 {
            scene.dynamic().map(|body| engine.state(body).velocity.length_squared()).sum()
        };
        let start = energy(engine.as_ref());
        let ticks = if subject.quick { 3000 } else { 100_000 };
        (0..ticks).for_each(|_| engine.tick());
        let variant = format!("{ticks} ticks");
        let inside = |body: usize| {
            let place = engine.state(body).position;
            place.x > 0.0 && place.x < 100.0 && place.y > 0.0 && place.y < 100.0
        };
        let outside = scene.dynamic().filter(|&body| !inside(body)).count();
        out.check(
            &variant,
            "relative energy error",
            1e-3,
            (energy(engine.as_ref()) / start - 1.0).abs(),
        );
        out.check(&variant, "discs outside", 0.0, outside as f64);
        Ok(())
    })
}

fn platform(subject: &Subject) -> Outcome {
    outcome(|out| {
        for (name, way) in [("up", DVec2::Y), ("down", DVec2::NEG_Y), ("sideways", DVec2::X)] {
            let mut scene = Scene::new(10.0);
            let lift = Body::fixed(Shape::rect(5.0, 0.5), 0.0, -0.5).of_stuff(0.6, 0.0);
            let lift = scene.add(lift.kinematic());
            for row in 0..5 {
                scene.add(
                    Body::new(Shape::rect(0.5, 0.5), 0.0, 0.5 + f64::from(row)).of_stuff(0.6, 0.0),
                );
            }
            let mut engine = subject.build(&scene)?;
            let mut hop = 0f64;
            let mut place = DVec2::ZERO;
            for tick in 0..600 {
                // Accelerates by 3 units/s^2 up to 10 units/s; a friction of 0.6 could withstand twice as much.
                let speed = (f64::from(tick) * scene.tick_s * 3.0).min(10.0);
                engine.set_velocity(lift, way * speed);
                engine.tick();
                let offset = engine.state(1).position - engine.state(lift).position;
                hop = largest([hop, offset.y - 1.0].into_iter());
                if tick == 299 {
                    place = offset;
                }
            }
            let offset = engine.state(1).position - engine.state(lift).position;
            out.check(name, "slip on the platform, units/s", 0.005, (offset - place).x.abs() / 5.0);
            out.check(name, "hop off the platform, units", 0.005, hop);
        }
        Ok(())
    })
}
