//! Sleep: islands at rest leave the step, until something happens to them.
//!
//! An island is all that rows join through bodies that can be pushed. It falls asleep as a whole
//! once each of its bodies has been still for half a second and something that does not move holds
//! it up: then its speeds are zero, and its impulses and touches are put aside, in one [`Dormant`].
//! "Still" is measured by what gravity gives in a step, g h: who flies changes by g h in every step
//! and so is never below a small share of it twice in a row, however weak gravity is. It wakes as a
//! whole: by a row to anybody awake, by any change made to one of its bodies, or when what does not
//! move and is near it comes, goes or starts to move. A kinematic body without speed is asleep by
//! itself; awake, it wakes whom it touches.
//!
//! Who sleeps is in no list that a step runs through, and pairs are found as with static bodies
//! (`pairs::still`). (After Catto 2022, "Simulation islands"; the measure of stillness is our own.)

use super::{Touch, World};
use crate::bodies::{Bodies, REACH_MIN};
use crate::body::Motion;
use crate::features::CAN;
use crate::forces::SpringEnd;
use crate::math::min;
use crate::pairs::Pair;
use glam::Vec2;

/// How long all bodies of an island are still before it sleeps, seconds.
const STILL_SECONDS: f32 = 0.5;
/// Largest share of gravity's gain in a step that a still body's speed is.
const STILL_SHARE: f32 = 0.06;
/// Largest speed of a still body, units/s.
const STILL_SPEED: f32 = 0.05;
/// Largest speed of a still body that gravity does not move, units/s.
const STILL_ADRIFT: f32 = 1e-5;
/// How often a step may wake islands one after the other; then all wake.
const ROUNDS_MAX: u32 = 16;
/// Not asleep.
pub(super) const AWAKE: u32 = u32::MAX;

/// The lowest slot of the sleeping island, or [`AWAKE`], and the steps for which a body was still.
pub(super) type Rest = (u32, u16);

/// Who sleeps, and for how long the others have been still.
#[derive(Clone, Debug, Default)]
pub(super) struct Sleep {
    /// By slot: steps in a row in which the body was still.
    pub rested: Vec<u16>,
    /// By slot: place of its sleeping island, or [`AWAKE`].
    pub island: Vec<u32>,
    /// Sleeping islands; those without bodies are vacant.
    pub islands: Vec<Dormant>,
    vacant: Vec<u32>,
    /// Scratch: the way to the slot that stands for the island, and, of that slot, what is known.
    parent: Vec<u32>,
    repose: Vec<Repose>,
    /// Scratch: islands to wake.
    called: Vec<u32>,
    /// Slot, place and velocity of whoever was awake when the step began or was woken since, and how
    /// often somebody was.
    memory: Vec<(u32, Vec2, Vec2)>,
    woken: u32,
}

/// A sleeping island.
#[derive(Clone, Debug, Default)]
pub(super) struct Dormant {
    /// Slots, ascending.
    pub bodies: Vec<u32>,
    /// Where they lie: a step that wakes them may have moved them.
    places: Vec<Vec2>,
    /// Pairs that pressed when it fell asleep, in (a, b) order.
    pub pairs: Vec<Pair>,
    /// What touched then, in (a, b) order.
    pub touches: Vec<Touch>,
}

/// What is known of an island that is awake.
#[derive(Clone, Copy, Debug)]
struct Repose {
    /// All its bodies have been still for long enough.
    still: bool,
    /// Something that does not move presses on it, or gravity moves none of it.
    held: bool,
    /// Place of the sleeping island that it becomes.
    place: u32,
}

impl Sleep {
    /// Makes room for the bodies that there are.
    fn reserve(&mut self, slots: usize) {
        self.rested.resize(slots, 0);
        self.island.resize(slots, AWAKE);
        self.parent.resize(slots, 0);
        self.repose.resize(slots, Repose { still: false, held: false, place: AWAKE });
    }

    /// Whether the body in the slot sleeps.
    #[inline]
    pub fn has(&self, slot: u32) -> bool {
        CAN.sleeping && self.island.get(slot as usize).is_some_and(|&island| island != AWAKE)
    }

    /// Whether nobody sleeps.
    fn is_empty(&self) -> bool {
        !CAN.sleeping || self.vacant.len() == self.islands.len()
    }

    /// A place for a new sleeping island.
    fn found(&mut self) -> u32 {
        self.vacant.pop().unwrap_or_else(|| {
            self.islands.push(Dormant::default());
            self.islands.len() as u32 - 1
        })
    }

    /// The slot that stands for the island; halves the way to it.
    fn root(&mut self, mut slot: u32) -> u32 {
        let parent = &mut self.parent;
        while parent[slot as usize] != slot {
            let grand = parent[parent[slot as usize] as usize];
            parent[slot as usize] = grand;
            slot = grand;
        }
        slot
    }

