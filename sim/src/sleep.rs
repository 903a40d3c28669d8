//! Islands at rest sleep: the step leaves them out until something happens to them.
//!
//! An island is a set of movable bodies joined by constraints. It falls asleep as a whole once each of its bodies has
//! been still for half a second and an immovable body supports the island. Its velocities are then set to zero, and
//! its impulses and touches are stored in a [`SleepingIsland`]. Stillness is measured relative to the velocity g h
//! that gravity adds in a step. The velocity of a flying body changes by g h in every step, so it is never below a
//! small share of that twice in a row, however weak gravity is. An island also wakes as a whole: when it gets a
//! constraint with an awake body, when one of its bodies is changed in any way, or when an immovable body near it is
//! added, removed or starts to move. A kinematic body without velocity sleeps on its own; an awake one wakes the
//! bodies that it touches.
//!
//! No list over which a step iterates contains sleeping bodies. Their pairs are found like those of static bodies
//! (`broad_phase::static_grid`). (After Catto 2022, "Simulation islands"; the criterion for stillness is our own.)

use crate::bodies::{Bodies, REACH_MIN};
use crate::body::{BodyId, Motion};
use crate::broad_phase::pairs::{Pair, PairList};
use crate::forces::springs::{Spring, SpringEnd};
use crate::math::min;
use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::islands::{self, root};
use crate::touches::{self, Touch};
use crate::world::settings::WorldSettings;
use glam::Vec2;

/// Time for which all bodies of an island must be still before it sleeps, seconds.
const STILL_SECONDS: f32 = 0.5;
/// Largest speed of a still body, as a share of the velocity that gravity adds in a step.
const STILL_SHARE: f32 = 0.06;
/// Largest speed of a still body, units/s.
const STILL_SPEED: f32 = 0.05;
/// Largest speed of a still body without gravity, units/s.
const STILL_SPEED_FLOATING: f32 = 1e-5;
/// Maximum number of times that a step may wake more islands. After that, it wakes all of them.
const WAKE_ROUNDS_MAX: u32 = 16;
/// Takes the place of an island's index if the body is awake.
pub(crate) const AWAKE: u32 = u32::MAX;

/// The lowest slot of a body's sleeping island, or [`AWAKE`], and the number of steps for which the body has been
/// still.
pub(crate) type RestState = (u32, u16);

/// Sleeping islands, and the time for which the other bodies have been still.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sleep {
    /// Whether bodies in this world can sleep.
    is_on: bool,
    /// By slot: number of consecutive steps in which the body was still.
    pub still_steps: Vec<u16>,
    /// By slot: index of its sleeping island, or [`AWAKE`].
    pub island: Vec<u32>,
    /// Sleeping islands; those without bodies are vacant.
    pub islands: Vec<SleepingIsland>,
    vacant: Vec<u32>,
    /// Scratch for union-find over slots and, for each root, the state of its island.
    parent: Vec<u32>,
    states: Vec<IslandState>,
    /// Scratch for islands that are about to wake.
    to_wake: Vec<u32>,
    /// Slot, position and velocity of the bodies that were awake at the start of the step or have been woken since,
    /// and the number of times that islands have been woken.
    step_start: Vec<(u32, Vec2, Vec2)>,
    wake_rounds: u32,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct SleepingIsland {
    /// Slots in ascending order.
    pub bodies: Vec<u32>,
    /// Positions of the bodies, because a step that wakes them may already have moved them.
    positions: Vec<Vec2>,
    /// The pairs that had an impulse when the island fell asleep, in (a, b) order.
    pub pairs: Vec<Pair>,
    /// The touches at the time when the island fell asleep, in (a, b) order.
    pub touches: Vec<Touch>,
}

/// The lists that bodies leave when they fall asleep and join again when they wake.
pub(crate) struct Awake<'a> {
    pub bodies: &'a mut Bodies,
    pub pairs: &'a mut PairList,
    pub touches: &'a mut Vec<Touch>,
}

