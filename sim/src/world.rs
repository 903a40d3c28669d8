//! The World: bodies as plain vectors by id, their contacts, particles, and one `step`.

pub(crate) mod counts;
#[cfg(test)]
mod inspect;
pub(crate) mod settings;
mod state;
mod step;

pub use crate::body::{BodyDef, BodyId, Motion};
pub use settings::{StepBudget, WorldSettings};

use crate::bodies::Bodies;
use crate::broad_phase::pairs::PairList;
use crate::check;
use crate::features::Features;
use crate::forces::Forces;
use crate::forces::drag::Drag;
use crate::forces::springs::{Spring, SpringEnd};
use crate::growth::ScratchUse;
use crate::particles::{EmitterDef, Obstacle, Particles, dequantise, quantise};
use crate::shape::Shape;
use crate::sleep::{Awake, Sleep};
use crate::solver::Solver;
use crate::solver::conjugate::ConjugateSolver;
use crate::solver::relaxation::RelaxationSolver;
use crate::steady::Steady;
use crate::touches::{Touch, Touches};
use glam::Vec2;

/// The phases of a step after which [`World::step_watched`] calls back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepPhase {
    /// Velocities and positions are integrated. The conjugate solver does this last.
    Integrate,
    /// The pairs that take part are found.
    Pairs,
    /// Contacts are solved, and overlaps removed.
    Relax,
}

/// Bodies, contacts and particles.
///
/// Using a removed body is a caller bug. Debug builds panic; release builds treat it as a static circle at rest at the
/// origin, and ignore changes of it.
#[derive(Clone, Debug)]
pub struct World {
    settings: WorldSettings,
    bodies: Bodies,
    pairs: PairList,
    sleep: Sleep,
    /// Islands that steps of the conjugate solver leave out; not state.
    steady: Steady,
    particles: Particles,
    forces: Option<Forces>,
    touches: Touches,
    departed: Departed,
    /// Steps follow the chapter's listing.
    listed: bool,
    /// Features that a step has to handle: widens, never narrows, and is not state.
    features: Features,
    /// Scratch of the two solvers, one of which is used, and of the particles.
    relaxation: RelaxationSolver,
    conjugate: Box<ConjugateSolver>,
    scratch_use: ScratchUse,
    obstacles: Vec<Obstacle>,
}

/// Bodies that the last step removed.
#[derive(Clone, Debug, Default)]
struct Departed {
    /// All of them, with their last position.
    bodies: Vec<(BodyId, Vec2)>,
    /// Those whose position or velocity was not finite.
    quarantined: Vec<BodyId>,
}

impl World {
    /// Creates an empty world. Panics on settings outside their documented ranges.
    pub fn new(settings: WorldSettings) -> World {
        settings.check();
        World {
            particles: particles(&settings),
            forces: settings.forces.as_ref().map(Forces::new),
            features: settings.features,
            pairs: PairList::new(settings.sleeping),
            settings,
            bodies: Bodies::default(),
            sleep: Sleep::default(),
            steady: Steady::default(),
            touches: Touches::default(),
            departed: Departed::default(),
            listed: false,
            relaxation: RelaxationSolver::default(),
            conjugate: Box::default(),
            scratch_use: ScratchUse::default(),
            obstacles: Vec::new(),
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
            Some(forces) => forces.added(id.index, def.group, def.drag),
            None => assert!(def.drag == Drag::NONE, "drag in a world without forces"),
        }
        self.body_placed(id);
        Some(id)
    }

    /// Removes a body; returns `false` if it does not exist.
    pub fn remove(&mut self, id: BodyId) -> bool {
        let exists = self.bodies.contains(id);
        self.remove_all(&[id]);
        exists
    }

