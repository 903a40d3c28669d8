//! What features cost, for the report: `costs step SOLVER SCENE STEPS [FEATURE]` steps a bare world,
//! to be counted by callgrind, with a plan that names a feature (or `all`) that no body has; `costs bytes` prints what games send a tick, as CSV.
//!
//! A bare world has boxes or circles and nothing else: no friction, no bounces, no particles; strangers are
//! boxes none of which meets another. Built
//! with a feature's name in `JOSTLE_LEAVE_OUT` the program can not do it at all.

#![expect(clippy::disallowed_methods, reason = "a tool beside the room: it reads its arguments")]

use jostle_protocol::Appearance;
use jostle_room::{Rate, Room};
use jostle_sim::conjugate::Conjugate;
use jostle_sim::math::Rng;
use jostle_sim::relaxation::Relaxation;
use jostle_sim::scene::{Part, Plan};
use jostle_sim::world::{GROUPS_MAX, WorldSettings};
use jostle_sim::{
    BodyDef, Buttons, Features, ForceSettings, Input, Motion, Scene, Seat, Shape, Solver, Vec2,
    World,
};
use std::process::ExitCode;
use std::sync::Arc;

const USAGE: &str = "usage: costs step relaxation|conjugate boxes|circles|strangers STEPS [FEATURE] | costs \
                     bytes";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["step", solver, scene, steps] => step(solver, scene, steps, WorldSettings::default()),
        ["step", solver, scene, steps, name] => {
            named(name).and_then(|settings| step(solver, scene, steps, settings))
        }
        ["bytes"] => bytes(),
        _ => None,
    };
    match done {
        Some(said) => {
            println!("{said}");
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
        "forces" => {
            return Some(WorldSettings {
                forces: Some(ForceSettings { wind: Vec2::ZERO, springs_max: 0 }),
                ..bare
            });
        }
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

const TICKS: u32 = 600;
/// A hero on a floor; what is compared comes after it.
const FLOOR: &str = r#"
title = "Floor"
size = [200, 112.5]
groups = ["hero", "platform", "pack", "dumb"]
pairs = [["hero", "platform"], ["dumb", "platform"], ["dumb", "dumb"]]
hero = { spawns = [[40, 20]] }
"#;
const GROUND: &str = "[[bodies]]\nkind = \"wall\"\nposition = [100, -5]\nsize = [400, 20]\n";

/// A feature on the wire: what a scene says to have it, and what is pressed to use it.
struct Sent {
    name: &'static str,
    top: &'static str,
    bodies: &'static str,
    /// The tick's buttons of the one player.
    pressed: Buttons,
    /// Whether it works by itself: then it can not be there and unused.
    by_itself: bool,
}

const SENT: [Sent; 5] = [
    Sent {
        name: "particles",
        top: "tools = [\"spray\"]",
        bodies: "",
        pressed: Buttons::MAKE,
        by_itself: false,
    },
    Sent {
        name: "packs",
        top: "tools = [\"launch\"]",
        bodies: "",
        pressed: Buttons::FIRE,
        by_itself: false,
    },
    Sent {
        name: "made bodies, impacts",
        top: "tools = [\"dumb\"]",
        bodies: "",
        pressed: Buttons::MAKE,
        by_itself: false,
    },
    Sent {
        name: "emitters",
        top: "",
        bodies: "[[emitters]]\nrecipe = \"torch\"\nposition = [40, 60]\ncount = 12\nevery = 12\n",
        pressed: Buttons(0),
        by_itself: true,
    },
    Sent {
        name: "kinematic bodies",
        top: "",
        bodies: "[[bodies]]\nkind = \"platform\"\nsize = [24, 3]\npath = [[100, 40], [100, 80]]\nperiod = 10\n",
        pressed: Buttons(0),
        by_itself: true,
    },
];

/// Bytes a tick without a feature, with it unused, and used.
fn bytes() -> Option<String> {
    let mut lines = vec!["feature,lacking,unused,used,draws particles".to_owned()];
    for sent in &SENT {
        let without = played("", "", Buttons(0))?;
        let unused = match sent.by_itself {
            true => String::new(),
            false => format!("{:.3}", played(sent.top, sent.bodies, Buttons(0))?),
        };
        let used = played(sent.top, sent.bodies, sent.pressed)?;
        let particles = u8::from(Plan::of(&scene(sent.top, sent.bodies)?).uses(Part::Particles));
        lines.push(format!("\"{}\",{without:.3},{unused},{used:.3},{particles}", sent.name));
    }
    Some(lines.join("\n"))
}

/// The floor with more in it.
fn scene(top: &str, bodies: &str) -> Option<Scene> {
    let text = format!("{top}\n{FLOOR}\n{GROUND}{bodies}");
    Scene::parse("costs.toml", &text).map_err(|error| eprintln!("{error}")).ok()
}

/// Mean bytes of a tick's snapshot for a player who reads all of them.
fn played(top: &str, bodies: &str, pressed: Buttons) -> Option<f32> {
    let mut room = Room::new("costs", Arc::new(scene(top, bodies)?), 1);
    room.join(Appearance::new("Ann", 0).ok()?, None, 1).ok()?;
    let (reader, _) = room.begin(Rate::Full);
    let mut sum = 0;
    for tick in 1..=TICKS {
        // Up and down again: a tool that acts on a press acts every second time.
        let buttons = if tick % 2 == 0 { pressed } else { Buttons(0) };
        room.input(Seat(0), tick, Input { buttons, pointer: Some(Vec2::new(150.0, 60.0)) });
        room.tick();
        sum += room.message(&reader).map_or(0, |coded| coded.len());
    }
    Some(sum as f32 / TICKS as f32)
}