/// State of an awake island.
#[derive(Clone, Copy, Debug)]
struct IslandState {
    /// Whether all its bodies have been still for long enough.
    still: bool,
    /// Whether an immovable body supports it, or gravity affects none of its bodies.
    held: bool,
    /// Index of the sleeping island that it becomes.
    sleeping: u32,
}

impl Sleep {
    pub fn new(is_on: bool) -> Sleep {
        Sleep { is_on, ..Sleep::default() }
    }

    /// Makes room for `slots` bodies.
    fn reserve(&mut self, slots: usize) {
        self.still_steps.resize(slots, 0);
        self.island.resize(slots, AWAKE);
        self.parent.resize(slots, 0);
        self.states.resize(slots, IslandState { still: false, held: false, sleeping: AWAKE });
    }

    /// Whether the body in the slot is asleep.
    #[inline]
    pub fn has(&self, slot: u32) -> bool {
        self.island.get(slot as usize).is_some_and(|&island| island != AWAKE)
    }

    /// Number of sleeping bodies.
    #[cfg(test)]
    pub fn count(&self) -> usize {
        self.islands.iter().map(|island| island.bodies.len()).sum()
    }

    /// Whether no body is asleep.
    fn is_empty(&self) -> bool {
        self.vacant.len() == self.islands.len()
    }

    /// Returns the index of a new sleeping island.
    fn allocate_island(&mut self) -> u32 {
        self.vacant.pop().unwrap_or_else(|| {
            self.islands.push(SleepingIsland::default());
            self.islands.len() as u32 - 1
        })
    }

    fn join(&mut self, a: u32, b: u32) {
        islands::join(&mut self.parent, a, b);
    }
}

impl Sleep {
    // --- Falling asleep -------------------------------------------------------------------------

    /// At the end of a step, puts islands to sleep that have been at rest for long enough.
    pub fn fall_asleep(
        &mut self,
        awake: &mut Awake,
        constraints: &[ContactConstraint],
        springs: &[Spring],
        settings: &WorldSettings,
    ) {
        self.reserve(awake.bodies.alive.len());
        if self.count_still_steps(awake.bodies, springs, settings) {
            self.find_islands(awake.bodies, constraints, settings);
            if self.put_islands_to_sleep(awake) {
                self.store_pairs(awake);
                self.store_touches(awake);
                let island = &self.island;
                awake.bodies.moving.retain(|&slot| island[slot as usize] == AWAKE);
            }
        }
    }

    /// Counts the steps in which bodies were still, and returns whether any body has been still for long enough.
    fn count_still_steps(
        &mut self,
        bodies: &Bodies,
        springs: &[Spring],
        settings: &WorldSettings,
    ) -> bool {
        let enough = steps_to_sleep(settings);
        let mut any = false;
        for &slot in &bodies.moving {
            let slot = slot as usize;
            let steps =
                if is_still(bodies, slot, settings) { self.still_steps[slot] + 1 } else { 0 };
            self.still_steps[slot] = steps.min(enough);
            any |= steps >= enough || bodies.motion[slot] == Motion::Kinematic;
        }
        // A stretched spring may pull away a body that has been still for a long time.
        for spring in springs {
            self.still_steps[spring.body.index as usize] = 0;
            if let SpringEnd::Body(other) = spring.end {
                self.still_steps[other.index as usize] = 0;
            }
        }
        any
    }