    /// Removes bodies, and passes over those that do not exist: all at once, since one alone already takes a walk over all pairs.
    pub fn remove_all(&mut self, ids: &[BodyId]) {
        let before = self.bodies.count();
        self.wake(ids);
        self.steady.readmit_around(&mut self.bodies, ids);
        for &id in ids {
            if self.bodies.contains(id) {
                self.readmit_if_fixed(id);
                self.pairs.removed(id.index);
                self.bodies.remove(id);
            }
        }
        if self.bodies.count() == before {
            return;
        }
        self.pairs.keep_alive(&self.bodies);
        let lives = |id: BodyId| self.bodies.alive[id.index as usize];
        self.touches.now.retain(|touch| lives(touch.a) && lives(touch.b));
        if let Some(forces) = &mut self.forces {
            forces.keep_alive(&self.bodies);
        }
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

    /// Centre in world units.
    #[inline]
    pub fn position(&self, id: BodyId) -> Vec2 {
        self.bodies.find(id).map_or(Vec2::ZERO, |index| self.bodies.center[index])
    }

    /// Centre rounded to the quantum, in quanta, as clients see it.
    pub fn position_quanta(&self, id: BodyId) -> [i32; 2] {
        quantise(self.position(id), self.settings.quantum)
    }

    /// Velocity, units/s.
    #[inline]
    pub fn velocity(&self, id: BodyId) -> Vec2 {
        self.bodies.find(id).map_or(Vec2::ZERO, |index| self.bodies.velocity[index])
    }

    /// Shape of a body. Panics if it does not exist.
    #[inline]
    pub fn shape(&self, id: BodyId) -> Shape {
        self.bodies.find(id).map_or(Shape::Circle { radius: 1.0 }, |index| self.bodies.shape[index])
    }

    /// Static, kinematic or dynamic.
    #[inline]
    pub fn motion(&self, id: BodyId) -> Motion {
        self.bodies.find(id).map_or(Motion::Static, |index| self.bodies.motion[index])
    }

    /// Collision group of a body. Panics if it does not exist.
    #[inline]
    pub fn group(&self, id: BodyId) -> u8 {
        self.bodies.find(id).map_or(0, |index| self.bodies.group[index])
    }

    /// 1 / mass; 0 for static and kinematic bodies.
    #[inline]
    pub fn inverse_mass(&self, id: BodyId) -> f32 {
        self.bodies.find(id).map_or(0.0, |index| self.bodies.inverse_mass[index])
    }

    /// Restitution, 0..=1.
    pub fn restitution(&self, id: BodyId) -> f32 {
        self.bodies.find(id).map_or(0.0, |index| self.bodies.material[index].restitution)
    }

    /// Coulomb coefficient, 0..=10.
    pub fn friction(&self, id: BodyId) -> f32 {
        self.bodies.find(id).map_or(0.0, |index| self.bodies.material[index].friction)
    }

    /// Factor on the world's gravity.
    pub fn gravity_scale(&self, id: BodyId) -> f32 {
        self.bodies.find(id).map_or(0.0, |index| self.bodies.gravity_scale[index])
    }

    /// Drag against the air.
    pub fn drag(&self, id: BodyId) -> Drag {
        let forces = self.forces.as_ref().filter(|_| self.bodies.find(id).is_some());
        forces.map_or(Drag::NONE, |forces| forces.drag(id.index))
    }

    /// Adds a spring; returns `false` when `springs_max` is reached. Panics on numbers outside
    /// their documented ranges, and in a world without forces.
    pub fn add_spring(&mut self, spring: Spring) -> bool {
        let other = match spring.end {
            SpringEnd::Body(other) => Some(other),
            SpringEnd::Point(_) => None,
        };
        let exists = |id| self.bodies.find(id).is_some();
        if !exists(spring.body) || !other.is_none_or(exists) {
            return false;
        }
        self.wake_around(spring.body);
        if let Some(other) = other {
            self.wake_around(other);
        }
        self.forces.as_mut().expect("a spring in a world without forces").add_spring(spring)
    }

    /// All springs, in the order in which they were added.
    pub fn springs(&self) -> &[Spring] {
        self.forces.as_ref().map_or(&[], Forces::springs)
    }

    /// Sets a position. Panics unless finite.
    pub fn set_position(&mut self, id: BodyId, position: Vec2) {
        check::vector(position.is_finite(), "position", position);
        let Some(index) = self.bodies.find(id) else { return };
        if self.settings.sleeping && self.bodies.center[index] == position {
            return;
        }
        self.wake_around(id);
        self.pairs.remove_static(id.index);
        self.bodies.center[index] = position;
        self.pairs.invalidate();
        self.body_placed(id);
    }

    /// Sets a velocity. Panics unless finite. A static body keeps its own, which is zero (C20): another is a fault of
    /// the caller, as if it were removed.
    pub fn set_velocity(&mut self, id: BodyId, velocity: Vec2) {
        check::vector(velocity.is_finite(), "velocity", velocity);
        let Some(index) = self.bodies.find(id) else { return };
        let still = self.bodies.motion[index] != Motion::Static || velocity == Vec2::ZERO;
        debug_assert!(still, "static body {} cannot have velocity {velocity}", id.index);
        if still && self.bodies.velocity[index] != velocity {
            self.wake_around(id);
            let stands = |velocity: Vec2| velocity == Vec2::ZERO;
            if stands(self.bodies.velocity[index]) != stands(velocity) {
                self.readmit_if_fixed(id);
            }
            self.bodies.velocity[index] = velocity;
        }
    }

    /// Wakes bodies, each with those that rest on it: all at once, which takes far less time than one after another, as changes
    /// of them would. Does nothing in a world that does not sleep.
    pub fn wake(&mut self, ids: &[BodyId]) {
        if self.settings.sleeping {
            let mut slots: Vec<u32> = Vec::new();
            for &id in ids {
                if self.bodies.contains(id) {
                    slots.push(id.index);
                }
            }
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            self.sleep.wake_around(&mut awake, &slots);
        }
    }

    /// Sets the mass of a dynamic body. Panics unless positive and finite.
    pub fn set_mass(&mut self, id: BodyId, mass: f32) {
        let is_invertible = mass > 0.0 && mass.is_finite() && (1.0 / mass).is_finite();
        check::number(is_invertible, "mass", mass);
        let Some(index) = self.bodies.find(id) else { return };
        assert!(self.bodies.motion[index] == Motion::Dynamic, "only dynamic bodies have a mass");
        self.wake_around(id);
        self.bodies.inverse_mass[index] = 1.0 / mass;
    }

    /// Changes the factor on gravity. Panics unless finite.
    pub fn set_gravity_scale(&mut self, id: BodyId, scale: f32) {
        check::number(scale.is_finite(), "gravity scale", scale);
        let Some(index) = self.bodies.find(id) else { return };
        if self.bodies.gravity_scale[index] != scale {
            self.wake_around(id);
            self.bodies.gravity_scale[index] = scale;
        }
    }

    /// Switches from the relaxation to the chapter's solver as it is printed, or back; other solvers stay. Forces
    /// do not act meanwhile. It is a setting, not state.
    pub fn set_listed(&mut self, listed: bool) {
        self.listed = listed;
    }

    /// Changes gravity, units/s^2, and wakes all bodies. It is a setting, not state: to restore
    /// such a world, pass the settings that it had. Panics unless finite.
    pub fn set_gravity(&mut self, gravity: Vec2) {
        check::vector(gravity.is_finite(), "gravity", gravity);
        self.settings.gravity = gravity;
        self.steady.readmit_all(&mut self.bodies);
        let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
        self.sleep.wake_all(&mut awake);
    }

    /// Returns the body with the lowest index that strictly contains the point and satisfies
    /// `wanted`.
    pub fn body_at(&self, point: Vec2, wanted: impl Fn(BodyId) -> bool) -> Option<BodyId> {
        self.ids().find(|&id| {
            let index = id.index as usize;
            self.bodies.shape[index].contains(point - self.bodies.center[index]) && wanted(id)
        })
    }

    /// Advances bodies by one step: integrates, finds pairs, solves contacts, removes the bodies
    /// that left the kill zone. Particles move in [`World::step_particles`], so that rules can act
    /// in between.
    pub fn step(&mut self) {
        self.advance(&mut |_, _| {});
    }

    /// Makes a [`World::step`] that calls `watch` after each phase. Changes by `watch` are part of
    /// the step.
    pub fn step_watched(&mut self, watch: &mut impl FnMut(StepPhase, &mut World)) {
        self.steady.readmit_all(&mut self.bodies);
        self.advance(watch);
    }

    /// Wakes a body that is changed from outside, with the bodies that rest on it.
    fn wake_around(&mut self, id: BodyId) {
        self.steady.readmit_around(&mut self.bodies, &[id]);
        if self.settings.sleeping {
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            self.sleep.wake_around(&mut awake, &[id.index]);
        }
    }

    /// Readmits all steady islands where a body that nothing pushes appears, disappears, starts or stops.
    fn readmit_if_fixed(&mut self, id: BodyId) {
        if self.motion(id) != Motion::Dynamic {
            self.steady.readmit_all(&mut self.bodies);
        }
    }

    /// Registers a body that was added or placed elsewhere.
    fn body_placed(&mut self, id: BodyId) {
        self.readmit_if_fixed(id);
        if self.settings.sleeping {
            let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
            self.sleep.body_placed(&mut awake, id.index);
        }
    }

    /// Advances particles and emitters by one step, against the bodies at the present quantised
    /// positions that clients see.
    pub fn step_particles(&mut self) {
        if !self.features.particles || self.is_over_budget() {
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
            bodies.contains(id).then(|| dequantise(quanta, quantum))
        });
    }

