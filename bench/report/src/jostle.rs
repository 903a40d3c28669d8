//! Jostle as an [`Engine`]: its World, and its particles as bodies that never collide.

use crate::engine::{Engine, State};
use crate::scene::{Body, Drag, Hook, Motion, Scene, Shape, Spring};
use glam::DVec2;
use jostle_sim::GROUPS_MAX;
use jostle_sim::WorldSettings;
use jostle_sim::{
    Aabb, BodyDef, BodyId, DT, EmitterDef, ForceSettings, Particles, Recipe, Solver, Source,
    SpringEnd, Vec2, World,
};

/// A World with the scene's bodies, stepped `steps` times per tick.
pub struct Jostle {
    world: World,
    ids: Vec<Option<BodyId>>,
    drag: jostle_sim::Drag,
    steps: u32,
    pair_solves: u64,
    body_steps: u64,
}

/// Maximum number of bodies that a case may add to its scene.
const BODIES_SPARE: usize = 8192;

impl Jostle {
    /// Creates a World with the given solver and all bodies of the scene.
    pub fn new(scene: &Scene, steps: u32, solver: Solver) -> Result<Jostle, String> {
        if scene.sleeping && !matches!(solver, Solver::Conjugate(_)) {
            return Err("only the conjugate solver knows who may sleep".into());
        }
        let any = scene.drag != Drag::None || !scene.springs.is_empty();
        let air = ForceSettings {
            wind: scene.wind.as_vec2(),
            springs_max: scene.springs.len(),
            ..ForceSettings::default()
        };
        let settings = WorldSettings {
            dt: step_of(scene, steps),
            gravity: scene.gravity.as_vec2(),
            forces: any.then_some(air),
            solver: Some(solver),
            sleeping: scene.sleeping,
            meets: [if scene.collides { u32::MAX } else { 0 }; GROUPS_MAX],
            kill_zone: Aabb { low: Vec2::splat(-1e9), high: Vec2::splat(1e9) },
            bodies_max: scene.bodies.len() + BODIES_SPARE,
            ..WorldSettings::default()
        };
        let world = World::new(settings);
        let drag = match scene.drag {
            Drag::None => jostle_sim::Drag::NONE,
            Drag::Linear(rate) => jostle_sim::Drag { linear: rate as f32, quadratic: 0.0 },
            Drag::Quadratic(rate) => jostle_sim::Drag { linear: 0.0, quadratic: rate as f32 },
        };
        let ids = Vec::new();
        let mut engine = Jostle { world, ids, drag, steps, pair_solves: 0, body_steps: 0 };
        for body in &scene.bodies {
            engine.add(body);
        }
        for spring in &scene.springs {
            engine.tie(spring);
        }
        Ok(engine)
    }
}

impl Jostle {
    fn tie(&mut self, spring: &Spring) {
        let id = |index: usize| self.ids[index].expect("a scene's bodies have room");
        self.world.add_spring(jostle_sim::Spring {
            body: id(spring.body),
            end: match spring.to {
                Hook::Point(point) => SpringEnd::Point(point.as_vec2()),
                Hook::Body(other) => SpringEnd::Body(id(other)),
            },
            rest_length: spring.length as f32,
            stiffness: spring.stiffness as f32,
            damping: spring.damping as f32,
        });
    }
}

/// Length of one step in seconds, as f32. With one step per tick of 1/60 s it equals the simulation's step bit for bit.
fn step_of(scene: &Scene, steps: u32) -> f32 {
    (scene.tick_s / f64::from(steps)) as f32
}

pub(crate) fn shape_of(shape: Shape) -> jostle_sim::Shape {
    match shape {
        Shape::Circle { radius } => jostle_sim::Shape::circle(radius as f32),
        Shape::Box { half } => jostle_sim::Shape::Box { half: half.as_vec2() },
    }
}

impl Engine for Jostle {
    fn add(&mut self, body: &Body) -> usize {
        let def = BodyDef {
            shape: shape_of(body.shape),
            position: body.position.as_vec2(),
            velocity: body.velocity.as_vec2(),
            motion: match body.motion {
                Motion::Static => jostle_sim::Motion::Static,
                Motion::Kinematic => jostle_sim::Motion::Kinematic,
                Motion::Dynamic => jostle_sim::Motion::Dynamic,
            },
            mass: body.mass as f32,
            restitution: body.restitution as f32,
            friction: body.friction as f32,
            drag: if body.motion == Motion::Dynamic { self.drag } else { jostle_sim::Drag::NONE },
            ..BodyDef::default()
        };
        self.ids.push(self.world.add(&def));
        self.ids.len() - 1
    }

