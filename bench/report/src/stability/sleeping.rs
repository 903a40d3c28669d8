//! Cases of sleeping and waking: bodies at rest cost nothing, and the result does not change.

use super::watch::{Sample, largest};
use super::{Case, Outcome, SLOP, Subject, outcome};
use crate::engine::Engine;
use crate::scene::{Body, Scene, Shape};
use glam::DVec2;

const GRAVITY: f64 = 10.0;
/// Number of boxes in the stack that is woken.
const FEW: usize = 10;
/// Number of ticks after which the stack should be asleep.
const REST: usize = 120;

pub const CASES: [Case; 1] = [Case { id: "S20", title: "Sleeping and waking", run: sleeping }];

/// A stack of boxes on the ground, which may be kinematic.
fn stack(count: usize, gap: f64, kinematic: bool) -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.sleeping = true;
    let ground = Body::fixed(Shape::rect(500.0, 10.0), 0.0, -10.0);
    scene.add(if kinematic { ground.kinematic() } else { ground });
    for row in 0..count {
        scene.add(block(0.0, 0.5 + row as f64 + gap * (row + 1) as f64));
    }
    scene
}

fn block(x: f64, y: f64) -> Body {
    Body::new(Shape::rect(0.5, 0.5), x, y)
}

fn ticks(engine: &mut dyn Engine, count: usize) {
    (0..count).for_each(|_| engine.tick());
}

fn asleep(engine: &dyn Engine, bodies: std::ops::RangeInclusive<usize>) -> f64 {
    bodies.filter(|&body| engine.is_asleep(body)).count() as f64
}

/// A stack that has come to rest.
fn rested(subject: &Subject, kinematic: bool) -> Result<(Scene, Box<dyn Engine>), String> {
    let scene = stack(FEW, 0.0, kinematic);
    let mut engine = subject.build(&scene)?;
    ticks(engine.as_mut(), REST);
    Ok((scene, engine))
}

fn sleeping(subject: &Subject) -> Outcome {
    outcome(|out| {
        falls_asleep(subject, out)?;
        wakes_by_touch(subject, out)?;
        wakes_by_removal(subject, out)?;
        wakes_by_gravity(subject, out)?;
        wakes_by_a_newcomer(subject, out)?;
        rides_a_lift(subject, out)?;
        moves_as_if_awake(subject, out)
    })
}

fn falls_asleep(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    for count in [FEW, 1000] {
        let mut engine = subject.build(&stack(count, 0.0, false))?;
        let mut when = f64::NAN;
        for tick in 1..=600 {
            engine.tick();
            if asleep(engine.as_ref(), 1..=count) == count as f64 {
                when = f64::from(tick) / 60.0;
                break;
            }
        }
        out.check(&format!("{count} boxes"), "all asleep after, s", 1.0, when);
    }
    Ok(())
}

fn wakes_by_touch(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    let (mut scene, mut engine) = rested(subject, false)?;
    let dropped = block(0.2, FEW as f64 + 1.5);
    let ball = engine.add(&dropped);
    scene.add(dropped);
    let (mut fewest, mut deepest) = (f64::INFINITY, 0.0);
    for tick in 0..120 {
        engine.tick();
        fewest = f64::min(fewest, asleep(engine.as_ref(), 1..=FEW));
        let (sample, _) = Sample::read(engine.as_ref(), &scene, f64::from(tick));
        deepest = largest([deepest, sample.overlap].into_iter());
    }
    let height = (engine.state(ball).position.y - (FEW as f64 + 0.5)).abs();
    out.check("a box falls on it", "bodies that sleep on", 0.0, fewest);
    out.check("a box falls on it", "deepest overlap, units", SLOP, deepest);
    out.check("a box falls on it", "its distance from its place, units", SLOP, height);
    Ok(())
}

fn wakes_by_removal(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    let (_, mut engine) = rested(subject, false)?;
    engine.remove(4);
    engine.tick();
    out.check("a box is removed", "bodies that sleep on", 0.0, asleep(engine.as_ref(), 5..=FEW));
    ticks(engine.as_mut(), REST);
    let hangs = (5..=FEW).map(|body| (engine.state(body).position.y - (body as f64 - 1.5)).abs());
    out.check("a box is removed", "furthest from its place, units", SLOP, largest(hangs));
    Ok(())
}

fn wakes_by_gravity(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    let (_, mut engine) = rested(subject, false)?;
    engine.set_gravity(DVec2::new(0.0, GRAVITY));
    ticks(engine.as_mut(), 60);
    let fall = GRAVITY / 2.0;
    let hangs =
        (1..=FEW).map(|body| (engine.state(body).position.y - (body as f64 - 0.5 + fall)).abs());
    // A delay of one step, or the integrator's error in a step, does not count as hanging in the air.
    out.check("gravity turns up", "furthest from free fall after 1 s, units", 0.2, largest(hangs));
    Ok(())
}

fn wakes_by_a_newcomer(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    let (mut scene, mut engine) = rested(subject, false)?;
    let newcomer = block(0.3, FEW as f64 + 0.4);
    engine.add(&newcomer);
    scene.add(newcomer);
    engine.tick();
    engine.tick();
    let on = asleep(engine.as_ref(), 1..=FEW);
    out.check("a box appears 0.1 deep", "bodies that sleep on", 0.0, on);
    ticks(engine.as_mut(), 120);
    let (sample, _) = Sample::read(engine.as_ref(), &scene, 2.0);
    // Position correction ends at the slop; rounding may leave slightly more.
    out.check("a box appears 0.1 deep", "overlap after 2 s, units", 1.1 * SLOP, sample.overlap);
    Ok(())
}

fn rides_a_lift(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    let (_, mut engine) = rested(subject, true)?;
    out.check("on a lift", "bodies awake", 0.0, FEW as f64 - asleep(engine.as_ref(), 1..=FEW));
    engine.set_velocity(0, DVec2::new(0.0, 2.0));
    ticks(engine.as_mut(), 60);
    let lift = engine.state(0).position.y + 10.0;
    let off =
        (1..=FEW).map(|body| (engine.state(body).position.y - lift - (body as f64 - 0.5)).abs());
    out.check("the lift rises", "furthest from its place, units", SLOP, largest(off));
    Ok(())
}

fn moves_as_if_awake(subject: &Subject, out: &mut Outcome) -> Result<(), String> {
    let scene = stack(FEW, 0.2, false);
    let mut restless = scene.clone();
    restless.sleeping = false;
    let (mut one, mut other) = (subject.build(&scene)?, subject.build(&restless)?);
    let mut apart = 0.0;
    for _ in 0..600 {
        one.tick();
        other.tick();
        if asleep(one.as_ref(), 1..=FEW) > 0.0 {
            break;
        }
        let distance = |body| one.state(body).position.distance(other.state(body).position);
        apart = largest([apart, largest((1..=FEW).map(distance))].into_iter());
    }
    out.check("until it sleeps", "distance from one that never does, units", 0.0, apart);
    Ok(())
}