    /// Touches at the end of the last step, in (a, b) order.
    pub fn touches(&self) -> &[Touch] {
        &self.touches.now
    }

    /// Bodies of the last step whose position or velocity was not finite, removed before they could
    /// touch anything. They are among the departed too. This never happens; if it does, report it.
    pub fn quarantined(&self) -> &[BodyId] {
        &self.departed.quarantined
    }

    /// Bodies that left the kill zone in the last step and were removed, with their last position.
    pub fn departed(&self) -> &[(BodyId, Vec2)] {
        &self.departed.bodies
    }

    /// Number of passes or sweeps over the contacts in the last step.
    pub fn passes(&self) -> u32 {
        match self.settings.solver {
            Some(Solver::Conjugate(_)) => self.conjugate.sweeps,
            _ => self.relaxation.passes,
        }
    }

    /// The solver's work in the last step: visits of pairs by passes, and predictions of impacts. A measure
    /// independent of the machine.
    pub fn pair_solves(&self) -> u64 {
        match self.settings.solver {
            Some(Solver::Conjugate(_)) => self.conjugate.work,
            _ => u64::from(self.relaxation.passes) * self.relaxation.constraints.len() as u64,
        }
    }

    /// Whether a step needed more than its [`StepBudget`]: it was broken off, and the world stands still from then on.
    /// Its game cannot go on. What a step needs depends on when the list of pairs was built and on which islands were left
    /// out, so that a restored world may exceed its budget some steps earlier or later.
    pub fn is_over_budget(&self) -> bool {
        self.pairs.is_over() || self.conjugate.is_over() || self.particles.is_over()
    }