    /// Makes one island of two.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

impl World {
    /// Whether a body sleeps: it is at rest and costs nothing. Only in worlds that sleep. Its
    /// touches are not reported. Panics if the body is gone.
    pub fn is_asleep(&self, id: super::BodyId) -> bool {
        self.sleep.has(self.bodies.index(id) as u32)
    }

    /// Number of bodies that sleep.
    pub fn asleep_count(&self) -> usize {
        self.sleep.islands.iter().map(|island| island.bodies.len()).sum()
    }

    // --- Falling asleep -------------------------------------------------------------------------

    /// The end of a step: islands that have been at rest for long enough fall asleep.
    pub(super) fn fall_asleep(&mut self) {
        self.sleep.reserve(self.bodies.alive.len());
        if self.count_rested() {
            self.find_islands();
            if self.lay_islands() {
                self.put_pairs_aside();
                self.put_touches_aside();
                let island = &self.sleep.island;
                self.bodies.moving.retain(|&slot| island[slot as usize] == AWAKE);
            }
        }
    }

    /// Counts the steps in which bodies were still; whether somebody has been for long enough.
    fn count_rested(&mut self) -> bool {
        let enough = self.rested_enough();
        let mut any = false;
        for place in 0..self.bodies.moving.len() {
            let slot = self.bodies.moving[place] as usize;
            let steps = if self.is_still(slot) { self.sleep.rested[slot] + 1 } else { 0 };
            self.sleep.rested[slot] = steps.min(enough);
            any |= steps >= enough || self.bodies.motion[slot] == Motion::Kinematic;
        }
        // A spring under tension may let go of a body that stands still for long.
        for spring in self.forces.iter().flat_map(|forces| forces.springs()) {
            self.sleep.rested[spring.body.index as usize] = 0;
            if let SpringEnd::Body(other) = spring.end {
                self.sleep.rested[other.index as usize] = 0;
            }
        }
        any
    }

    /// Steps in [`STILL_SECONDS`].
    fn rested_enough(&self) -> u16 {
        let steps = STILL_SECONDS / self.settings.dt;
        // At least two: who flies is still for one at most.
        (steps.ceil() as u16).clamp(2, u16::MAX - 1)
    }

    /// Whether a body was at rest in this step. Whatever else can move a body says so here.
    fn is_still(&self, slot: usize) -> bool {
        let velocity = self.bodies.velocity[slot];
        if self.bodies.motion[slot] == Motion::Kinematic {
            return velocity == Vec2::ZERO;
        }
        let gain = self.gain(slot);
        let limit = if gain > 0.0 {
            min(gain * STILL_SHARE, min(STILL_SPEED, self.settings.speed_max * STILL_SHARE))
        } else {
            STILL_ADRIFT
        };
        velocity.length_squared() <= limit * limit
    }

    /// What gravity gives a body in a step, units/s.
    fn gain(&self, slot: usize) -> f32 {
        (self.settings.gravity * self.bodies.gravity_scale[slot]).length() * self.settings.dt
    }

    /// Joins bodies to islands, and finds out which are at rest. Whatever else joins bodies, or
    /// holds one up, says so here.
    fn find_islands(&mut self) {
        let enough = self.rested_enough();
        for &slot in &self.bodies.moving {
            self.sleep.parent[slot as usize] = slot;
        }
        for row in &self.workspace.rows {
            if row.is_free() {
                self.sleep.join(row.a, row.b);
            } else {
                // What moves by itself keeps awake whom it touches.
                let (free, fixed) =
                    if row.weight_a > 0.0 { (row.a, row.b) } else { (row.b, row.a) };
                if self.bodies.velocity[fixed as usize] != Vec2::ZERO {
                    self.sleep.rested[free as usize] = 0;
                }
            }
        }
        for &slot in &self.bodies.moving {
            self.sleep.repose[slot as usize] = Repose { still: true, held: true, place: AWAKE };
        }
        for place in 0..self.bodies.moving.len() {
            let slot = self.bodies.moving[place];
            let root = self.sleep.root(slot) as usize;
            let kinematic = self.bodies.motion[slot as usize] == Motion::Kinematic;
            let wanted = if kinematic { 1 } else { enough };
            self.sleep.repose[root].still &= self.sleep.rested[slot as usize] >= wanted;
            self.sleep.repose[root].held &= kinematic || self.gain(slot as usize) == 0.0;
        }
        for place in 0..self.workspace.rows.len() {
            let row = self.workspace.rows[place];
            if row.press > 0.0 && !row.is_free() {
                let root = self.sleep.root(if row.weight_a > 0.0 { row.a } else { row.b });
                self.sleep.repose[root as usize].held = true;
            }
        }
    }

