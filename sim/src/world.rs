//! The World: bodies as plain vectors by id, their contacts, particles, and one `step`.

mod conjugate;
mod settings;
mod sleep;
mod state;

pub use crate::body::{BodyDef, BodyId, GROUPS_MAX, Motion};
pub use settings::{STEP_MAX, WorldSettings};

use crate::bodies::{Bodies, REACH_MIN};
use crate::conjugate::Workspace;
use crate::contact::Contact;
use crate::features::{CAN, Features};
use crate::forces::{Drag, Forces, Spring, SpringEnd, Surroundings};
use crate::math::clamp_length;
use crate::pairs::{Filter, PairList};
use crate::particle::{EmitterDef, Obstacle, Particles, quantise};
use crate::relaxation::{self, Row};
use crate::shape::Shape;
use crate::solver::Solver;
use glam::Vec2;
use sleep::Sleep;

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

/// The parts of a tick, in order: where two runs can part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Players come and go, rules and tools set velocities.
    Inputs,
    /// Velocities, then positions.
    Integrate,
    /// Which pairs take part.
    Pairs,
    /// Contacts are solved.
    Relax,
    /// What happened is reported and acted on; tools make new bodies.
    Events,
    /// Particles move, emitters make more.
    Particles,
}

impl Phase {
    /// All of them, in order.
    pub const ALL: [Phase; 6] = [
        Phase::Inputs,
        Phase::Integrate,
        Phase::Pairs,
        Phase::Relax,
        Phase::Events,
        Phase::Particles,
    ];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Inputs => "inputs",
            Phase::Integrate => "integrate",
            Phase::Pairs => "pairs",
            Phase::Relax => "relax",
            Phase::Events => "events",
            Phase::Particles => "particles",
        }
    }
}

/// Bodies, contacts, particles.
#[derive(Clone, Debug)]
pub struct World {
    settings: WorldSettings,
    bodies: Bodies,
    pairs: PairList,
    sleep: Sleep,
    particles: Particles,
    forces: Option<Forces>,
    touches: Vec<Touch>,
    departed: Vec<(BodyId, Vec2)>,
    quarantined: Vec<BodyId>,
    passes: u32,
    /// What a step has to deal with: widens, never narrows, and is no state.
    features: Features,
    /// Scratch of a step: rows of the solver, velocities at the start of the moving bodies, the
    /// touches of the step before, what particles are pushed out of.
    rows: Vec<Row>,
    start_velocity: Vec<Vec2>,
    touches_before: Vec<Touch>,
    obstacles: Vec<Obstacle>,
    /// The same of the conjugate solver.
    workspace: Workspace,
}

impl World {
    /// An empty world. Panics on settings outside their documented ranges.
    pub fn new(settings: WorldSettings) -> World {
        settings.check();
        World {
            particles: Particles::new(settings.recipes.clone(), settings.particles_max),
            forces: settings.forces.as_ref().map(Forces::new),
            features: settings.features,
            pairs: PairList::new(settings.sleeping),
            settings,
            bodies: Bodies::default(),
            sleep: Sleep::default(),
            touches: Vec::new(),
            departed: Vec::new(),
            quarantined: Vec::new(),
            passes: 0,
            rows: Vec::new(),
            start_velocity: Vec::new(),
            touches_before: Vec::new(),
            obstacles: Vec::new(),
            workspace: Workspace::default(),
        }
    }

    /// Adds a body, or returns `None` when `bodies_max` is reached. Panics on a definition outside
    /// the documented ranges.
    pub fn add(&mut self, def: &BodyDef) -> Option<BodyId> {
        if self.bodies.count() >= self.settings.bodies_max {
            return None;
        }
        self.pairs.invalidate();
        self.widen(Features::of(def));
        let id = self.bodies.add(def);
        match &mut self.forces {
            Some(forces) => forces.added(id.index, def.drag),
            None => assert!(def.drag == Drag::NONE, "drag in a world without forces"),
        }
        self.welcome(id);
        Some(id)
    }