    /// Pairs that the last step found: what [`StepBudget::pairs`] bounds.
    pub fn pair_count(&self) -> usize {
        self.pairs.pairs.len()
    }

    /// Whether a body sleeps: it is at rest and costs nothing. Only in worlds that sleep. Its
    /// touches are not reported.
    pub fn is_asleep(&self, id: BodyId) -> bool {
        self.bodies.find(id).is_some_and(|index| self.sleep.has(index as u32))
    }

    /// Starts an emitter; returns `false` if too many are running. Panics if its recipe does not
    /// exist.
    pub fn start_emitter(&mut self, emitter: EmitterDef) -> bool {
        self.features.particles = true;
        self.particles.start(emitter)
    }

    /// The particles and emitters of the world.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Adds features that steps handle, beyond those of the bodies. It changes no result.
    pub fn widen(&mut self, features: Features) {
        self.features = self.features.with(features);
    }

    /// Features that steps handle so far.
    pub fn features(&self) -> Features {
        self.features
    }

    /// The settings of the world.
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    /// Whether every position and velocity is finite: true after every step.
    pub fn is_finite(&self) -> bool {
        self.bodies.slots().all(|slot| self.bodies.is_finite(slot as usize))
    }
}

/// No particles yet, in a world with these settings.
fn particles(settings: &WorldSettings) -> Particles {
    let mut particles = Particles::new(settings.recipes.clone(), settings.particles_max);
    particles.limit_obstacle_cells(settings.budget.obstacle_cells);
    particles
}

fn awake<'a>(
    bodies: &'a mut Bodies,
    pairs: &'a mut PairList,
    touches: &'a mut Touches,
) -> Awake<'a> {
    Awake { bodies, pairs, touches: &mut touches.now }
}

#[cfg(test)]
mod tests;