    fn tick(&mut self) {
        for _ in 0..self.steps {
            self.world.step();
            self.pair_solves += self.world.step_counts().solves;
            self.body_steps += self.world.body_count() as u64;
        }
    }

    fn state(&self, body: usize) -> State {
        let lost = State { position: DVec2::NAN, velocity: DVec2::NAN };
        match self.ids[body] {
            Some(id) if self.world.contains(id) => State {
                position: self.world.position(id).as_dvec2(),
                velocity: self.world.velocity(id).as_dvec2(),
            },
            _ => lost,
        }
    }

    fn set_velocity(&mut self, body: usize, velocity: DVec2) {
        if let Some(id) = self.ids[body].filter(|&id| self.world.contains(id)) {
            self.world.set_velocity(id, velocity.as_vec2());
        }
    }

    fn remove(&mut self, body: usize) {
        if let Some(id) = self.ids[body].take() {
            self.world.remove(id);
        }
    }

    fn set_gravity(&mut self, gravity: DVec2) {
        self.world.set_gravity(gravity.as_vec2());
    }

    fn is_asleep(&self, body: usize) -> bool {
        self.ids[body].is_some_and(|id| self.world.contains(id) && self.world.is_asleep(id))
    }

    fn pair_solves(&self) -> Option<u64> {
        Some(self.pair_solves)
    }

    fn body_steps(&self) -> u64 {
        self.body_steps
    }
}

/// Simulates particles instead of bodies, for free flight with linear drag.
///
/// Particles always advance by [`DT`], so taking `steps` per tick is simulated by slowing down time: with velocities
/// divided by n, accelerations by n^2 and the n-th root of the drag factor, n particle steps make one tick of the
/// scene.
pub struct ParticleFlight {
    particles: Particles,
    recipes: Vec<Recipe>,
    /// Initial positions, because emitters create particles at their own position.
    starts: Vec<Vec2>,
    acceleration: Vec2,
    factor: f32,
    steps: u32,
    slower: f64,
    body_steps: u64,
}

impl ParticleFlight {
    /// One particle per body, in the order of the bodies; at most 256.
    pub fn new(scene: &Scene, steps: u32) -> Result<ParticleFlight, String> {
        let rate = match scene.drag {
            Drag::None => return Err("particles take part where there is drag".into()),
            Drag::Linear(rate) => rate,
            Drag::Quadratic(_) => return Err("particles know linear drag only".into()),
        };
        let still = scene.dynamic().count() < scene.bodies.len();
        if !scene.springs.is_empty() || still || scene.wind != DVec2::ZERO {
            return Err("particles know neither springs nor wind nor each other".into());
        }
        let step_s = scene.tick_s / f64::from(steps);
        let slower = step_s / f64::from(DT);
        let mut flight = ParticleFlight {
            particles: Particles::default(),
            recipes: Vec::new(),
            starts: Vec::new(),
            acceleration: (scene.gravity * slower * slower).as_vec2(),
            factor: (-rate * step_s).exp() as f32,
            steps,
            slower,
            body_steps: 0,
        };
        for body in &scene.bodies {
            flight.add(body);
        }
        flight.emit();
        Ok(flight)
    }

    fn emit(&mut self) {
        self.particles = Particles::new(self.recipes.clone(), self.recipes.len());
        for (recipe, &start) in (0u8..).zip(&self.starts) {
            let source = Source::Point(start);
            self.particles.start(EmitterDef { recipe, count: 1, seed: 1, source });
        }
        self.particles.step(&[], |_| None);
    }
}

impl Engine for ParticleFlight {
    fn add(&mut self, body: &Body) -> usize {
        let velocity = (body.velocity * self.slower).as_vec2();
        self.recipes.push(Recipe {
            life_ticks: [u16::MAX, u16::MAX],
            velocity: [velocity, velocity],
            acceleration: self.acceleration,
            drag: self.factor,
            ..Recipe::default()
        });
        self.starts.push(body.position.as_vec2());
        self.starts.len() - 1
    }

    fn tick(&mut self) {
        for _ in 0..self.steps {
            self.particles.step(&[], |_| None);
            self.body_steps += self.particles.len() as u64;
        }
    }

    fn state(&self, body: usize) -> State {
        State {
            position: self.particles.positions()[body].as_dvec2(),
            velocity: self.particles.velocities()[body].as_dvec2() / self.slower,
        }
    }

    fn set_velocity(&mut self, _: usize, _: DVec2) {}

    fn remove(&mut self, _: usize) {}

    fn pair_solves(&self) -> Option<u64> {
        Some(0)
    }

    fn body_steps(&self) -> u64 {
        self.body_steps
    }
}
