//! Cases that no scene should contain but some player will create: bodies inside each other, absurd sizes, positions
//! and speeds, and closing walls.

use super::watch::{Run, largest};
use super::{Case, Outcome, SLOP, Subject, outcome};
use crate::engine::Engine;
use crate::methods::Family;
use crate::scene::{Body, Mulberry, Scene, Shape};
use glam::DVec2;
use std::panic::{AssertUnwindSafe, catch_unwind};

const GRAVITY: f64 = 10.0;

pub const CASES: [Case; 7] = [
    Case { id: "S10", title: "Bodies deep in each other", run: heaps },
    Case { id: "S11", title: "Impossible bodies", run: impossible },
    Case { id: "S12", title: "Bullets against walls and bullets", run: bullets },
    Case { id: "S13", title: "Crusher: walls close to half the room, then open", run: crusher },
    Case { id: "S17", title: "Stack of 10 far from the origin", run: far },
    Case { id: "S18", title: "Sizes from 1 mm to 100 m", run: sizes },
    Case { id: "S23", title: "Spawn storm, then every second body vanishes", run: storm },
];

fn heaps(subject: &Subject) -> Outcome {
    outcome(|out| {
        for (name, shape) in
            [("boxes", Shape::rect(0.5, 0.5)), ("circles", Shape::Circle { radius: 0.5 })]
        {
            for count in [2, 100] {
                let mut scene = Scene::new(0.0);
                (0..count).for_each(|_| {
                    scene.add(Body::new(shape, 0.0, 0.0));
                });
                let run = subject.watch(&scene, 5.0)?;
                let variant = format!("{count} {name} at one point");
                parted(out, &variant, &run);
                let center =
                    scene.dynamic().map(|body| run.shift(body)).sum::<DVec2>() / f64::from(count);
                out.check(&variant, "shift of the common centre, units", 1e-5, center.length());
                out.check(&variant, "rms speed at the end, units/s", 0.01, run.jitter());
                if count == 100 {
                    out.draw(&variant, &run);
                }
            }
        }
        for share in [0.25, 0.5, 1.0] {
            let mut scene = Scene::new(GRAVITY);
            scene.floor(500.0, 0.3, 0.0);
            for row in 0..10 {
                for k in 0..10 - row {
                    let x = (f64::from(k) - f64::from(9 - row) / 2.0) * 1.1;
                    scene.add(Body::new(
                        Shape::rect(0.5, 0.5),
                        x,
                        0.5 + f64::from(row) * (1.0 - share),
                    ));
                }
            }
            let run = subject.watch(&scene, 5.0)?;
            parted(out, &format!("pyramid, {} % overlap", share * 100.0), &run);
        }
        Ok(())
    })
}

/// Checks the last time the overlap exceeded the slop; up to half as much again counts as rounding.
fn parted(out: &mut Outcome, variant: &str, run: &Run) {
    let deep = run.samples.iter().rev().find(|s| s.overlap > 1.5 * SLOP || s.overlap.is_nan());
    out.check(
        variant,
        "apart (overlap within 1.5 slop) after, s",
        2.0,
        deep.map_or(0.0, |s| s.time_s),
    );
}

/// Adds impossible bodies. Other engines may behave arbitrarily when misused; only Jostle's behaviour is defined.
fn impossible(subject: &Subject) -> Outcome {
    outcome(|out| {
        if subject.method.family != Family::Jostle {
            return Err("misuse is undefined there".into());
        }
        let good = Body::new(Shape::rect(0.5, 0.5), 0.0, 0.5);
        let bad = [
            Body { position: DVec2::NAN, ..good },
            Body { position: DVec2::INFINITY, ..good },
            Body { velocity: DVec2::new(f64::NAN, 0.0), ..good },
            good.of_mass(0.0),
            good.of_mass(f64::INFINITY),
            good.of_mass(1e-45),
            good.of_mass(f64::NAN),
            Body { shape: Shape::rect(0.0, 1.0), ..good },
            Body { shape: Shape::Circle { radius: -1.0 }, ..good },
            Body { shape: Shape::Circle { radius: f64::NAN }, ..good },
        ];
        let mut scene = Scene::new(GRAVITY);
        scene.floor(500.0, 0.3, 0.0);
        (0..5).for_each(|row| {
            scene.add(Body { position: DVec2::new(0.0, 0.55 + 1.1 * f64::from(row)), ..good });
        });
        let (mut pestered, mut left_alone) = (subject.build(&scene)?, subject.build(&scene)?);
        // Refusals are panics, which are expected here and therefore not printed.
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let refused = bad.iter().filter(|body| refuses(pestered.as_mut(), body)).count();
        std::panic::set_hook(hook);
        for _ in 0..300 {
            pestered.tick();
            left_alone.tick();
        }
        let differs = (0..scene.bodies.len()).filter(|&i| pestered.state(i) != left_alone.state(i));
        out.check("", "impossible bodies let in, of 10", 0.0, (bad.len() - refused) as f64);
        out.check("", "neighbours with another bit afterwards", 0.0, differs.count() as f64);
        for size in [1e-6, 1e6] {
            let mut scene = Scene::new(GRAVITY);
            scene.floor(1e7, 0.3, 0.0);
            scene.add(Body::new(Shape::rect(size / 2.0, size / 2.0), 0.0, size / 2.0).of_mass(1.0));
            let run = subject.watch(&scene, 5.0)?;
            let variant = format!("box of {size:e}");
            out.check(&variant, "sinks by, units", SLOP + size * 1e-6, run.loss());
        }
        Ok(())
    })
}

