//! Cases in which all bodies should come to rest and stay at rest.

use super::{Case, Outcome, SLOP, Subject, outcome};
use crate::scene::{Body, Scene, Shape};
use glam::DVec2;

const GRAVITY: f64 = 10.0;
const SECONDS: f64 = 20.0;

pub const CASES: [Case; 7] = [
    Case { id: "S1", title: "One box and one circle at rest", run: alone },
    Case { id: "S2", title: "Stack of boxes, touching", run: stacks },
    Case { id: "S3", title: "Stack dropped with gaps of 5 cm, e = 0", run: dropped },
    Case {
        id: "S4",
        title: "Stack of 10, every box 0.45 left or right, friction 0.6",
        run: zigzag,
    },
    Case { id: "S5", title: "Heavy box on a light one", run: ratios },
    Case { id: "S8", title: "Pyramid", run: pyramids },
    Case { id: "S22", title: "20 to 1000 steps a second, gravity 0.1 to 1000", run: rates },
];

/// A box of size 1 by 1.
fn block(x: f64, y: f64) -> Body {
    Body::new(Shape::rect(0.5, 0.5), x, y)
}

fn ground(gravity: f64, friction: f64) -> Scene {
    let mut scene = Scene::new(gravity);
    scene.floor(500.0, friction, 0.0);
    scene
}

/// A stack of n boxes with a gap under each one.
fn stack(n: usize, gap: f64, masses: impl Fn(usize) -> f64) -> Scene {
    let mut scene = ground(GRAVITY, 0.3);
    for row in 0..n {
        let y = 0.5 + row as f64 + gap * (row + 1) as f64;
        scene.add(block(0.0, y).of_mass(masses(row)));
    }
    scene
}

fn alone(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut scene = ground(GRAVITY, 0.3);
        scene.add(block(-20.0, 0.5));
        scene.add(Body::new(Shape::Circle { radius: 0.5 }, 20.0, 0.5));
        let mut early = subject.build(&scene)?;
        (0..60).for_each(|_| early.tick());
        let ticks = if subject.quick { 20_000.0 } else { 100_000.0 };
        let run = subject.watch(&scene, ticks * scene.tick_s)?;
        let drift = |body: usize| run.last[body].position.distance(early.state(body).position);
        let variant = format!("{ticks} ticks");
        out.check(&variant, "deepest overlap, units", SLOP, run.deepest());
        out.check(&variant, "rms speed at the end, units/s", 0.0, run.jitter());
        out.check(&variant, "drift after the first second, units", 0.0, drift(1).max(drift(2)));
        Ok(())
    })
}

fn stacks(subject: &Subject) -> Outcome {
    outcome(|out| {
        for n in [10, 20, 50, 100, 1000] {
            let run = subject.watch(&stack(n, 0.0, |_| 1.0), SECONDS)?;
            let variant = format!("{n} boxes");
            out.check(&variant, "height lost, units", SLOP, run.loss());
            out.check(&variant, "deepest overlap, units", SLOP, run.deepest());
            out.check(&variant, "rms speed at the end, units/s", 1e-5, run.jitter());
            out.check(&variant, "settled after, s", 0.1, run.settled_s());
            if n == 100 {
                out.draw(&variant, &run);
            }
        }
        Ok(())
    })
}

fn dropped(subject: &Subject) -> Outcome {
    outcome(|out| {
        let counts: &[usize] = if subject.quick { &[10, 50] } else { &[10, 50, 1000] };
        for &n in counts {
            let run = subject.watch(&stack(n, 0.05, |_| 1.0), SECONDS)?;
            let variant = format!("{n} boxes");
            let free_fall = (2.0 * 0.05 * n as f64 / GRAVITY).sqrt();
            out.check(&variant, "settled after, s", 1.2 * free_fall + 0.1, run.settled_s());
            let rising = run.samples.iter().map(|sample| sample.rising);
            out.check(
                &variant,
                "fastest upward speed, units/s",
                0.01,
                super::watch::largest(rising),
            );
            if n == 50 {
                out.draw(&variant, &run);
            }
        }
        Ok(())
    })
}

fn zigzag(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut scene = ground(GRAVITY, 0.6);
        for row in 0..10 {
            let side = if row % 2 == 0 { -0.225 } else { 0.225 };
            scene.add(block(side, 0.5 + f64::from(row)).of_stuff(0.6, 0.0));
        }
        let run = subject.watch(&scene, 60.0)?;
        let aside = scene.dynamic().map(|body| run.shift(body).x.abs());
        out.check("", "sideways drift in 60 s, units", 1e-3, super::watch::largest(aside));
        out.draw("", &run);
        Ok(())
    })
}

fn ratios(subject: &Subject) -> Outcome {
    outcome(|out| {
        for ratio in [1e1, 1e2, 1e3, 1e4, 1e6] {
            let scene = stack(2, 0.0, |row| if row == 1 { ratio } else { 1.0 });
            let run = subject.watch(&scene, SECONDS)?;
            let variant = format!("{ratio} on 1");
            out.check(&variant, "height lost, units", SLOP, run.loss());
            out.check(&variant, "rms speed at the end, units/s", 1e-5, run.jitter());
            if ratio == 1e3 {
                out.draw(&variant, &run);
            }
        }
        Ok(())
    })
}

/// A pyramid of boxes with a gap next to and under each one.
fn pyramid(base: usize, gap: f64) -> Scene {
    let mut scene = ground(GRAVITY, 0.3);
    for row in 0..base {
        let count = base - row;
        for k in 0..count {
            let x = (k as f64 - (count - 1) as f64 / 2.0) * 1.1;
            scene.add(block(x, 0.5 + row as f64 + gap * (row + 1) as f64));
        }
    }
    scene
}

fn pyramids(subject: &Subject) -> Outcome {
    outcome(|out| {
        let bases: &[usize] = if subject.quick { &[20] } else { &[20, 100] };
        for &base in bases {
            for gap in [0.0, 0.25] {
                let run = subject.watch(&pyramid(base, gap), SECONDS)?;
                let variant = format!("base {base}, gaps {gap}");
                if gap == 0.0 {
                    out.check(&variant, "largest displacement, units", SLOP, run.largest_shift());
                }
                out.check(&variant, "settled after, s", 4.0, run.settled_s());
                out.check(&variant, "rms speed at the end, units/s", 1e-4, run.jitter());
                if gap > 0.0 {
                    out.draw(&variant, &run);
                }
            }
        }
        Ok(())
    })
}

fn rates(subject: &Subject) -> Outcome {
    outcome(|out| {
        for gravity in [0.1, 10.0, 1000.0] {
            let mut worst = 0f64;
            for hertz in [20.0, 60.0, 250.0, 1000.0] {
                let mut scene = stack(5, 0.0, |_| 1.0);
                scene.gravity = DVec2::new(0.0, -gravity);
                scene.tick_s = 1.0 / hertz;
                let run = subject.watch(&scene, 5.0)?;
                worst = super::watch::largest([worst, run.largest_shift()].into_iter());
            }
            let variant = format!("gravity {gravity}");
            out.check(&variant, "largest displacement at rest, units", SLOP, worst);
        }
        Ok(())
    })
}
