//! Particles, their recipes and emitters. The same code runs on the server and, from emitter
//! events, on every client, so particles cost no bytes each on the wire.

use crate::math::Rng;
use crate::shape::Shape;
use crate::world::BodyId;
use glam::Vec2;

/// What the particles of a recipe are like; ranges are drawn per particle. Chapter row A3.18.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Name in the scene file.
    pub name: String,
    /// Life in whole ticks, low..=high, at least 1.
    pub life_ticks: [u16; 2],
    /// RGBA at birth; components may exceed 1.
    pub color_start: [f32; 4],
    /// RGBA at the end of life, low and high; components may exceed 1.
    pub color_end: [[f32; 4]; 2],
    /// Width at birth in world units, low and high.
    pub size: [f32; 2],
    /// Factor on the size every tick; 1 keeps it.
    pub size_factor: f32,
    /// Velocity at birth, low and high corner, units/s.
    pub velocity: [Vec2; 2],
    /// Acceleration, units/s^2.
    pub acceleration: Vec2,
    /// Factor on the velocity per tick of 1/60 s.
    pub drag: f32,
}

/// Where an emitter makes its particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// A fixed place.
    Point(Vec2),
    /// The centre of a body, followed until the body is gone.
    Body(BodyId),
}

/// An emitter as it is started and as it travels in an event: everything that its particles depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterDef {
    /// Index into the scene's recipes.
    pub recipe: u8,
    /// Particles to make in all; the emitter makes exactly so many.
    pub count: u16,
    /// Seed of all that is random about them.
    pub seed: u32,
    /// Place, or body to follow.
    pub source: Source,
}

/// A placed shape that particles are pushed out of. Centres are the quantised ones that clients see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Outline.
    pub shape: Shape,
    /// Centre in world units, a multiple of the scene's quantum.
    pub center: Vec2,
}

/// All live particles and emitters of a world, as structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    /// Positions, world units.
    position: Vec<Vec2>,
    _rest: Option<Rng>,
}

/// What one particle looks like now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// RGBA tint, components may exceed 1.
    pub color: [f32; 4],
    /// Width and height in world units.
    pub size: f32,
}

impl Particles {
    /// No particles; at most `limit` live at a time (emitters past it lose what does not fit).
    pub fn new(recipes: Vec<Recipe>, limit: usize) -> Particles {
        let _ = (recipes, limit);
        todo!()
    }

    /// Adds an emitter; it makes its first particles in the coming `step`.
    pub fn start(&mut self, emitter: EmitterDef) {
        let _ = emitter;
        todo!()
    }

    /// One tick: particles move and are pushed out of obstacles, expired ones go, then emitters emit.
    ///
    /// `locate` gives the quantised centre of a followed body, or `None` once it is gone (the
    /// emitter then stays where it was last).
    pub fn step(&mut self, obstacles: &[Obstacle], locate: impl Fn(BodyId) -> Option<Vec2>) {
        let _ = (obstacles, &locate);
        todo!()
    }

    /// Live particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether no particle lives.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Running emitters.
    pub fn emitter_count(&self) -> usize {
        todo!()
    }

    /// Positions of all live particles, world units.
    pub fn positions(&self) -> &[Vec2] {
        &self.position
    }

    /// Velocities of all live particles, units/s.
    pub fn velocities(&self) -> &[Vec2] {
        todo!()
    }

    /// Colour and size of particle `index` now (derived from its age and its own seed).
    pub fn look(&self, index: usize) -> Look {
        let _ = index;
        todo!()
    }
}
