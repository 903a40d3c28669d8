//! Steady islands are those that a step leaves unchanged, bit for bit, so that the next step can leave them out.
//!
//! A pile at rest reaches a fixed point of the conjugate solver, where positions, velocities and impulses no longer
//! change. A step is a function of its inputs, so while nothing that it reads for an island changes, it would compute
//! the same result again. The bodies of such an island leave the list of moving bodies, while its impulses stay in
//! the pair list and its touches in the list of touches. Unlike sleep, this is not state. There is no threshold,
//! nothing is set to zero, and a world that leaves nothing out has the same bits in every step.
//!
//! An island is readmitted when something that is not steady meets it, through a constraint or an impact. The step is
//! then repeated from its start with the island included. It is also readmitted when one of its bodies is changed
//! from outside. All islands are readmitted when a static or kinematic body is added, removed, repositioned, started
//! or stopped, since they may rest on it.

use crate::bodies::Bodies;
use crate::body::{BodyId, Motion};
use crate::shape::Aabb;
use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::islands::Islands;
use glam::Vec2;

/// Takes the place of an island's index if there is no island.
const NONE: u32 = u32::MAX;
/// Maximum number of times that a step is repeated because islands were met. After that, all islands are readmitted.
const REPEATS_MAX: u32 = 2;

/// The steady islands of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steady {
    /// Slots of the steady bodies, ascending.
    bodies: Vec<u32>,
    /// By slot: the lowest slot of its steady island, or [`NONE`].
    island: Vec<u32>,
    /// By slot: whether the body is steady, or is immovable and at rest. Pairs of such bodies take no part in a
    /// step.
    pub takes_no_part: Vec<bool>,
    /// By slot: positions and velocities at the start of the step.
    center: Vec<Vec2>,
    velocity: Vec<Vec2>,
    /// Scratch for islands that are about to be readmitted.
    to_readmit: Vec<u32>,
    /// Whether this step may leave islands out of the next one.
    pub is_on: bool,
    /// Number of times that the step was repeated.
    repeats: u32,
    /// Whether to leave nothing out, in order to compare the bits.
    #[cfg(test)]
    pub is_off: bool,
}

/// The contacts of a step.
#[derive(Clone, Copy)]
pub(crate) struct StepContacts<'a> {
    pub constraints: &'a [ContactConstraint],
    pub islands: &'a Islands,
    /// By constraint: whether its impulses differ from those before the step.
    pub is_changed: &'a [bool],
}

impl Steady {
    /// Number of steady bodies.
    pub fn count(&self) -> usize {
        self.bodies.len()
    }

    /// Whether a body is steady.
    #[inline]
    pub fn has(&self, slot: u32) -> bool {
        self.island.get(slot as usize).is_some_and(|&island| island != NONE)
    }

    /// Begins a step, saving its start if it may leave islands out of the next one.
    pub fn begin(&mut self, bodies: &Bodies, is_on: bool) {
        self.is_on = is_on;
        self.repeats = 0;
        #[cfg(test)]
        {
            self.is_on &= !self.is_off;
        }
        if !self.is_on {
            self.takes_no_part.clear();
            self.takes_no_part.resize(bodies.alive.len(), false);
            return;
        }
        self.island.resize(bodies.alive.len(), NONE);
        self.center.clone_from(&bodies.center);
        self.velocity.clone_from(&bodies.velocity);
        self.find_parts(bodies);
    }

    fn find_parts(&mut self, bodies: &Bodies) {
        self.takes_no_part.clear();
        let fixed = bodies.inverse_mass.iter().zip(&bodies.velocity);
        let fixed = fixed.map(|(&inv_mass, &velocity)| inv_mass == 0.0 && velocity == Vec2::ZERO);
        let takes_no_part = fixed.zip(&self.island).map(|(fixed, &island)| fixed || island != NONE);
        self.takes_no_part.extend(takes_no_part);
    }

