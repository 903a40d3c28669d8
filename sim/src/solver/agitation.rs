//! How the bodies of a large island move, which decides how it is swept: in motion, where the next step sees other
//! contacts, over-relaxed and to a coarser tolerance; while it lands, by colour; near its solution, with forests.
//!
//! In a pile that collapses most contacts are solved after a few sweeps, and a few tens of them never are: they
//! contradict each other, or slide back and forth at their limits. So all sweeps are few.
//!
//! Stopping anywhere adds no energy, since no visit lowers the objective (see `warm_start`).

use super::contact_constraint::{ContactConstraint, Correction};
use super::sweep::{self, Sequence, SweepLimits};
use super::tolerances::{AGITATED, AGITATED_MIN, SLOW};
use crate::math::max;
use glam::Vec2;

/// Fewest sweeps over a large island: with 12 piles overlap more and are hardly faster.
const SWEEPS: u32 = 16;
/// Sweeps over an island in motion, relative to the square root of its contacts: what happens at one end of it is felt at the
/// other after that many over-relaxed ones. With 16 a crowd of 4000 that is pulled together overlaps twice as deeply.
const SWEEPS_PER_ROOT: f32 = 0.35;
/// Most sweeps of such an island, if it is large and no body is heavy; small ones take [`SMALL_SWEEPS_MAX`].
const SWEEPS_MAX: u32 = 40;
/// Mass ratio beyond which bodies are so much heavier that more visits are worth it.
const HEAVY_MASS_RATIO: f32 = 50.0;
/// The same three limits for islands with such a body: a crowd with many of them overlaps a seventh less with 2.5 times
/// the usual sweeps than with twice as many, which are enough for a bed on which one of them falls.
const HEAVY_SWEEPS: u32 = 2 * SWEEPS;
const HEAVY_SWEEPS_PER_ROOT: f32 = 2.5 * SWEEPS_PER_ROOT;
const HEAVY_SWEEPS_MAX: u32 = 5 * SWEEPS_MAX / 2;
/// Sliding that counts as motion where a body is that heavy, relative to other islands: one that is hardly held sinks into
/// its bed, which boils.
const HEAVY_AGITATION: f32 = 8.0;
/// Visits that every island in motion may take, and its most sweeps: in rain, small ones decide when it rests.
const SMALL_VISITS: u32 = 4400;
const SMALL_SWEEPS_MAX: u32 = 128;
/// Visits that every other island may take: with 6400 a rain of 4000 overlaps by ten slops when it lands.
pub(crate) const CALM_VISITS: u32 = 8800;
/// Divides the most sweeps over an island that is solved again with late pairs.
const LATE_PART: u32 = 2;
/// Change of a relative velocity at which sweeps over an island in motion end, as a share of its mean sliding velocity.
const SLIDING_SHARE: f32 = 0.2;
/// Contacts beyond which an island that its sweeps did not solve counts as one that moves on.
pub(crate) const UNSOLVED_MIN: usize = 200;

/// How an island moved at the start of its sweeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agitation {
    /// Its residual is so small that the first sweep is likely to be the last.
    is_near: bool,
    /// Its bodies move past each other: the next step sees other contacts, and few loads follow a column.
    pub in_motion: bool,
    pub is_slow: bool,
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
        if self.in_motion {
            Correction::Singly
        } else if !is_solved && count > UNSOLVED_MIN {
            Correction::Light
        } else {
            Correction::Thorough
        }
    }

    /// Limits of the sweeps over an island of `count` contacts. In motion, bodies far heavier than others take
    /// more, and small islands, which cost little, as many as solve them. Islands that are solved again with late pairs
    /// begin near their solution. Where the settings ask for a finer tolerance than the default, all take as many times
    /// more: `precision`.
    pub fn limits(
        &self,
        limits: SweepLimits,
        count: usize,
        mass_ratio: f32,
        is_late: bool,
        precision: f32,
    ) -> SweepLimits {
        let count = count as u32;
        let within = |most: u32| {
            let most = if is_late { most / LATE_PART } else { most };
            ((most as f32 * precision) as u32).min(limits.sweeps_max)
        };
        if self.in_motion {
            let (fewest, per_root, most) = match mass_ratio > HEAVY_MASS_RATIO {
                true => (HEAVY_SWEEPS, HEAVY_SWEEPS_PER_ROOT, HEAVY_SWEEPS_MAX),
                false => (SWEEPS, SWEEPS_PER_ROOT, SWEEPS_MAX),
            };
            let usual = ((per_root * (count as f32).sqrt()) as u32).clamp(fewest, most);
            let small = (SMALL_VISITS / count).min(SMALL_SWEEPS_MAX);
            let tolerance = max(limits.tolerance, SLIDING_SHARE * self.sliding / precision);
            return SweepLimits { sweeps_max: within(usual.max(small)), tolerance, ..limits };
        }
        let sweeps = SWEEPS.max(CALM_VISITS / count);
        let sweeps_max = within(sweeps);
        let sequence = if self.is_near { Sequence::Forests } else { Sequence::Colors };
        SweepLimits { sweeps_max, sequence, ..limits }
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