    /// Joins bodies into islands and finds the islands at rest. Every mechanism that joins or supports bodies must be
    /// considered here.
    fn find_islands(
        &mut self,
        bodies: &Bodies,
        constraints: &[ContactConstraint],
        settings: &WorldSettings,
    ) {
        let enough = steps_to_sleep(settings);
        // Bodies that left the world at the end of the step no longer belong to an island.
        let lives = |slot: u32| bodies.alive[slot as usize];
        let both_live = |c: &&ContactConstraint| lives(c.a) && lives(c.b);
        for &slot in &bodies.moving {
            self.parent[slot as usize] = slot;
            self.states[slot as usize] = IslandState { still: true, held: true, sleeping: AWAKE };
        }
        for constraint in constraints.iter().filter(both_live) {
            if constraint.is_free() {
                self.join(constraint.a, constraint.b);
            } else {
                // A moving kinematic body keeps the bodies that it touches awake.
                let (free, fixed) = if constraint.inv_mass_a > 0.0 {
                    (constraint.a, constraint.b)
                } else {
                    (constraint.b, constraint.a)
                };
                if bodies.velocity[fixed as usize] != Vec2::ZERO {
                    self.still_steps[free as usize] = 0;
                }
            }
        }
        for &slot in &bodies.moving {
            let root = root(&mut self.parent, slot) as usize;
            let kinematic = bodies.motion[slot as usize] == Motion::Kinematic;
            let wanted = if kinematic { 1 } else { enough };
            self.states[root].still &= self.still_steps[slot as usize] >= wanted;
            self.states[root].held &=
                kinematic || gravity_gain(bodies, slot as usize, settings) == 0.0;
        }
        for constraint in constraints.iter().filter(both_live) {
            if constraint.normal_impulse > 0.0 && !constraint.is_free() {
                let movable = if constraint.inv_mass_a > 0.0 { constraint.a } else { constraint.b };
                self.states[root(&mut self.parent, movable) as usize].held = true;
            }
        }
    }

    /// Puts the bodies of islands at rest to sleep, and returns whether there were any.
    fn put_islands_to_sleep(&mut self, awake: &mut Awake) -> bool {
        let mut any = false;
        for index in 0..awake.bodies.moving.len() {
            let slot = awake.bodies.moving[index];
            let root = root(&mut self.parent, slot) as usize;
            let IslandState { still, held, sleeping } = self.states[root];
            if !(still && held) {
                continue;
            }
            any = true;
            let island = if sleeping == AWAKE { self.allocate_island() } else { sleeping };
            self.states[root].sleeping = island;
            self.put_to_sleep(awake.bodies, awake.pairs, slot, island);
        }
        any
    }

    /// Puts a body to sleep in an island. The body stays in the moving list.
    fn put_to_sleep(&mut self, bodies: &mut Bodies, pairs: &mut PairList, slot: u32, island: u32) {
        let index = slot as usize;
        self.reserve(bodies.alive.len());
        self.island[index] = island;
        self.islands[island as usize].bodies.push(slot);
        self.islands[island as usize].positions.push(bodies.center[index]);
        self.still_steps[index] = 0;
        bodies.velocity[index] = Vec2::ZERO;
        bodies.reach[index] = REACH_MIN;
        pairs.insert_static(slot, bodies);
    }

    /// Returns the sleeping island that stores the pair of these bodies, if any.
    pub fn island_of(&mut self, bodies: &Bodies, a: u32, b: u32) -> Option<&mut SleepingIsland> {
        let sleeps =
            |&slot: &u32| self.has(slot) && bodies.motion[slot as usize] == Motion::Dynamic;
        let slot = [a, b].into_iter().find(sleeps)?;
        Some(&mut self.islands[self.island[slot as usize] as usize])
    }

    /// Removes pairs of which neither body moves any longer from the list. The island keeps those with an impulse.
    fn store_pairs(&mut self, awake: &mut Awake) {
        let bodies = &*awake.bodies;
        awake.pairs.pairs.retain_mut(|pair| {
            let Some(island) = self.island_of(bodies, pair.a, pair.b) else { return true };
            if pair.normal_impulse > 0.0 {
                island.pairs.push(*pair);
                pair.clear_impulses();
            }
            let awake =
                |slot: u32| bodies.motion[slot as usize] != Motion::Static && !self.has(slot);
            awake(pair.a) || awake(pair.b)
        });
    }

    fn store_touches(&mut self, awake: &mut Awake) {
        let bodies = &*awake.bodies;
        awake.touches.retain(|touch| match self.island_of(bodies, touch.a.index, touch.b.index) {
            Some(island) => {
                island.touches.push(*touch);
                false
            }
            None => true,
        });
    }

    // --- Waking ---------------------------------------------------------------------------------

    /// Saves the state at the start of the step if any body is asleep.
    pub fn save_step_start(&mut self, bodies: &Bodies) {
        self.wake_rounds = 0;
        self.step_start.clear();
        if !self.is_empty() {
            let Bodies { moving, center, velocity, .. } = bodies;
            let entry = |&slot: &u32| (slot, center[slot as usize], velocity[slot as usize]);
            self.step_start.extend(moving.iter().map(entry));
        }
    }

