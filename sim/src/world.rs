//! The World: bodies as plain vectors by id, their contacts, particles, and one `step`.

use crate::particle::{EmitterDef, Particles, Recipe};
use crate::relaxation::Relaxation;
use crate::shape::{Aabb, Shape};
use glam::Vec2;

/// Names one body for good: `index` is reused after a removal, `generation` then differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId {
    /// Slot in the world's arrays.
    pub index: u32,
    /// How often the slot was given out before.
    pub generation: u32,
}

/// How a body answers to forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Never moves, infinite mass.
    Static,
    /// Moves by its own velocity only, infinite mass: a lift.
    Kinematic,
    /// Moved by gravity and contacts.
    Dynamic,
}

/// A body as it is created. [`Default`] holds the chapter's values (row A2.7).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyDef {
    /// Outline.
    pub shape: Shape,
    /// Centre, world units.
    pub position: Vec2,
    /// Units/s.
    pub velocity: Vec2,
    /// How it moves.
    pub motion: Motion,
    /// Mass, positive and finite; only meant for dynamic bodies.
    pub mass: f32,
    /// Bounce, 0..=1; a pair takes the smaller of the two.
    pub restitution: f32,
    /// Coulomb coefficient, 0..=10; a pair takes the geometric mean.
    pub friction: f32,
    /// Factor on the world's gravity; 0 floats.
    pub gravity_scale: f32,
    /// Collision group, below [`GROUPS_MAX`].
    pub group: u8,
}

/// Collision groups a world can tell apart.
pub const GROUPS_MAX: usize = 32;

/// A fixed description of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSettings {
    /// Gravity, units/s^2.
    pub gravity: Vec2,
    /// Solver settings; `None` detects contacts and solves nothing (chapter project 9.1).
    pub relaxation: Option<Relaxation>,
    /// For each group, the set of groups that it meets, one bit each; symmetric.
    pub meets: [u32; GROUPS_MAX],
    /// Groups that push particles out, one bit each.
    pub meets_particles: u32,
    /// Bodies whose centre leaves this region are removed and reported.
    pub kill_zone: Aabb,
    /// Positions seen by clients are rounded to multiples of this, a power of two.
    pub quantum: f32,
    /// Speed cap of every body, units/s.
    pub speed_max: f32,
    /// Bodies at a time.
    pub bodies_max: usize,
    /// Particles at a time.
    pub particles_max: usize,
    /// Recipes that emitters may name.
    pub recipes: Vec<Recipe>,
}

/// Two bodies that overlap at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The body with the lower index.
    pub a: BodyId,
    /// The other body.
    pub b: BodyId,
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Overlap, world units, positive.
    pub depth: f32,
    /// Largest closing speed along the normal that was met in this step, units/s, not negative.
    pub closing: f32,
    /// Whether the two did not touch at the end of the step before.
    pub began: bool,
}

/// Bodies, contacts, particles.
#[derive(Clone, Debug)]
pub struct World {
    settings: WorldSettings,
    particles: Particles,
}

impl World {
    /// An empty world.
    pub fn new(settings: WorldSettings) -> World {
        let _ = settings;
        todo!()
    }

    /// Adds a body, or returns `None` when `bodies_max` is reached. Panics on a definition outside
    /// the documented ranges.
    pub fn add(&mut self, def: &BodyDef) -> Option<BodyId> {
        let _ = def;
        todo!()
    }

    /// Removes a body; `false` if it was gone already.
    pub fn remove(&mut self, id: BodyId) -> bool {
        let _ = id;
        todo!()
    }

    /// Whether the body exists.
    pub fn contains(&self, id: BodyId) -> bool {
        let _ = id;
        todo!()
    }

    /// Existing bodies in index order.
    pub fn ids(&self) -> impl Iterator<Item = BodyId> + '_ {
        std::iter::empty()
    }

    /// Number of existing bodies.
    pub fn body_count(&self) -> usize {
        todo!()
    }

    /// Centre in world units. Panics, like all accessors here, if the body is gone.
    pub fn position(&self, id: BodyId) -> Vec2 {
        let _ = id;
        todo!()
    }

    /// Centre rounded to the quantum, in quanta: what clients see.
    pub fn position_quanta(&self, id: BodyId) -> [i32; 2] {
        let _ = id;
        todo!()
    }

    /// Velocity, units/s.
    pub fn velocity(&self, id: BodyId) -> Vec2 {
        let _ = id;
        todo!()
    }

    /// Outline.
    pub fn shape(&self, id: BodyId) -> Shape {
        let _ = id;
        todo!()
    }

    /// Moves a body at once. Panics unless finite.
    pub fn set_position(&mut self, id: BodyId, position: Vec2) {
        let _ = (id, position);
        todo!()
    }

    /// Sets a velocity. Panics unless finite.
    pub fn set_velocity(&mut self, id: BodyId, velocity: Vec2) {
        let _ = (id, velocity);
        todo!()
    }

    /// Static, kinematic or dynamic.
    pub fn motion(&self, id: BodyId) -> Motion {
        let _ = id;
        todo!()
    }

    /// 1 / mass; 0 for static and kinematic bodies.
    pub fn inverse_mass(&self, id: BodyId) -> f32 {
        let _ = id;
        todo!()
    }

    /// Changes the factor on gravity.
    pub fn set_gravity_scale(&mut self, id: BodyId, scale: f32) {
        let _ = (id, scale);
        todo!()
    }

    /// The existing body with the lowest index that strictly contains the point and satisfies `wanted`.
    pub fn body_at(&self, point: Vec2, wanted: impl Fn(BodyId) -> bool) -> Option<BodyId> {
        let _ = (point, &wanted);
        todo!()
    }

    /// Advances bodies by one step: integrate, pairs, relax, removal of what left the kill zone.
    /// Particles move in `step_particles`, so that the rules can act in between.
    pub fn step(&mut self) {
        todo!()
    }

    /// Advances particles and emitters by one step, against the bodies where they are now.
    pub fn step_particles(&mut self) {
        todo!()
    }

    /// Overlaps at the end of the last step, in (a, b) order.
    pub fn touches(&self) -> &[Touch] {
        todo!()
    }

    /// Bodies that left the kill zone in the last step (they are gone), with their last position.
    pub fn departed(&self) -> &[(BodyId, Vec2)] {
        todo!()
    }

    /// Passes that the relaxation needed in the last step.
    pub fn passes(&self) -> u32 {
        todo!()
    }

    /// Starts an emitter.
    pub fn start_emitter(&mut self, emitter: EmitterDef) {
        self.particles.start(emitter);
    }

    /// Particles and emitters.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    /// Digest of the raw bits of all state in id order.
    pub fn hash(&self) -> u64 {
        todo!()
    }
}