    /// Lays the bodies of islands at rest to sleep; whether there are any.
    fn lay_islands(&mut self) -> bool {
        let mut any = false;
        for place in 0..self.bodies.moving.len() {
            let slot = self.bodies.moving[place];
            let root = self.sleep.root(slot) as usize;
            let Repose { still, held, place } = self.sleep.repose[root];
            if !(still && held) {
                continue;
            }
            any = true;
            let place = if place == AWAKE { self.sleep.found() } else { place };
            self.sleep.repose[root].place = place;
            self.lay(slot, place);
        }
        any
    }

    /// Lays a body to sleep in an island; it stays in the moving list.
    pub(super) fn lay(&mut self, slot: u32, place: u32) {
        let index = slot as usize;
        self.sleep.reserve(self.bodies.alive.len());
        self.sleep.island[index] = place;
        self.sleep.islands[place as usize].bodies.push(slot);
        self.sleep.islands[place as usize].places.push(self.bodies.center[index]);
        self.sleep.rested[index] = 0;
        self.bodies.velocity[index] = Vec2::ZERO;
        self.bodies.reach[index] = REACH_MIN;
        self.pairs.lay(slot, &self.bodies);
    }

    /// The sleeping island to which what two bodies share belongs, if any.
    pub(super) fn dormant_of(&mut self, a: u32, b: u32) -> Option<&mut Dormant> {
        let sleeps = |&slot: &u32| {
            self.sleep.has(slot) && self.bodies.motion[slot as usize] == Motion::Dynamic
        };
        let slot = [a, b].into_iter().find(sleeps)?;
        Some(&mut self.sleep.islands[self.sleep.island[slot as usize] as usize])
    }

    /// Pairs of which neither body moves any more leave the list; those that pressed are kept.
    fn put_pairs_aside(&mut self) {
        let mut pairs = std::mem::take(&mut self.pairs.pairs);
        pairs.retain_mut(|pair| {
            let Some(dormant) = self.dormant_of(pair.a, pair.b) else { return true };
            if pair.normal_impulse > 0.0 {
                dormant.pairs.push(*pair);
                pair.forget();
            }
            let awake = |slot: u32| {
                self.bodies.motion[slot as usize] != Motion::Static && !self.sleep.has(slot)
            };
            awake(pair.a) || awake(pair.b)
        });
        self.pairs.pairs = pairs;
    }

    fn put_touches_aside(&mut self) {
        let mut touches = std::mem::take(&mut self.touches);
        touches.retain(|touch| match self.dormant_of(touch.a.index, touch.b.index) {
            Some(dormant) => {
                dormant.touches.push(*touch);
                false
            }
            None => true,
        });
        self.touches = touches;
    }

    // --- Waking ---------------------------------------------------------------------------------

    /// The start of a step: remembers where it begins, if anybody sleeps.
    pub(super) fn remember(&mut self) {
        self.sleep.woken = 0;
        self.sleep.memory.clear();
        if !self.sleep.is_empty() {
            let Bodies { moving, center, velocity, .. } = &self.bodies;
            let place = |&slot: &u32| (slot, center[slot as usize], velocity[slot as usize]);
            self.sleep.memory.extend(moving.iter().map(place));
        }
    }

    /// Wakes whoever has met somebody awake in this step, and takes all back to where it began: it is
    /// to be made again, as if they had not slept. Whether there was anybody.
    pub(super) fn wake_touched(&mut self) -> bool {
        if self.sleep.is_empty() {
            return false;
        }
        for slot in self.workspace.met().flatten() {
            let pushable = self.bodies.inverse_mass[slot as usize] > 0.0;
            if pushable && self.sleep.has(slot) {
                self.sleep.called.push(self.sleep.island[slot as usize]);
            }
        }
        if self.sleep.called.is_empty() {
            return false;
        }
        self.sleep.woken += 1;
        if self.sleep.woken > ROUNDS_MAX {
            self.wake_all();
        } else {
            self.wake_called();
        }
        for &(slot, center, velocity) in &self.sleep.memory {
            self.bodies.center[slot as usize] = center;
            self.bodies.velocity[slot as usize] = velocity;
        }
        true
    }

    /// Something is done to a body: it wakes with its island. If it does not move, whoever sleeps
    /// near it wakes too, because it may rest on it.
    pub(super) fn disturb(&mut self, id: super::BodyId) {
        let slot = self.bodies.index(id) as u32;
        if !self.settings.sleeping {
            return;
        }
        let asleep = self.sleep.has(slot);
        if asleep {
            self.sleep.called.push(self.sleep.island[slot as usize]);
        }
        let motion = self.bodies.motion[slot as usize];
        if motion == Motion::Static || motion == Motion::Kinematic && asleep {
            let Sleep { island, called, .. } = &mut self.sleep;
            self.pairs.near_still(slot, &self.bodies, |other| {
                called.extend(island.get(other as usize).filter(|&&place| place != AWAKE));
            });
        }
        self.wake_called();
    }

