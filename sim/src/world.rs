//! The World consists of bodies in plain vectors by id, their contacts, particles, and one `step`.

pub(crate) mod settings;
mod solvers;
mod state;
mod step;

pub use crate::body::{BodyDef, BodyId, Motion};
pub use settings::{StepBudget, WorldSettings};

use crate::bodies::Bodies;
use crate::broad_phase::pairs::PairList;
use crate::check;
use crate::features::Features;
use crate::forces::Forces;
use crate::forces::air::Drag;
use crate::forces::springs::{Spring, SpringEnd};
use crate::particles::{EmitterDef, Obstacle, Particles, dequantise, quantise};
use crate::shape::{Aabb, Shape};
use crate::sleep::{Awake, Sleep};
use crate::steady::Steady;
use crate::step_counts::StepCounts;
use crate::touches::{Touch, Touches};
use glam::Vec2;
use solvers::Solvers;

/// The phases of a step, after each of which [`World::step_watched`] calls back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepPhase {
    /// Velocities and positions have been integrated. The conjugate solver does this last.
    Integrate,
    /// The pairs that take part in the step have been found.
    Pairs,
    /// Contacts have been solved and overlaps removed.
    Relax,
}

/// Bodies, contacts and particles.
///
/// Using a removed body is a bug in the caller. Debug builds panic; release builds treat it as a static circle at
/// rest at the origin and ignore changes to it.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) settings: WorldSettings,
    pub(crate) bodies: Bodies,
    pub(crate) pairs: PairList,
    pub(crate) sleep: Sleep,
    /// Islands left out by steps of the conjugate solver; not state.
    pub(crate) steady: Steady,
    particles: Particles,
    pub(crate) forces: Forces,
    touches: Touches,
    departed: Departed,
    /// Whether steps follow the chapter's code as printed.
    listed: bool,
    pub(crate) solvers: Solvers,
    /// Scratch for the particles.
    obstacles: Vec<Obstacle>,
}

/// Bodies that the latest step removed.
#[derive(Clone, Debug, Default)]
pub struct Departed {
    /// All removed bodies, with their last positions.
    pub bodies: Vec<(BodyId, Vec2)>,
    /// Those that were removed because their position or velocity was not finite, before they could touch anything.
    /// This should never happen; if it does, report it.
    pub quarantined: Vec<BodyId>,
}

impl Departed {
    /// Lists the bodies that the current step removes.
    fn find(&mut self, bodies: &Bodies, kill_zone: &Aabb) {
        self.bodies.clear();
        self.quarantined.clear();
        for &slot in &bodies.moving {
            let center = bodies.center[slot as usize];
            // A body that is not finite is removed before it can touch anything (C03).
            if !bodies.is_finite(slot as usize) {
                let last = if center.is_finite() { center } else { kill_zone.low };
                self.quarantined.push(bodies.id(slot));
                self.bodies.push((bodies.id(slot), last));
            } else if !kill_zone.contains(center) {
                self.bodies.push((bodies.id(slot), center));
            }
        }
    }
}

impl World {
    /// Creates an empty world. Panics if settings are outside their documented ranges.
    pub fn new(settings: WorldSettings) -> World {
        settings.check();
        World {
            particles: particles(&settings),
            forces: settings.forces.as_ref().map_or_else(Forces::default, Forces::new),
            pairs: PairList::new(settings.sleeping),
            bodies: Bodies::default(),
            sleep: Sleep::new(settings.sleeping),
            steady: Steady::default(),
            touches: Touches::default(),
            departed: Departed::default(),
            listed: false,
            solvers: Solvers::default(),
            obstacles: Vec::new(),
            settings,
        }
    }

    /// Adds a body, or returns `None` if `bodies_max` is reached. Panics if the definition is
    /// outside the documented ranges.
    pub fn add(&mut self, def: &BodyDef) -> Option<BodyId> {
        if self.bodies.count() >= self.settings.bodies_max {
            return None;
        }
        self.pairs.invalidate();
        self.settings.features = self.settings.features.with(Features::of(def));
        let has_forces = self.settings.forces.is_some();
        assert!(has_forces || def.drag == Drag::NONE, "drag in a world without forces");
        let id = self.bodies.add(def);
        self.forces.added(id.index, def.group, def.drag);
        self.steady.readmit_if_fixed(&mut self.bodies, id);
        let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
        self.sleep.body_placed(&mut awake, id.index);
        Some(id)
    }

    /// Removes a body, or returns `false` if it does not exist.
    pub fn remove(&mut self, id: BodyId) -> bool {
        let exists = self.bodies.contains(id);
        self.remove_all(&[id]);
        exists
    }

