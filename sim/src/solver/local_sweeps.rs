//! Sweeps over large islands: a few over all of it, then only where something changes.
//!
//! In a pile that collapses most contacts are solved after a few sweeps, and a few
//! tens of them never are: they contradict each other, or slide back and forth at their limits.
//! Whole sweeps until the last one is solved would take hundreds. So after a few of them only the
//! contacts that a visit would still change are swept, with those around them, round by round, until
//! none changes or the budget of visits is spent. A contact that is not visited is one that a visit
//! would not change: the solution is the same as that of whole sweeps, and so is its tolerance.
//!
//! The whole sweeps go by colour, with chains; the rounds by colour, without
//! chains. Small rounds of an island whose bodies hardly move use forests instead: there the rest of the change has a
//! long way to go.
//!
//! Stopping anywhere adds no energy, since no visit lowers the objective (see `warm_start`).

use super::contact_constraint::{ContactConstraint, Correction};
use super::gauss_seidel::visit_change;
use super::layers::{self, UNREACHED, movable_ends};
use super::sweep::{self, Blocks, Sequence, SweepLimits};
use super::tolerances::{AGITATED, AGITATED_MIN, SLOW};
use crate::math::max;
use glam::Vec2;

/// Sweeps over the whole island, by colour. One that is near its solution is swept as a whole, with
/// forests, until its budget is spent.
const WHOLE_SWEEPS: u32 = 4;
/// Visits of a contact that an island may take on average: with 12 piles overlap more and are
/// hardly faster, with 32 they take a third longer.
pub(crate) const VISITS_PER_CONTACT: u32 = 16;
/// Mass ratio beyond which bodies are so much heavier that twice as many visits are worth it.
const HEAVY_MASS_RATIO: f32 = 50.0;
/// Sliding that counts as motion where a body is that heavy, relative to other islands: one that is hardly held sinks into
/// its bed, which boils.
const HEAVY_AGITATION: f32 = 8.0;
/// Visits that every island in motion may take, and its most sweeps: in rain, small ones decide when it rests.
const SMALL_VISITS: u32 = 4400;
const SMALL_SWEEPS_MAX: u32 = 128;
/// Change of a relative velocity at which sweeps over an island in motion end, as a share of its mean sliding velocity.
const SLIDING_SHARE: f32 = 0.2;
/// The same when it is solved again with late pairs, from the solution without them.
pub(crate) const LATE_VISITS_PER_CONTACT: u32 = 6;
/// Contacts for which every island may take visits: with 400 a rain of 4000 overlaps by ten slops when it lands.
const CONTACTS_MIN: u32 = 550;
/// Fewest and most sweeps of a round, and most rounds.
const SWEEPS_MIN: u32 = 2;
const SWEEPS_MAX: u32 = 32;
const ROUNDS_MAX: u32 = 30;
/// Most contacts of a round that are solved by a spanning forest as well.
const FOREST_MAX: usize = 600;
/// Contacts beyond which an island that its budget did not solve counts as one that moves on.
pub(crate) const UNSOLVED_MIN: usize = 200;
/// The same for an island whose bodies hardly move, such as a heap that was compressed in one place and has to come
/// apart.
const UNSOLVED_SLOW_MIN: usize = 600;
/// Share of the work of a visit that looking at a contact takes.
const LOOKS_PER_VISIT: u32 = 2;
/// Distance, in contacts, from a body of an unsolved contact within which all contacts are swept.
const LAYERS: u8 = 2;

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocalSweeps {
    /// By slot: distance from a body of an unsolved contact, in contacts; [`UNREACHED`] between
    /// rounds.
    layer: Vec<u8>,
    /// The movable bodies of each contact of the island: see [`layers::movable_ends`].
    ends: Vec<[u32; 2]>,
    /// By slot: whether the last sweeps visited a contact of the body; a visit would change no other contact than it
    /// would have before.
    is_swept: Vec<bool>,
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

/// How an island moved at the start of its sweeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agitation {
    /// Its residual is so small that the first sweep is likely to be the last.
    is_near: bool,
    /// Its bodies move past each other: the next step sees other contacts, and few loads follow a column.
    pub in_motion: bool,
    /// They hardly move.
    is_slow: bool,
    /// Mean sliding velocity of its contacts, units/s.
    sliding: f32,
}

impl Agitation {
    pub fn of(
        constraints: &[ContactConstraint],
        island: &[u32],
        velocity: &[Vec2],
        tolerance: f32,
        mass_ratio: f32,
    ) -> Agitation {
        let is_near = sweep::is_near_solution(constraints, island, velocity, tolerance);
        let (speed, sliding) = mean_speeds(constraints, island, velocity);
        let least = max(AGITATED * tolerance, AGITATED_MIN);
        let least = if mass_ratio > HEAVY_MASS_RATIO { HEAVY_AGITATION * least } else { least };
        let in_motion = !is_near && sliding > least;
        Agitation { is_near, in_motion, is_slow: speed < SLOW * tolerance, sliding }
    }

