//! Sweeps over large islands in motion: a few over all of it, then only where something changes.
//!
//! In a pile that is shaken or collapses most contacts are solved after a few sweeps, and a few
//! tens of them never are: they contradict each other, or slide back and forth at their limits.
//! Whole sweeps until the last one is solved would take hundreds. So after a few of them only the
//! contacts that a visit would still change are swept, with those around them, round by round, until
//! none changes or the budget of visits is spent. A contact that is not visited is one that a visit
//! would not change: the solution is the same as that of whole sweeps, and so is its tolerance.
//!
//! Stopping anywhere adds no energy, since no visit lowers the objective (see `warm_start`).

use super::contact_constraint::ContactConstraint;
use super::gauss_seidel::visit_change;
use super::sweep::{self, Blocks, SweepLimits};
use glam::Vec2;

/// Sweeps over the whole island, if it is not near its solution: then it has the whole budget.
const WHOLE_SWEEPS: u32 = 4;
/// Visits of a contact that an island may take on average: with 12 piles overlap more and are
/// hardly faster, with 32 they take a third longer.
const VISITS_PER_CONTACT: u32 = 16;
/// Visits that every island may take.
const VISITS_MIN: u32 = 6400;
/// Fewest and most sweeps of a round, and most rounds.
const SWEEPS_MIN: u32 = 2;
const SWEEPS_MAX: u32 = 32;
const ROUNDS_MAX: u32 = 30;
/// Most contacts of a round that are solved by a spanning forest as well.
const FOREST_MAX: usize = 600;
/// Share of the work of a visit that looking at a contact takes.
const LOOKS_PER_VISIT: u32 = 2;
/// Distance, in contacts, from a body of an unsolved contact within which all contacts are swept.
const LAYERS: u8 = 2;
const UNREACHED: u8 = u8::MAX;

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalSweeps {
    /// By slot: distance from a body of an unsolved contact, in contacts; [`UNREACHED`] between
    /// rounds.
    layer: Vec<u8>,
    /// The contacts of the round.
    active: Vec<u32>,
}

/// The work on an island in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Work {
    /// Visits that are left.
    pub budget: u32,
    /// Visits made by sweeps.
    pub visits: u32,
    /// Sweeps made, whole or not.
    pub sweeps: u32,
}

impl Work {
    /// The work that an island of `count` contacts may take.
    pub fn on(count: usize) -> Work {
        let budget = (count as u32 * VISITS_PER_CONTACT).max(VISITS_MIN);
        Work { budget, visits: 0, sweeps: 0 }
    }

    /// Counts sweeps over `count` contacts.
    pub fn add(&mut self, sweeps: u32, count: usize) {
        let visits = sweeps * count as u32;
        self.sweeps += sweeps;
        self.visits += visits;
        self.budget = self.budget.saturating_sub(visits);
    }
}

impl LocalSweeps {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.layer.resize(slots, UNREACHED);
    }

    /// Solves an island as far as its budget allows; returns whether it is solved.
    pub fn solve(
        &mut self,
        constraints: &mut [ContactConstraint],
        island: &[u32],
        blocks: &mut Blocks,
        velocity: &mut [Vec2],
        (tolerance, friction): (f32, bool),
        work: &mut Work,
    ) -> bool {
        let sweep = if friction { sweep::solve::<true> } else { sweep::solve::<false> };
        if work.visits == 0 {
            let is_near = sweep::is_near_solution(constraints, island, velocity, tolerance);
            let sweeps_max = if is_near { VISITS_PER_CONTACT } else { WHOLE_SWEEPS };
            let limits = SweepLimits { tolerance, sweeps_max, forest: is_near };
            blocks.chains.find(constraints, island);
            let sweeps = sweep(constraints, island, blocks, velocity, limits);
            work.add(sweeps, island.len());
            if sweeps < sweeps_max {
                return true;
            }
        }
        for _ in 0..ROUNDS_MAX {
            work.budget = work.budget.saturating_sub(island.len() as u32 / LOOKS_PER_VISIT);
            self.find_active(constraints, island, velocity, tolerance);
            let count = self.active.len();
            if count == 0 {
                return true;
            }
            let sweeps_max = SWEEPS_MAX.min(work.budget / count as u32);
            if sweeps_max < SWEEPS_MIN {
                return false;
            }
            let limits = SweepLimits { tolerance, sweeps_max, forest: count < FOREST_MAX };
            blocks.chains.find(constraints, &self.active);
            let sweeps = sweep(constraints, &self.active, blocks, velocity, limits);
            work.add(sweeps, count);
        }
        false
    }

    /// Lists the contacts of bodies that are few contacts away from an unsolved one.
    fn find_active(
        &mut self,
        constraints: &[ContactConstraint],
        island: &[u32],
        velocity: &[Vec2],
        tolerance: f32,
    ) {
        self.active.clear();
        let rows = || island.iter().map(|&index| (index, &constraints[index as usize]));
        let mut any = false;
        for (_, constraint) in rows() {
            if visit_change(constraint, velocity) > tolerance {
                any = true;
                for (slot, inv_mass) in constraint.bodies() {
                    if inv_mass > 0.0 {
                        self.layer[slot as usize] = 0;
                    }
                }
            }
        }
        if !any {
            return;
        }
        for layer in 0..LAYERS {
            for (_, constraint) in rows().filter(|(_, constraint)| constraint.is_free()) {
                let (a, b) = (constraint.a as usize, constraint.b as usize);
                for (from, to) in [(a, b), (b, a)] {
                    if self.layer[from] == layer && self.layer[to] > layer {
                        self.layer[to] = layer + 1;
                    }
                }
            }
        }
        let layer = &mut self.layer;
        let near = |slot: u32| layer[slot as usize] <= LAYERS;
        let is_active = |constraint: &ContactConstraint| near(constraint.a) || near(constraint.b);
        let active = rows().filter(|(_, constraint)| is_active(constraint));
        self.active.extend(active.map(|(index, _)| index));
        for (_, constraint) in rows() {
            layer[constraint.a as usize] = UNREACHED;
            layer[constraint.b as usize] = UNREACHED;
        }
    }
}