    /// A body came, or was put elsewhere. If it does not move, nobody meets it by moving: it is laid
    /// out for others to find, and wakes who sleeps where it is now.
    pub(super) fn welcome(&mut self, id: super::BodyId) {
        if let Some(rested) = self.sleep.rested.get_mut(id.index as usize) {
            *rested = 0;
        }
        if self.settings.sleeping && self.motion(id) == Motion::Static {
            self.pairs.lay(id.index, &self.bodies);
            self.disturb(id);
        }
    }

    /// Wakes everybody.
    pub(super) fn wake_all(&mut self) {
        self.sleep.called.extend(0..self.sleep.islands.len() as u32);
        self.wake_called();
    }

    /// Wakes the islands that were called; whether there was anybody.
    fn wake_called(&mut self) -> bool {
        let mut called = std::mem::take(&mut self.sleep.called);
        let mut any = false;
        for &place in &called {
            // The same island may have been called twice.
            let dormant = std::mem::take(&mut self.sleep.islands[place as usize]);
            if dormant.bodies.is_empty() {
                continue;
            }
            any = true;
            self.sleep.vacant.push(place);
            for (&slot, &place) in dormant.bodies.iter().zip(&dormant.places) {
                self.sleep.island[slot as usize] = AWAKE;
                self.sleep.memory.push((slot, place, Vec2::ZERO));
                self.pairs.lift(slot);
            }
            self.bodies.moving.extend(dormant.bodies);
            self.pairs.pairs.extend(dormant.pairs);
            self.touches.extend(dormant.touches);
        }
        called.clear();
        self.sleep.called = called;
        if any {
            self.bodies.moving.sort_unstable();
            self.pairs.merge();
            self.touches.sort_by_key(|touch| (touch.a.index, touch.b.index));
        }
        any
    }

    // --- State ----------------------------------------------------------------------------------

    /// How the body in a slot rests.
    pub(super) fn rest_of(&self, slot: u32) -> Rest {
        let rested = self.sleep.rested.get(slot as usize).copied().unwrap_or(0);
        match self.dormant(slot) {
            Some(dormant) => (dormant.bodies[0], rested),
            None => (AWAKE, rested),
        }
    }

    /// The island in which the body in a slot sleeps.
    pub(super) fn dormant(&self, slot: u32) -> Option<&Dormant> {
        let island = self.sleep.island.get(slot as usize).copied().unwrap_or(AWAKE);
        self.sleep.islands.get(island as usize)
    }

    /// Lays a restored body to sleep with the island whose lowest slot is `lowest`, or sets for how
    /// long it was still; `false` if that cannot be. Slots come in ascending order.
    pub(super) fn restore_rest(&mut self, slot: u32, (lowest, rested): Rest) -> bool {
        let index = slot as usize;
        self.sleep.reserve(self.bodies.alive.len());
        if self.bodies.motion[index] == Motion::Static {
            return (lowest, rested) == (AWAKE, 0);
        }
        if lowest == AWAKE {
            self.sleep.rested[index] = rested;
            return rested <= self.rested_enough();
        }
        let place = match self.sleep.island.get(lowest as usize) {
            _ if lowest == slot => self.sleep.found(),
            Some(&place) if lowest < slot && place != AWAKE => place,
            _ => return false,
        };
        let dynamic = self.bodies.motion[index] == Motion::Dynamic;
        let first = self.sleep.islands[place as usize].bodies.first().copied();
        let alone = dynamic && self.bodies.motion[lowest as usize] == Motion::Dynamic;
        let fits = first.is_none_or(|first| first == lowest && alone);
        if rested != 0 || self.bodies.velocity[index] != Vec2::ZERO || !fits {
            return false;
        }
        self.lay(slot, place);
        true
    }

    /// After all are restored: sleepers leave the moving list, and what does not move is laid out.
    pub(super) fn settle_rest(&mut self) {
        let Bodies { moving, alive, motion, .. } = &mut self.bodies;
        let island = &self.sleep.island;
        moving.retain(|&slot| island[slot as usize] == AWAKE);
        let fixed = |slot: &usize| alive[*slot] && motion[*slot] == Motion::Static;
        let fixed: Vec<usize> = (0..alive.len()).filter(fixed).collect();
        fixed.into_iter().for_each(|slot| self.pairs.lay(slot as u32, &self.bodies));
    }
}

#[cfg(test)]
mod tests;