    /// Removes bodies, ignoring those that do not exist. All are removed at once, since even a single removal
    /// iterates over all pairs.
    pub fn remove_all(&mut self, ids: &[BodyId]) {
        let before = self.bodies.count();
        self.wake(ids);
        for &id in ids {
            if self.bodies.contains(id) {
                self.steady.readmit_if_fixed(&mut self.bodies, id);
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
        self.forces.keep_alive(&self.bodies);
    }

    /// Whether the body exists.
    pub fn contains(&self, id: BodyId) -> bool {
        self.bodies.contains(id)
    }

    /// Ids of the existing bodies, in index order.
    pub fn ids(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.bodies.slots().map(|slot| self.bodies.id(slot))
    }

    /// Number of existing bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.count()
    }

    /// Centre of a body, world units.
    #[inline]
    pub fn position(&self, id: BodyId) -> Vec2 {
        self.bodies.find(id).map_or(Vec2::ZERO, |index| self.bodies.center[index])
    }

    /// Velocity of a body, units/s.
    #[inline]
    pub fn velocity(&self, id: BodyId) -> Vec2 {
        self.bodies.find(id).map_or(Vec2::ZERO, |index| self.bodies.velocity[index])
    }

    /// Shape of a body. Panics if it does not exist.
    #[inline]
    pub fn shape(&self, id: BodyId) -> Shape {
        self.bodies.find(id).map_or(Shape::Circle { radius: 1.0 }, |index| self.bodies.shape[index])
    }

    /// Whether a body is static, kinematic or dynamic.
    #[inline]
    pub fn motion(&self, id: BodyId) -> Motion {
        self.bodies.find(id).map_or(Motion::Static, |index| self.bodies.motion[index])
    }

    /// Collision group of a body. Panics if it does not exist.
    #[inline]
    pub fn group(&self, id: BodyId) -> u8 {
        self.bodies.find(id).map_or(0, |index| self.bodies.group[index])
    }

    /// 1 / mass of a body; 0 for static and kinematic ones.
    #[inline]
    pub fn inverse_mass(&self, id: BodyId) -> f32 {
        self.bodies.find(id).map_or(0.0, |index| self.bodies.inverse_mass[index])
    }

    /// The factor applied to the world's gravity for a body.
    pub fn gravity_scale(&self, id: BodyId) -> f32 {
        self.bodies.find(id).map_or(0.0, |index| self.bodies.gravity_scale[index])
    }

    /// Adds a spring, or returns `false` if `springs_max` is reached. Panics if numbers are outside
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
        assert!(self.settings.forces.is_some(), "a spring in a world without forces");
        self.wake(&[spring.body]);
        self.wake(other.as_slice());
        self.forces.add_spring(spring)
    }

    /// All springs, in the order in which they were added.
    pub fn springs(&self) -> &[Spring] {
        &self.forces.springs
    }

    /// Sets a position. Panics unless it is finite.
    pub fn set_position(&mut self, id: BodyId, position: Vec2) {
        check::vector(position.is_finite(), "position", position);
        let Some(index) = self.bodies.find(id) else { return };
        if self.settings.sleeping && self.bodies.center[index] == position {
            return;
        }
        self.wake(&[id]);
        self.pairs.remove_static(id.index);
        self.bodies.center[index] = position;
        self.pairs.invalidate();
        self.steady.readmit_if_fixed(&mut self.bodies, id);
        let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
        self.sleep.body_placed(&mut awake, id.index);
    }

    /// Sets a velocity. Panics unless it is finite. The velocity of a static body is always zero (C20), and
    /// setting any other is a bug in the caller, like using a removed body.
    pub fn set_velocity(&mut self, id: BodyId, velocity: Vec2) {
        check::vector(velocity.is_finite(), "velocity", velocity);
        let Some(index) = self.bodies.find(id) else { return };
        let still = self.bodies.motion[index] != Motion::Static || velocity == Vec2::ZERO;
        debug_assert!(still, "static body {} cannot have velocity {velocity}", id.index);
        if still && self.bodies.velocity[index] != velocity {
            self.wake(&[id]);
            let stands = |velocity: Vec2| velocity == Vec2::ZERO;
            if stands(self.bodies.velocity[index]) != stands(velocity) {
                self.steady.readmit_if_fixed(&mut self.bodies, id);
            }
            self.bodies.velocity[index] = velocity;
        }
    }

    /// Wakes bodies, along with those that rest on them. Call this before changing many bodies: each
    /// change wakes a body by itself, which takes far longer. Bodies that do not exist are skipped.
    pub fn wake(&mut self, ids: &[BodyId]) {
        self.steady.readmit_around(&mut self.bodies, ids);
        let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
        self.sleep.wake_around(&mut awake, ids);
    }