fn refuses(engine: &mut dyn Engine, body: &Body) -> bool {
    catch_unwind(AssertUnwindSafe(|| engine.add(body))).is_err()
}

/// Number of lanes in a volley; their walls form one wall without gaps.
const LANES: u32 = 100;
const LANE: f64 = 4.0;

fn bullets(subject: &Subject) -> Outcome {
    outcome(|out| {
        let volleys = if subject.quick { 20 } else { 2000 };
        for (variant, target) in [
            ("static walls", Target::Static),
            ("moving walls", Target::Moving),
            ("bullet against bullet", Target::Bullet),
        ] {
            let mut passed = 0;
            for volley in 0..volleys {
                passed += shoot(subject, target, volley)?;
            }
            let share = f64::from(passed) / f64::from(volleys * LANES);
            out.check(variant, "share of the shots that pass", 0.0, share);
        }
        Ok(())
    })
}

#[derive(Clone, Copy, PartialEq)]
enum Target {
    Static,
    Moving,
    Bullet,
}

/// Fires one shot per lane, at speeds from 10 to 10^4 and at walls 0.01 to 0.1 thick; returns how many pass through the
/// wall.
fn shoot(subject: &Subject, target: Target, seed: u32) -> Result<u32, String> {
    let mut scene = Scene::new(0.0);
    let mut draws = Mulberry(seed);
    let mut shots = Vec::new();
    for lane in 0..LANES {
        let y = f64::from(lane) * LANE;
        let speed = 10f64.powf(draws.range(1.0, 4.0));
        let thick = 10f64.powf(draws.range(-2.0, -1.0));
        let radius = draws.range(0.05, 0.5);
        let half = Shape::rect(thick / 2.0, LANE / 2.0);
        let away = radius + thick + speed * scene.tick_s * draws.range(0.0, 1.5);
        let wall = Body::new(half, 0.0, y).of_stuff(0.0, 0.0);
        let opposing = Body::new(Shape::Circle { radius }, away, y).of_stuff(0.0, 0.0);
        let target = match target {
            Target::Static => Body::fixed(half, 0.0, y).of_stuff(0.0, 0.0),
            Target::Moving => wall.kinematic().moving(-draws.range(0.0, speed), 0.0),
            Target::Bullet => opposing.moving(-speed, 0.0),
        };
        let bullet = Body::new(Shape::Circle { radius }, -away, y).of_stuff(0.0, 0.0);
        shots.push((scene.add(target), scene.add(bullet.moving(speed, 0.0))));
    }
    let mut engine = subject.build(&scene)?;
    let mut passed = vec![false; shots.len()];
    for _ in 0..4 {
        engine.tick();
        for (&(wall, bullet), passed) in shots.iter().zip(&mut passed) {
            let (wall, bullet) = (engine.state(wall).position.x, engine.state(bullet).position.x);
            *passed |= bullet > wall || !bullet.is_finite();
        }
    }
    Ok(passed.into_iter().filter(|passed| *passed).count() as u32)
}

fn crusher(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut scene = Scene::new(GRAVITY);
        scene.contain(20.0, 20.0, 0.3, 0.0);
        let press = scene.add(Body::fixed(Shape::rect(10.0, 30.0), -10.0, 10.0).kinematic());
        for i in 0..500 {
            let (x, y) = (0.5 + f64::from(i % 24) * 0.82, 0.5 + f64::from(i / 24) * 0.88);
            scene.add(Body::new(Shape::Circle { radius: 0.39 }, x, y));
        }
        let mut engine = subject.build(&scene)?;
        // The wall moves in for four seconds, rests for one and moves back for four, which leaves one and a half to
        // recover.
        let run = Run::record(engine.as_mut(), &scene, 10.5, |engine, time_s| {
            let speed = match time_s {
                t if t < 4.0 => 2.5,
                t if t < 5.0 => 0.0,
                t if t < 9.0 => -2.5,
                _ => 0.0,
            };
            engine.set_velocity(press, DVec2::new(speed, 0.0));
        });
        let outside = scene.dynamic().filter(|&body| {
            let position = run.last[body].position;
            !(position.x > -0.5 && position.x < 20.5 && position.y > -0.5 && position.y < 20.5)
        });
        out.check("", "bodies outside, of 500", 0.0, outside.count() as f64);
        out.check("", "overlap one second after release, units", SLOP, run.deepest_after(10.0));
        out.draw("", &run);
        Ok(())
    })
}