    /// Readmits the islands that a moving body met in this step, and resets all bodies to the start of the step.
    /// Returns whether there were any, so that the step must be repeated.
    pub fn readmit_met(
        &mut self,
        bodies: &mut Bodies,
        met: impl Iterator<Item = [u32; 2]>,
    ) -> bool {
        if self.bodies.is_empty() {
            return false;
        }
        let islands = met.flatten().map(|slot| self.island[slot as usize]);
        self.to_readmit.extend(islands.filter(|&island| island != NONE));
        if self.to_readmit.is_empty() {
            return false;
        }
        self.repeats += 1;
        if self.repeats > REPEATS_MAX {
            self.to_readmit.clear();
            self.readmit_all(bodies);
        } else {
            self.readmit_pending(bodies);
        }
        bodies.center.clone_from(&self.center);
        bodies.velocity.clone_from(&self.velocity);
        self.find_parts(bodies);
        true
    }

    /// Readmits the steady islands that contain bodies which are changed from outside.
    pub fn readmit_around(&mut self, bodies: &mut Bodies, ids: &[BodyId]) {
        for id in ids {
            let island = self.island.get(id.index as usize).copied().unwrap_or(NONE);
            if island != NONE && bodies.contains(*id) {
                self.to_readmit.push(island);
            }
        }
        self.readmit_pending(bodies);
    }

    /// Readmits all islands if a body that nothing can push appears, disappears, starts or stops.
    pub fn readmit_if_fixed(&mut self, bodies: &mut Bodies, id: BodyId) {
        if bodies.motion[id.index as usize] != Motion::Dynamic {
            self.readmit_all(bodies);
        }
    }

    pub fn readmit_all(&mut self, bodies: &mut Bodies) {
        self.to_readmit.extend(self.bodies.iter().map(|&slot| self.island[slot as usize]));
        self.readmit_pending(bodies);
    }

    fn readmit_pending(&mut self, bodies: &mut Bodies) {
        let Steady { bodies: steady, island, to_readmit, .. } = self;
        if to_readmit.is_empty() {
            return;
        }
        to_readmit.sort_unstable();
        to_readmit.dedup();
        for &slot in steady.iter() {
            let own = &mut island[slot as usize];
            if to_readmit.binary_search(own).is_ok() {
                *own = NONE;
                bodies.moving.push(slot);
            }
        }
        to_readmit.clear();
        steady.retain(|&slot| island[slot as usize] != NONE);
        bodies.moving.sort_unstable();
    }

    /// Leaves out the islands that the step did not change and from which no body departs. `reach` returns the reach
    /// with which a body of a given velocity begins a step.
    pub fn leave_out(
        &mut self,
        bodies: &mut Bodies,
        contacts: StepContacts,
        kill_zone: &Aabb,
        reach: impl Fn(Vec2) -> f32,
    ) {
        let StepContacts { constraints, islands, is_changed } = contacts;
        let before = self.bodies.len();
        for number in 0..islands.count() {
            let island = &islands.constraints[islands.range(number)];
            let is_steady = |&index: &u32| {
                let constraint = &constraints[index as usize];
                let stays = |&(slot, _): &(u32, f32)| {
                    let is_inside = kill_zone.contains(bodies.center[slot as usize]);
                    self.is_unchanged(bodies, slot) && is_inside
                };
                !is_changed[index as usize] && constraint.bodies().iter().all(stays)
            };
            if !island.iter().all(is_steady) {
                continue;
            }
            let slots = || {
                let ends = island.iter().flat_map(|&index| constraints[index as usize].bodies());
                ends.filter(|&(_, inv_mass)| inv_mass > 0.0).map(|(slot, _)| slot)
            };
            let lowest = slots().min().unwrap_or(NONE);
            for slot in slots() {
                let own = &mut self.island[slot as usize];
                if *own == NONE {
                    *own = lowest;
                    self.bodies.push(slot);
                    bodies.reach[slot as usize] = reach(bodies.velocity[slot as usize]);
                }
            }
        }
        if self.bodies.len() == before {
            return;
        }
        let island = &self.island;
        self.bodies.sort_unstable();
        bodies.moving.retain(|&slot| island[slot as usize] == NONE);
    }

    /// Whether the step changed no bit of a body, so that the next step begins with the same values.
    fn is_unchanged(&self, bodies: &Bodies, slot: u32) -> bool {
        let index = slot as usize;
        let bits = |vector: Vec2| vector.to_array().map(f32::to_bits);
        if bodies.motion[index] != Motion::Dynamic {
            return bodies.velocity[index] == Vec2::ZERO;
        }
        bits(bodies.center[index]) == bits(self.center[index])
            && bits(bodies.velocity[index]) == bits(self.velocity[index])
    }
}

#[cfg(test)]
mod tests;