    /// Sets the factor applied to gravity for a body. Panics unless it is finite.
    pub fn set_gravity_scale(&mut self, id: BodyId, scale: f32) {
        check::number(scale.is_finite(), "gravity scale", scale);
        let Some(index) = self.bodies.find(id) else { return };
        if self.bodies.gravity_scale[index] != scale {
            self.wake(&[id]);
            self.bodies.gravity_scale[index] = scale;
        }
    }

    /// Switches from the relaxation solver to the chapter's solver as printed, or back. Other solvers are not
    /// affected. While it is on, forces do not act. It is a setting, not state.
    pub fn set_listed(&mut self, listed: bool) {
        self.listed = listed;
    }

    /// Changes gravity, units/s^2, and wakes all bodies. It is a setting, not state, so pass the
    /// settings that the world had in order to restore it. Panics unless it is finite.
    pub fn set_gravity(&mut self, gravity: Vec2) {
        check::vector(gravity.is_finite(), "gravity", gravity);
        self.settings.gravity = gravity;
        self.steady.readmit_all(&mut self.bodies);
        let mut awake = awake(&mut self.bodies, &mut self.pairs, &mut self.touches);
        self.sleep.wake_all(&mut awake);
    }

    /// Returns the body with the lowest index among those that strictly contain the point and
    /// satisfy `wanted`.
    pub fn body_at(&self, point: Vec2, wanted: impl Fn(BodyId) -> bool) -> Option<BodyId> {
        self.ids().find(|&id| {
            let index = id.index as usize;
            self.bodies.shape[index].contains(point - self.bodies.center[index]) && wanted(id)
        })
    }

    /// Advances bodies by one step: integrates, finds pairs, solves contacts, and removes the
    /// bodies that left the kill zone. Particles move in [`World::step_particles`], so that rules
    /// can act in between.
    pub fn step(&mut self) {
        self.advance(&mut |_, _| {});
    }

    /// Runs a [`World::step`] that calls `watch` after each phase. Changes made by `watch` are part of the step.
    pub fn step_watched(&mut self, watch: &mut impl FnMut(StepPhase, &mut World)) {
        self.steady.readmit_all(&mut self.bodies);
        self.advance(watch);
    }

    /// Advances particles and emitters by one step, using the bodies' current quantised positions as seen by clients.
    pub fn step_particles(&mut self) {
        if !self.settings.features.particles || self.is_over_budget() {
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

    /// Touches at the end of the latest step, in (a, b) order.
    pub fn touches(&self) -> &[Touch] {
        &self.touches.now
    }

    /// Bodies that left the kill zone in the latest step and were removed.
    pub fn departed(&self) -> &Departed {
        &self.departed
    }

    /// Counts of the latest step.
    pub fn step_counts(&self) -> StepCounts {
        let (moving, pairs) = (self.bodies.moving.len(), self.pairs.pairs.len());
        StepCounts {
            listed: self.pairs.listed,
            springs: self.forces.spring_visits(),
            particles: self.particles.len() as u64,
            ..self.solvers.counts(moving, pairs, self.touches.now.len())
        }
    }

    /// Whether a step needed more than its [`StepBudget`]. That step was aborted, and no more steps are made, so the
    /// game cannot continue. The work in a step depends on when the pair list was built and which islands were left
    /// out, so a restored world may exceed its budget some steps earlier or later.
    pub fn is_over_budget(&self) -> bool {
        self.pairs.is_over() || self.solvers.conjugate.is_over() || self.particles.is_over()
    }

    /// Number of pairs found in the latest step, which [`StepBudget::pairs`] limits.
    pub fn pair_count(&self) -> usize {
        self.pairs.pairs.len()
    }

    /// Whether a body is asleep, that is, at rest and costing nothing. Bodies sleep only in worlds with sleep.
    /// Touches of sleeping bodies are not reported.
    pub fn is_asleep(&self, id: BodyId) -> bool {
        self.bodies.find(id).is_some_and(|index| self.sleep.has(index as u32))
    }

    /// Starts an emitter, or returns `false` if too many are running. Panics if its recipe does not
    /// exist.
    pub fn start_emitter(&mut self, emitter: EmitterDef) -> bool {
        self.settings.features.particles = true;
        self.particles.start(emitter)
    }

    /// The particles and emitters of the world.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The settings of the world, including the features that steps currently handle.
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    /// Whether all positions and velocities are finite, which is true after every step.
    pub fn is_finite(&self) -> bool {
        self.bodies.slots().all(|slot| self.bodies.is_finite(slot as usize))
    }
}

/// Creates an empty set of particles for a world with these settings.
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
