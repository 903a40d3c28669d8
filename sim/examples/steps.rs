//! A bare world to be stepped and counted by callgrind, for the report: `steps SOLVER SCENE STEPS [FEATURE]`,
//! with a plan that names a feature (or `all`) that no body has. It prints the world's hash.
//!
//! A bare world has boxes or circles and nothing else: no friction, no bounces, no particles; strangers are
//! boxes none of which meets another. Built with a feature's name in `JOSTLE_LEAVE_OUT` the program can not
//! do it at all.

#![expect(
    clippy::disallowed_methods,
    reason = "a tool beside the simulation: it reads its arguments"
)]

use jostle_sim::conjugate::Conjugate;
use jostle_sim::math::Rng;
use jostle_sim::relaxation::Relaxation;
use jostle_sim::world::{GROUPS_MAX, WorldSettings};
use jostle_sim::{BodyDef, Features, Motion, Shape, Solver, Vec2, World};
use std::process::ExitCode;

const USAGE: &str = "usage: steps relaxation|conjugate boxes|circles|strangers STEPS [FEATURE]";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let hash = match words[..] {
        [solver, scene, steps] => step(solver, scene, steps, WorldSettings::default()),
        [solver, scene, steps, name] => {
            named(name).and_then(|settings| step(solver, scene, steps, settings))
        }
        _ => None,
    };
    match hash {
        Some(hash) => {
            println!("{hash}");
            ExitCode::SUCCESS
        }
        None => {
            eprintln!("{USAGE}");
            ExitCode::FAILURE
        }
    }
}

/// Settings that name one feature, or all that a plan names.
fn named(name: &str) -> Option<WorldSettings> {
    let (none, bare) = (Features::NONE, WorldSettings::default());
    let features = match name {
        "all" => Features::ALL,
        "friction" => Features { friction: true, ..none },
        "restitution" => Features { restitution: true, ..none },
        "circles" => Features { circles: true, ..none },
        "boxes" => Features { boxes: true, ..none },
        "particles" => Features { particles: true, ..none },
        _ => return None,
    };
    Some(WorldSettings { features, ..bare })
}

/// Steps a bare world; its hash.
fn step(solver: &str, scene: &str, steps: &str, named: WorldSettings) -> Option<String> {
    let solver = match solver {
        "relaxation" => Solver::Relaxation(Relaxation::default()),
        "conjugate" => Solver::Conjugate(Conjugate::default()),
        _ => return None,
    };
    let shape = match scene {
        "boxes" | "strangers" => |half: Vec2| Shape::Box { half },
        "circles" => |half: Vec2| Shape::circle(half.x),
        _ => return None,
    };
    let meets = if scene == "strangers" { [0; GROUPS_MAX] } else { named.meets };
    let settings = WorldSettings { solver: Some(solver), meets, ..named };
    let mut world = World::new(settings);
    fill(&mut world, shape);
    for _ in 0..steps.parse().ok()? {
        world.step();
        world.step_particles();
    }
    Some(format!("{:016x}", world.hash()))
}

const COLUMNS: u32 = 10;
const ROWS: u32 = 8;
const CELL: f32 = 8.0;

/// A floor and two walls of slabs or pegs, and a rain of bodies over it.
fn fill(world: &mut World, shape: fn(Vec2) -> Shape) {
    let bare = BodyDef { friction: 0.0, restitution: 0.0, ..BodyDef::default() };
    let fixed = BodyDef { motion: Motion::Static, ..bare };
    let (outside, far) = (-0.5 * CELL, (COLUMNS as f32 + 0.5) * CELL);
    for peg in 0..COLUMNS + 2 {
        let along = (peg as f32 - 0.5) * CELL;
        for place in [(along, outside), (outside, along), (far, along)] {
            let shape = shape(Vec2::splat(0.5 * CELL));
            world.add(&BodyDef { shape, position: place.into(), ..fixed });
        }
    }
    let mut rng = Rng::new(7, 1);
    for body in 0..COLUMNS * ROWS {
        let cell = Vec2::new((body % COLUMNS) as f32 + 0.5, (body / COLUMNS) as f32 + 0.6);
        let half = Vec2::new(rng.range(1.0, 3.5), rng.range(1.0, 3.5));
        let jitter = Vec2::new(rng.range(-0.4, 0.4), rng.range(-0.4, 0.4));
        let (shape, position) = (shape(half), cell * CELL + jitter);
        world.add(&BodyDef { shape, position, mass: half.x * half.y, ..bare });
    }
}