    /// Wakes the islands that an awake body met in this step, and resets all bodies to their state at the start of
    /// the step, which is then repeated as if the islands had not been asleep. Returns whether any island woke.
    pub fn wake_touched(&mut self, awake: &mut Awake, met: impl Iterator<Item = [u32; 2]>) -> bool {
        if self.is_empty() {
            return false;
        }
        for slot in met.flatten() {
            if awake.bodies.inverse_mass[slot as usize] > 0.0 && self.has(slot) {
                self.to_wake.push(self.island[slot as usize]);
            }
        }
        if self.to_wake.is_empty() {
            return false;
        }
        self.wake_rounds += 1;
        if self.wake_rounds > WAKE_ROUNDS_MAX {
            self.wake_all(awake);
        } else {
            self.wake_pending(awake);
        }
        for &(slot, center, velocity) in &self.step_start {
            awake.bodies.center[slot as usize] = center;
            awake.bodies.velocity[slot as usize] = velocity;
        }
        true
    }

    /// Wakes bodies that are changed from outside, along with their islands. If such a body does not move, the
    /// bodies sleeping near it wake too, because they may rest on it.
    pub fn wake_around(&mut self, awake: &mut Awake, ids: &[BodyId]) {
        if !self.is_on {
            return;
        }
        for id in ids {
            if awake.bodies.contains(*id) {
                self.find_around(awake, id.index);
            }
        }
        self.wake_pending(awake);
    }

    /// Adds the islands that wake with a body to `to_wake`.
    fn find_around(&mut self, awake: &mut Awake, slot: u32) {
        let asleep = self.has(slot);
        if asleep {
            self.to_wake.push(self.island[slot as usize]);
        }
        let motion = awake.bodies.motion[slot as usize];
        let rests = asleep || awake.bodies.velocity[slot as usize] == Vec2::ZERO;
        if motion == Motion::Static || motion == Motion::Kinematic && rests {
            // The reach from its last motion is not saved, so a restored world starts from the minimum.
            awake.bodies.reach[slot as usize] = REACH_MIN;
            let Sleep { island, to_wake, .. } = self;
            awake.pairs.for_each_static_near(slot, awake.bodies, |other| {
                to_wake.extend(island.get(other as usize).filter(|&&island| island != AWAKE));
            });
        }
    }

    /// Registers a body that was added or repositioned. A static body is inserted into the grid, since it never moves
    /// and thus never finds pairs itself, and wakes the bodies that sleep near its new position.
    pub fn body_placed(&mut self, awake: &mut Awake, slot: u32) {
        if !self.is_on {
            return;
        }
        if let Some(still_steps) = self.still_steps.get_mut(slot as usize) {
            *still_steps = 0;
        }
        if awake.bodies.motion[slot as usize] == Motion::Static {
            awake.pairs.insert_static(slot, awake.bodies);
            self.find_around(awake, slot);
            self.wake_pending(awake);
        }
    }

    pub fn wake_all(&mut self, awake: &mut Awake) {
        self.to_wake.extend(0..self.islands.len() as u32);
        self.wake_pending(awake);
    }

    /// Wakes the islands in `to_wake`.
    fn wake_pending(&mut self, awake: &mut Awake) {
        let mut to_wake = std::mem::take(&mut self.to_wake);
        let mut any = false;
        for &island in &to_wake {
            // The same island may be listed twice.
            let sleeping = std::mem::take(&mut self.islands[island as usize]);
            if sleeping.bodies.is_empty() {
                continue;
            }
            any = true;
            self.vacant.push(island);
            for (&slot, &position) in sleeping.bodies.iter().zip(&sleeping.positions) {
                self.island[slot as usize] = AWAKE;
                self.step_start.push((slot, position, Vec2::ZERO));
                awake.pairs.remove_static(slot);
            }
            awake.bodies.moving.extend(sleeping.bodies);
            awake.pairs.pairs.extend(sleeping.pairs);
            awake.touches.extend(sleeping.touches);
        }
        to_wake.clear();
        self.to_wake = to_wake;
        if any {
            awake.bodies.moving.sort_unstable();
            awake.pairs.merge();
            touches::sort(awake.touches);
        }
    }