fn far(subject: &Subject) -> Outcome {
    outcome(|out| {
        for away in [1e3, 1e4, 1e5, 1e6] {
            let mut scene = Scene::new(GRAVITY);
            scene.add(Body::fixed(Shape::rect(500.0, 10.0), away, away - 10.0));
            (0..10).for_each(|row| {
                scene.add(Body::new(Shape::rect(0.5, 0.5), away, away + 0.5 + f64::from(row)));
            });
            let ulp = away * 2f64.powi(-23);
            let run = subject.watch(&scene, 20.0)?;
            let variant = format!("at {} km", away / 1000.0);
            out.check(&variant, "deepest overlap, units", SLOP + 4.0 * ulp, run.deepest());
            out.check(&variant, "sideways drift, units", SLOP + 4.0 * ulp, {
                largest(scene.dynamic().map(|body| run.shift(body).x.abs()))
            });
        }
        Ok(())
    })
}

fn sizes(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut scene = Scene::new(GRAVITY);
        scene.floor(1000.0, 0.3, 0.0);
        scene.add(Body::new(Shape::rect(50.0, 50.0), 200.0, 50.0));
        scene.add(Body::new(Shape::rect(0.0005, 0.0005), -100.0, 0.0005));
        scene.add(Body::new(Shape::Circle { radius: 0.0005 }, 200.0, 100.0005));
        let run = subject.watch(&scene, 10.0)?;
        let sinks = |body: usize| -run.shift(body).y;
        out.check("box of 100 m", "sinks by, units", SLOP, sinks(1));
        out.check("box of 1 mm", "sinks by, share of its size", 0.02, sinks(2) / 0.001);
        out.check("circle of 1 mm on 100 m", "sinks by, share of its size", 0.02, sinks(3) / 0.001);
        let mut scene = Scene::new(GRAVITY);
        scene.floor(100.0, 0.3, 0.0);
        for row in 0..30 {
            for k in 0..30 - row {
                let x = (f64::from(k) - f64::from(29 - row) / 2.0) * 0.055;
                scene.add(Body::new(Shape::rect(0.025, 0.025), x, 0.025 + 0.05 * f64::from(row)));
            }
        }
        let run = subject.watch(&scene, 10.0)?;
        let variant = "pyramid of 30, boxes of 5 cm";
        out.check(variant, "settled after, s", 4.0, run.settled_s());
        out.check(variant, "deepest overlap, units", 0.001, run.deepest());
        out.draw(variant, &run);
        Ok(())
    })
}

fn storm(subject: &Subject) -> Outcome {
    outcome(|out| {
        let count = if subject.quick { 1000 } else { 5000 };
        let columns = f64::sqrt(f64::from(count) * 2.0).ceil();
        let mut scene = Scene::new(GRAVITY);
        scene.contain(columns * 1.2, columns * 1.2, 0.3, 0.0);
        for i in 0..count {
            let (column, row) = (f64::from(i) % columns, (f64::from(i) / columns).floor());
            let shape =
                if i % 2 == 0 { Shape::rect(0.5, 0.5) } else { Shape::Circle { radius: 0.5 } };
            scene.add(Body::new(shape, 1.0 + column * 0.9, 1.0 + row * 0.5));
        }
        let mut engine = subject.build(&scene)?;
        let (first, mut fastest) = (scene.bodies.len() - count as usize, 0.0);
        let mut run_on = |engine: &mut dyn Engine, ticks: u32| {
            for _ in 0..ticks {
                engine.tick();
                let speeds = scene.dynamic().map(|body| engine.state(body).velocity.length());
                fastest =
                    largest([fastest, largest(speeds.filter(|speed| !speed.is_nan()))].into_iter());
            }
        };
        run_on(engine.as_mut(), 300);
        let lost = scene.dynamic().filter(|&body| !engine.state(body).position.is_finite()).count();
        let kept: Vec<usize> = (first..scene.bodies.len()).step_by(2).collect();
        (first + 1..scene.bodies.len()).step_by(2).for_each(|body| engine.remove(body));
        (0..300).for_each(|_| engine.tick());
        let states: Vec<_> =
            (0..first).chain(kept).map(|body| (scene.bodies[body], engine.state(body))).collect();
        let (bodies, states): (Vec<_>, Vec<_>) = states.into_iter().unzip();
        let inside = |p: DVec2| {
            p.x > -0.5 && p.y > -0.5 && p.x < columns * 1.2 + 0.5 && p.y < columns * 1.2 + 0.5
        };
        let outside = states[first..].iter().filter(|state| !inside(state.position)).count();
        let variant = format!("{count} bodies");
        out.check(&variant, "bodies lost or not finite", 0.0, lost as f64);
        out.check(&variant, "bodies outside at the end", 0.0, outside as f64);
        out.check(&variant, "deepest overlap 5 s after the removal, units", 2.0 * SLOP, {
            crate::shape::deepest_overlap(&bodies, &states)
        });
        Ok(())
    })
}