    /// Removes a body; `false` if it was gone already.
    pub fn remove(&mut self, id: BodyId) -> bool {
        if !self.bodies.contains(id) {
            return false;
        }
        self.disturb(id);
        self.pairs.removed(id.index);
        self.pairs.lift(id.index);
        self.touches.retain(|touch| touch.a != id && touch.b != id);
        if let Some(forces) = &mut self.forces {
            forces.removed(id);
        }
        self.bodies.remove(id);
        true
    }

    /// Whether the body exists.
    pub fn contains(&self, id: BodyId) -> bool {
        self.bodies.contains(id)
    }

    /// Existing bodies in index order.
    pub fn ids(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.bodies.slots().map(|slot| self.bodies.id(slot))
    }

    /// Number of existing bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.count()
    }

    /// Centre in world units. Panics, like all accessors here, if the body is gone.
    pub fn position(&self, id: BodyId) -> Vec2 {
        self.bodies.center[self.bodies.index(id)]
    }

    /// Centre rounded to the quantum, in quanta: what clients see.
    pub fn position_quanta(&self, id: BodyId) -> [i32; 2] {
        quantise(self.position(id), self.settings.quantum)
    }

    /// Velocity, units/s.
    pub fn velocity(&self, id: BodyId) -> Vec2 {
        self.bodies.velocity[self.bodies.index(id)]
    }

    /// Outline.
    pub fn shape(&self, id: BodyId) -> Shape {
        self.bodies.shape[self.bodies.index(id)]
    }

    /// Static, kinematic or dynamic.
    pub fn motion(&self, id: BodyId) -> Motion {
        self.bodies.motion[self.bodies.index(id)]
    }

    /// Collision group.
    pub fn group(&self, id: BodyId) -> u8 {
        self.bodies.group[self.bodies.index(id)]
    }

    /// 1 / mass; 0 for static and kinematic bodies.
    pub fn inverse_mass(&self, id: BodyId) -> f32 {
        self.bodies.inverse_mass[self.bodies.index(id)]
    }

    /// Bounce, 0..=1.
    pub fn restitution(&self, id: BodyId) -> f32 {
        self.bodies.material[self.bodies.index(id)].restitution
    }

    /// Coulomb coefficient, 0..=10.
    pub fn friction(&self, id: BodyId) -> f32 {
        self.bodies.material[self.bodies.index(id)].friction
    }

    /// Factor on the world's gravity.
    pub fn gravity_scale(&self, id: BodyId) -> f32 {
        self.bodies.gravity_scale[self.bodies.index(id)]
    }

    /// What slows it down on its way.
    pub fn drag(&self, id: BodyId) -> Drag {
        let index = self.bodies.index(id) as u32;
        self.forces.as_ref().map_or(Drag::NONE, |forces| forces.drag(index))
    }

    /// Adds a spring; `false` when `springs_max` is reached. Panics on numbers outside their
    /// documented ranges, if a body is gone, and in a world without forces.
    pub fn add_spring(&mut self, spring: Spring) -> bool {
        self.disturb(spring.body);
        if let SpringEnd::Body(other) = spring.end {
            self.disturb(other);
        }
        self.forces.as_mut().expect("a spring in a world without forces").add_spring(spring)
    }

    /// All springs, in the order in which they were added.
    pub fn springs(&self) -> &[Spring] {
        self.forces.as_ref().map_or(&[], Forces::springs)
    }

    /// Moves a body at once. Panics unless finite.
    pub fn set_position(&mut self, id: BodyId, position: Vec2) {
        assert!(position.is_finite(), "position {position} must be finite");
        let index = self.bodies.index(id);
        if self.settings.sleeping && self.bodies.center[index] == position {
            return;
        }
        self.disturb(id);
        self.pairs.lift(id.index);
        self.bodies.center[index] = position;
        self.pairs.invalidate();
        self.welcome(id);
    }

    /// Sets a velocity. Panics unless finite, and on a static body unless zero (C20).
    pub fn set_velocity(&mut self, id: BodyId, velocity: Vec2) {
        assert!(velocity.is_finite(), "velocity {velocity} must be finite");
        let index = self.bodies.index(id);
        let still = self.bodies.motion[index] != Motion::Static || velocity == Vec2::ZERO;
        assert!(still, "static body {} cannot have velocity {velocity}", id.index);
        if self.bodies.velocity[index] != velocity {
            self.disturb(id);
            self.bodies.velocity[index] = velocity;
        }
    }

    /// Sets the mass of a dynamic body. Panics unless positive and finite.
    pub fn set_mass(&mut self, id: BodyId, mass: f32) {
        assert!(mass > 0.0 && mass.is_finite(), "mass {mass} must be positive and finite");
        assert!((1.0 / mass).is_finite(), "mass {mass} is out of range");
        let index = self.bodies.index(id);
        assert!(self.bodies.motion[index] == Motion::Dynamic, "only dynamic bodies have a mass");
        self.disturb(id);
        self.bodies.inverse_mass[index] = 1.0 / mass;
    }

    /// Changes the factor on gravity. Panics unless finite.
    pub fn set_gravity_scale(&mut self, id: BodyId, scale: f32) {
        assert!(scale.is_finite(), "gravity scale {scale} must be finite");
        let index = self.bodies.index(id);
        if self.bodies.gravity_scale[index] != scale {
            self.disturb(id);
            self.bodies.gravity_scale[index] = scale;
        }
    }

    /// Changes gravity, units/s^2; everybody wakes. It is a setting, not state: who restores such a
    /// world gives the settings that it has. Panics unless finite.
    pub fn set_gravity(&mut self, gravity: Vec2) {
        assert!(gravity.is_finite(), "gravity {gravity} must be finite");
        self.settings.gravity = gravity;
        self.wake_all();
    }

    /// The existing body with the lowest index that strictly contains the point and satisfies
    /// `wanted`.
    pub fn body_at(&self, point: Vec2, wanted: impl Fn(BodyId) -> bool) -> Option<BodyId> {
        self.ids().find(|&id| {
            let index = id.index as usize;
            self.bodies.shape[index].contains(point - self.bodies.center[index]) && wanted(id)
        })
    }

    /// Advances bodies by one step: integrate, pairs, relax, removal of what left the kill zone.
    /// Particles move in [`World::step_particles`], so that the rules can act in between.
    pub fn step(&mut self) {
        self.step_watched(&mut |_, _| {});
    }

    /// [`World::step`], shown to `watch` after each phase. What it changes is part of the step.
    pub fn step_watched(&mut self, watch: &mut impl FnMut(Phase, &mut World)) {
        match self.settings.solver {
            Some(Solver::Conjugate(settings)) => self.step_conjugate(settings, watch),
            Some(Solver::Relaxation(_)) | None => self.step_relaxation(watch),
        }
        self.remove_departed();
        if self.settings.sleeping && CAN.sleeping {
            self.fall_asleep();
        }
    }

    fn step_relaxation(&mut self, watch: &mut impl FnMut(Phase, &mut World)) {
        self.integrate();
        watch(Phase::Integrate, self);
        self.refresh_pairs();
        let features = self.features.in_this_build();
        relaxation::gather(&self.bodies, &self.pairs.pairs, features, &mut self.rows);
        watch(Phase::Pairs, self);
        self.leave_out_unsound();
        self.relax();
        watch(Phase::Relax, self);
        self.report_touches();
    }

    /// Drops the rows of bodies whose place or speed is no number; they leave with the departed.
    fn leave_out_unsound(&mut self) {
        let bodies = &self.bodies;
        if !bodies.moving.iter().all(|&slot| bodies.is_sound(slot as usize)) {
            let sound = |slot: u32| bodies.is_sound(slot as usize);
            self.rows.retain(|row| sound(row.a) && sound(row.b));
        }
    }

    fn integrate(&mut self) {
        self.find_moves();
        self.accelerate();
        if let Some(Solver::Relaxation(settings)) = &self.settings.solver
            && settings.warm_start
        {
            relaxation::warm_start(&mut self.bodies, &mut self.pairs.pairs);
        }
        self.travel();
    }

    fn relax(&mut self) {
        self.passes = 0;
        if let Some(Solver::Relaxation(settings)) = &self.settings.solver {
            let features = self.features.in_this_build();
            self.passes = relaxation::relax(&mut self.bodies, &mut self.rows, settings, features);
            relaxation::store(&self.rows, &mut self.pairs.pairs);
            self.judge_calmness();
        }
    }

    /// Symplectic Euler, first half: new velocities.
    fn accelerate(&mut self) {
        let Bodies { moving, velocity, gravity_scale, motion, .. } = &mut self.bodies;
        let gain = self.settings.gravity * self.settings.dt;
        self.start_velocity.clear();
        for &slot in moving.iter() {
            let slot = slot as usize;
            self.start_velocity.push(velocity[slot]);
            if Bodies::is_pushed(motion[slot]) {
                let faster = velocity[slot] + gain * gravity_scale[slot];
                velocity[slot] = clamp_length(faster, self.settings.speed_max);
            }
        }
        for found in self.forces.iter().filter(|_| CAN.forces).flat_map(|forces| &forces.moves) {
            velocity[found.slot as usize] = found.velocity;
        }
    }

    /// Symplectic Euler, second half: positions from the new velocities.
    fn travel(&mut self) {
        let Bodies { moving, velocity, center, reach, .. } = &mut self.bodies;
        for &slot in moving.iter() {
            let path = velocity[slot as usize] * self.settings.dt;
            center[slot as usize] += path;
            reach[slot as usize] = REACH_MIN + path.length();
        }
        // What resting impulses changed about a speed acts all through the step.
        for found in self.forces.iter().filter(|_| CAN.forces).flat_map(|forces| &forces.moves) {
            let slot = found.slot as usize;
            let path = velocity[slot] * self.settings.dt;
            let exact = found.path + (velocity[slot] - found.velocity) * self.settings.dt;
            center[slot] += exact - path;
            reach[slot] = REACH_MIN + path.length() + exact.length();
        }
    }

    /// Where drag, wind and springs take those who feel them.
    fn find_moves(&mut self) {
        let WorldSettings { gravity, dt, speed_max, .. } = self.settings;
        if let Some(forces) = &mut self.forces
            && CAN.forces
        {
            forces.find_moves(&self.bodies, Surroundings { gravity, dt, speed_max });
            forces.moves.retain(|found| !self.sleep.has(found.slot));
        }
    }

    /// Makes the pair list complete; whether it was made anew.
    pub(crate) fn refresh_pairs(&mut self) -> bool {
        let filter =
            Filter { meets: &self.settings.meets, immovable: self.settings.solver.is_none() };
        self.pairs.refresh(&self.bodies, filter)
    }

    fn judge_calmness(&mut self) {
        let free_change = self.settings.gravity.length() * self.settings.dt;
        let Bodies { moving, velocity, calm, .. } = &mut self.bodies;
        for (&slot, &start) in moving.iter().zip(&self.start_velocity) {
            let slot = slot as usize;
            calm[slot] = relaxation::calmness(velocity[slot] - start, free_change);
        }
    }

    /// Lists the overlaps at the end of the step; both lists are in (a, b) order.
    fn report_touches(&mut self) {
        if !CAN.touches {
            return;
        }
        std::mem::swap(&mut self.touches, &mut self.touches_before);
        self.touches.clear();
        let mut before = self.touches_before.iter().peekable();
        for row in &mut self.rows {
            let Some(contact) = row.contact(&self.bodies) else { continue };
            let (a, b) = (self.bodies.id(row.a), self.bodies.id(row.b));
            while before.next_if(|old| (old.a.index, old.b.index) < (row.a, row.b)).is_some() {}
            let began = before.next_if(|old| (old.a, old.b) == (a, b)).is_none();
            let Contact { normal, depth } = contact;
            self.touches.push(Touch { a, b, normal, depth, closing: row.closing, began });
        }
    }

    fn remove_departed(&mut self) {
        self.departed.clear();
        self.quarantined.clear();
        for &slot in &self.bodies.moving {
            let center = self.bodies.center[slot as usize];
            // What is no number goes before it can touch anything (C03).
            if !self.bodies.is_sound(slot as usize) {
                let last = if center.is_finite() { center } else { self.settings.kill_zone.low };
                self.quarantined.push(self.bodies.id(slot));
                self.departed.push((self.bodies.id(slot), last));
            } else if !self.settings.kill_zone.contains(center) {
                self.departed.push((self.bodies.id(slot), center));
            }
        }
        for place in 0..self.departed.len() {
            self.remove(self.departed[place].0);
        }
    }

    /// Advances particles and emitters by one step, against the bodies where they are now, at the
    /// quantised places that clients see.
    pub fn step_particles(&mut self) {
        if !self.features.in_this_build().particles {
            return;
        }
        let quantum = self.settings.quantum;
        self.obstacles.clear();
        if !self.particles.is_empty() {
            for slot in self.bodies.slots() {
                let slot = slot as usize;
                if self.settings.meets_particles >> self.bodies.group[slot] & 1 == 1 {
                    let quanta = quantise(self.bodies.center[slot], quantum);
                    self.obstacles.push(Obstacle::new(self.bodies.shape[slot], quanta, quantum));
                }
            }
        }
        let bodies = &self.bodies;
        self.particles.step(&self.obstacles, |id| {
            let quanta = quantise(*bodies.center.get(id.index as usize)?, quantum);
            bodies.contains(id).then(|| crate::particle::dequantise(quanta, quantum))
        });
    }

    /// Overlaps at the end of the last step, in (a, b) order.
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// Bodies of the last step whose place or speed was no number any more: taken out before anybody
    /// could feel it. They are among the departed too. It never happens; if it does, report it.
    pub fn quarantined(&self) -> &[BodyId] {
        &self.quarantined
    }

    /// Bodies that left the kill zone in the last step (they are gone), with their last position.
    pub fn departed(&self) -> &[(BodyId, Vec2)] {
        &self.departed
    }

    /// Passes that the solver needed in the last step.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// What the solver did in the last step, in pairs: a pair counts once a pass. A measure of work
    /// that no machine changes.
    pub fn pair_solves(&self) -> u64 {
        match self.settings.solver {
            Some(Solver::Conjugate(_)) => self.workspace.work,
            _ => u64::from(self.passes) * self.rows.len() as u64,
        }
    }

    /// Starts an emitter; `false` if too many are running. Panics if it names a recipe that the
    /// world does not have.
    pub fn start_emitter(&mut self, emitter: EmitterDef) -> bool {
        self.features.particles = true;
        self.particles.start(emitter)
    }

    /// Particles and emitters.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Has steps deal with more than the bodies bring. It changes no result: a step does not ask for
    /// what no body brings, that is all.
    pub fn widen(&mut self, features: Features) {
        self.features = self.features.with(features);
    }

    /// What its steps deal with by now.
    pub fn features(&self) -> Features {
        self.features
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    /// Whether every position and velocity is finite: true after every step.
    pub fn is_finite(&self) -> bool {
        self.bodies.slots().all(|slot| self.bodies.is_sound(slot as usize))
    }
}

#[cfg(test)]
impl World {
    pub(crate) fn body_arrays(&self) -> &Bodies {
        &self.bodies
    }

    pub(crate) fn pair_list(&self) -> &PairList {
        &self.pairs
    }

    pub(crate) fn workspace_rows(&self) -> usize {
        self.workspace.rows.len()
    }

    pub(crate) fn invalidate_pairs(&mut self) {
        self.pairs.invalidate();
    }
}

#[cfg(test)]
mod tests;