    // --- State ----------------------------------------------------------------------------------

    /// The sleep state of the body in a slot.
    pub fn rest_of(&self, slot: u32) -> RestState {
        let still_steps = self.still_steps.get(slot as usize).copied().unwrap_or(0);
        match self.sleeping(slot) {
            Some(sleeping) => (sleeping.bodies[0], still_steps),
            None => (AWAKE, still_steps),
        }
    }

    /// Returns the island in which the body in a slot sleeps.
    pub fn sleeping(&self, slot: u32) -> Option<&SleepingIsland> {
        let island = self.island.get(slot as usize).copied().unwrap_or(AWAKE);
        self.islands.get(island as usize)
    }

    /// Puts a restored body to sleep in the island whose lowest slot is `lowest`, or sets its number of still
    /// steps. Returns `false` if that is impossible. Slots must be given in ascending order.
    pub fn restore_rest(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut PairList,
        slot: u32,
        (lowest, still_steps): RestState,
        settings: &WorldSettings,
    ) -> bool {
        let index = slot as usize;
        self.reserve(bodies.alive.len());
        if bodies.motion[index] == Motion::Static {
            return (lowest, still_steps) == (AWAKE, 0);
        }
        if lowest == AWAKE {
            self.still_steps[index] = still_steps;
            return still_steps <= steps_to_sleep(settings);
        }
        let island = match self.island.get(lowest as usize) {
            _ if lowest == slot => self.allocate_island(),
            Some(&island) if lowest < slot && island != AWAKE => island,
            _ => return false,
        };
        let dynamic = bodies.motion[index] == Motion::Dynamic;
        let first = self.islands[island as usize].bodies.first().copied();
        let alone = dynamic && bodies.motion[lowest as usize] == Motion::Dynamic;
        let fits = first.is_none_or(|first| first == lowest && alone);
        if still_steps != 0 || bodies.velocity[index] != Vec2::ZERO || !fits {
            return false;
        }
        self.put_to_sleep(bodies, pairs, slot, island);
        true
    }

    /// Completes a restore by removing sleeping bodies from the moving list and inserting the static ones into the
    /// grid.
    pub fn finish_restore(&self, bodies: &mut Bodies, pairs: &mut PairList) {
        bodies.moving.retain(|&slot| self.island[slot as usize] == AWAKE);
        for slot in 0..bodies.alive.len() {
            if bodies.alive[slot] && bodies.motion[slot] == Motion::Static {
                pairs.insert_static(slot as u32, bodies);
            }
        }
    }
}

/// Number of steps in [`STILL_SECONDS`].
fn steps_to_sleep(settings: &WorldSettings) -> u16 {
    let steps = STILL_SECONDS / settings.dt;
    // At least two, since a flying body is still for at most one step.
    (steps.ceil() as u16).clamp(2, u16::MAX - 1)
}

/// Whether a body was at rest in this step. Every mechanism that moves bodies must be considered
/// here.
fn is_still(bodies: &Bodies, slot: usize, settings: &WorldSettings) -> bool {
    let velocity = bodies.velocity[slot];
    if bodies.motion[slot] == Motion::Kinematic {
        return velocity == Vec2::ZERO;
    }
    let gravity_gain = gravity_gain(bodies, slot, settings);
    let limit = if gravity_gain > 0.0 {
        min(gravity_gain * STILL_SHARE, min(STILL_SPEED, settings.speed_max * STILL_SHARE))
    } else {
        STILL_SPEED_FLOATING
    };
    velocity.length_squared() <= limit * limit
}

/// Velocity that gravity adds to a body in a step, units/s.
fn gravity_gain(bodies: &Bodies, slot: usize, settings: &WorldSettings) -> f32 {
    (settings.gravity * bodies.gravity_scale[slot]).length() * settings.dt
}

#[cfg(test)]
mod tests;
