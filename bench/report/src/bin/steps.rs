//! Steps a bare world under callgrind for the report: `steps SOLVER SCENE STEPS [WAY FEATURE]`. Prints the world's
//! hash.
//!
//! A bare world has only boxes or circles, without friction, bounces or particles; `strangers` are boxes that do not
//! collide. If WAY is `named`, the plan names a feature that no body has; if it is `one`, a single body has the
//! feature.

use jostle_sim::{
    BodyDef, Conjugate, Drag, EmitterDef, ForceSettings, GROUPS_MAX, Motion, Recipe, Relaxation,
    Rng, Shape, Solver, Source, Vec2, World, WorldSettings,
};
use std::process::ExitCode;

const USAGE: &str =
    "usage: steps relaxation|conjugate boxes|circles|strangers STEPS [named|one FEATURE]";
const COLUMNS: u32 = 10;
const ROWS: u32 = 8;
const CELL: f32 = 8.0;
/// Fast enough for continuous collision: many times the size of a body per step.
const FAST: f32 = 2000.0;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let hash = match words[..] {
        [solver, scene, steps] => Bare::new(solver, scene).and_then(|bare| bare.step(steps)),
        [solver, scene, steps, way, feature] => Bare::new(solver, scene)
            .and_then(|bare| if way == "one" { bare.one(feature) } else { bare.named(feature) })
            .and_then(|bare| bare.step(steps)),
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

/// The description of a bare world.
struct Bare {
    settings: WorldSettings,
    shape: fn(Vec2) -> Shape,
    /// The first falling body, except for its position.
    first: BodyDef,
    /// The first body's shape, if it differs from that of the others.
    first_shape: Option<fn(Vec2) -> Shape>,
    /// Motion of the first slab or peg.
    peg: Motion,
}

fn slab(half: Vec2) -> Shape {
    Shape::Box { half }
}

fn disc(half: Vec2) -> Shape {
    Shape::circle(half.x)
}

fn bare() -> BodyDef {
    BodyDef { friction: 0.0, restitution: 0.0, ..BodyDef::default() }
}

impl Bare {
    fn new(solver: &str, scene: &str) -> Option<Bare> {
        let solver = match solver {
            "relaxation" => Solver::Relaxation(Relaxation::default()),
            "conjugate" => Solver::Conjugate(Conjugate::default()),
            _ => return None,
        };
        let mut settings = WorldSettings { solver: Some(solver), ..WorldSettings::default() };
        let shape: fn(Vec2) -> Shape = match scene {
            "boxes" => slab,
            "circles" => disc,
            "strangers" => {
                settings.meets = [0; GROUPS_MAX];
                slab
            }
            _ => return None,
        };
        Some(Bare { settings, shape, first: bare(), first_shape: None, peg: Motion::Static })
    }

    /// Makes the plan name a feature that no body has.
    fn named(mut self, feature: &str) -> Option<Bare> {
        let features = &mut self.settings.features;
        *match feature {
            "friction" => &mut features.friction,
            "restitution" => &mut features.restitution,
            "circles" => &mut features.circles,
            "boxes" => &mut features.boxes,
            "particles" => &mut features.particles,
            _ => return None,
        } = true;
        Some(self)
    }

    /// Gives a feature to one body, or to the world if bodies cannot have it.
    fn one(mut self, feature: &str) -> Option<Bare> {
        match feature {
            "friction" => self.first.friction = 0.5,
            "restitution" => self.first.restitution = 0.5,
            "circles" => self.first_shape = Some(disc),
            "boxes" => self.first_shape = Some(slab),
            "particles" => {
                self.settings.particles_max = 64;
                self.settings.recipes = vec![Recipe::default()];
            }
            "forces" => {
                self.first.drag = Drag { linear: 0.1, ..Drag::NONE };
                self.settings.forces = Some(ForceSettings::default());
            }
            "sleeping" => self.settings.sleeping = true,
            "kinematic" => self.peg = Motion::Kinematic,
            "continuous" => self.first.velocity = Vec2::new(0.0, -FAST),
            "touches" => {
                self.first.group = 1;
                (self.settings.meets[0], self.settings.meets[1]) = (1 << 1, 1 << 0);
            }
            _ => return None,
        }
        Some(self)
    }

    /// Builds the world, steps it, and returns its hash.
    fn step(self, steps: &str) -> Option<String> {
        let mut world = World::new(self.settings.clone());
        self.fill(&mut world);
        if !self.settings.recipes.is_empty() {
            let source = Source::Point(Vec2::splat(4.0 * CELL));
            world.start_emitter(EmitterDef { recipe: 0, count: 60, seed: 1, source });
        }
        for _ in 0..steps.parse().ok()? {
            world.step();
            world.step_particles();
        }
        Some(format!("{:016x}", world.hash()))
    }

    /// Adds a floor and two walls, made of slabs or pegs, and bodies that rain down on them.
    fn fill(&self, world: &mut World) {
        let (outside, far) = (-0.5 * CELL, (COLUMNS as f32 + 0.5) * CELL);
        let mut motion = self.peg;
        for peg in 0..COLUMNS + 2 {
            let along = (peg as f32 - 0.5) * CELL;
            for position in [(along, outside), (outside, along), (far, along)] {
                let shape = (self.shape)(Vec2::splat(0.5 * CELL));
                world.add(&BodyDef { shape, position: position.into(), motion, ..bare() });
                motion = Motion::Static;
            }
        }
        let mut rng = Rng::new(7, 1);
        let mut first_shape = self.first_shape;
        let mut def = self.first;
        for body in 0..COLUMNS * ROWS {
            let cell = Vec2::new((body % COLUMNS) as f32 + 0.5, (body / COLUMNS) as f32 + 0.6);
            let half = Vec2::new(rng.range(1.0, 3.5), rng.range(1.0, 3.5));
            let jitter = Vec2::new(rng.range(-0.4, 0.4), rng.range(-0.4, 0.4));
            let (shape, position) =
                (first_shape.take().unwrap_or(self.shape)(half), cell * CELL + jitter);
            world.add(&BodyDef { shape, position, mass: half.x * half.y, ..def });
            def = bare();
        }
    }
}