    /// How the positions of an island of `count` contacts are corrected after the step.
    pub fn correction(&self, is_solved: bool, count: usize) -> Correction {
        let unsolved_min = if self.is_slow { UNSOLVED_SLOW_MIN } else { UNSOLVED_MIN };
        if self.in_motion {
            Correction::Singly
        } else if !is_solved && count > unsolved_min {
            Correction::Light
        } else {
            Correction::Thorough
        }
    }

    /// Limits of the sweeps over an island in motion. Bodies far heavier than others take twice as many; small islands,
    /// which cost little, as many as solve them.
    pub fn motion_limits(&self, limits: SweepLimits, count: usize, mass_ratio: f32) -> SweepLimits {
        let usual =
            if mass_ratio > HEAVY_MASS_RATIO { 2 * VISITS_PER_CONTACT } else { VISITS_PER_CONTACT };
        let small = (SMALL_VISITS / count as u32).min(SMALL_SWEEPS_MAX);
        let sweeps_max = usual.max(small).min(limits.sweeps_max);
        let tolerance = max(limits.tolerance, SLIDING_SHARE * self.sliding);
        SweepLimits { sweeps_max, tolerance, ..limits }
    }
}

impl Work {
    /// The work that an island of `count` contacts may take, within `sweeps_max` sweeps over all of it.
    pub fn on(count: usize, visits_per_contact: u32, sweeps_max: u32) -> Work {
        let count = count as u32;
        let budget = (count.max(CONTACTS_MIN) * visits_per_contact).min(count * sweeps_max);
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
        self.is_swept.resize(slots, false);
    }

    /// Solves an island as far as its budget allows; returns whether it is solved. Of the limits the
    /// sweeps are those over the whole island.
    pub fn solve(
        &mut self,
        constraints: &mut [ContactConstraint],
        island: &[u32],
        blocks: &mut Blocks,
        velocity: &mut [Vec2],
        (limits, agitation): (SweepLimits, Agitation),
        work: &mut Work,
    ) -> bool {
        let tolerance = limits.tolerance;
        let (whole_sweeps, sequence) = match agitation.is_near {
            true => (VISITS_PER_CONTACT, Sequence::Forests),
            false => (WHOLE_SWEEPS, Sequence::Colors),
        };
        let sweeps_max = whole_sweeps.min(limits.sweeps_max);
        let whole = SweepLimits { sweeps_max, sequence, ..limits };
        blocks.chains.find(constraints, island);
        let sweeps = sweep::solve(constraints, island, blocks, velocity, whole);
        work.add(sweeps, island.len());
        if sweeps < sweeps_max {
            return true;
        }
        self.ends.clear();
        self.ends.extend(island.iter().map(|&index| movable_ends(&constraints[index as usize])));
        for slot in self.ends.as_flattened() {
            self.is_swept[*slot as usize] = true;
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
            let with_forests = agitation.is_slow && count < FOREST_MAX;
            let sequence = if with_forests { Sequence::Forests } else { Sequence::Colors };
            match sequence {
                Sequence::Colors => blocks.chains.find_none(&self.active),
                Sequence::Forests => blocks.chains.find(constraints, &self.active),
            }
            let limits = SweepLimits { sweeps_max, sequence, ..limits };
            let sweeps = sweep::solve(constraints, &self.active, blocks, velocity, limits);
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
        let LocalSweeps { layer, ends, is_swept, active } = self;
        active.clear();
        let mut any = false;
        for (&index, ends) in island.iter().zip(ends.iter()) {
            let may_change = ends.iter().any(|&slot| is_swept[slot as usize]);
            if may_change && visit_change(&constraints[index as usize], velocity) > tolerance {
                any = true;
                layer[ends[0] as usize] = 0;
                layer[ends[1] as usize] = 0;
            }
        }
        if !any {
            return;
        }
        layers::spread(layer, ends, LAYERS);
        is_swept.fill(false);
        for (&index, ends) in island.iter().zip(ends.iter()) {
            if ends.iter().any(|&slot| layer[slot as usize] <= LAYERS) {
                active.push(index);
                ends.iter().for_each(|&slot| is_swept[slot as usize] = true);
            }
        }
        layer.fill(UNREACHED);
    }
}

/// Mean relative velocity of an island's contacts, |x| + |y|, and their mean sliding velocity, units/s.
fn mean_speeds(constraints: &[ContactConstraint], island: &[u32], velocity: &[Vec2]) -> (f32, f32) {
    let (mut speed, mut sliding) = (0.0, 0.0);
    for &index in island {
        let constraint = &constraints[index as usize];
        let relative = constraint.relative_velocity(velocity);
        speed += relative.x.abs() + relative.y.abs();
        sliding += constraint.normal.perp().dot(relative).abs();
    }
    let count = island.len() as f32;
    (speed / count, sliding / count)
}
