//! Classifies how the bodies of a large island move, which decides how it is swept. If it is in motion, so that
//! the next step sees other contacts, sweeps are over-relaxed and use a coarser tolerance. An island that is
//! landing is swept by colour, and one near its solution with forests.
//!
//! In a collapsing pile, most contacts are solved after a few sweeps, and a few dozen never are, because they
//! contradict each other or slide back and forth at their limits. The number of sweeps is therefore kept small.
//!
//! Stopping at any time adds no energy, since no visit lowers the objective (see `warm_start`).

use super::contact_constraint::{ContactConstraint, Correction};
use super::sweep::{self, Sequence, SweepLimits};
use super::tolerances::{AGITATED, AGITATED_MIN, SLOW};
use crate::math::max;
use glam::Vec2;

/// Minimum number of sweeps over a large island. With only 12, piles overlap more and are hardly faster.
const SWEEPS: u32 = 16;
/// Number of sweeps over an island in motion, relative to the square root of its number of contacts. After this
/// many over-relaxed sweeps, one end of the island feels an impact at the other. With only 16 sweeps, a crowd of
/// 4000 bodies that is pulled together overlaps twice as deeply.
const SWEEPS_PER_ROOT: f32 = 0.35;
/// Maximum number of sweeps over such an island if it is large and has no heavy body. Small ones take up
/// to [`SMALL_SWEEPS_MAX`].
const SWEEPS_MAX: u32 = 40;
/// Mass ratio beyond which the heavier bodies are worth more visits.
const HEAVY_MASS_RATIO: f32 = 50.0;
/// The same three limits for islands with such a heavy body. Twice the usual number of sweeps is enough for a bed on
/// which one such body falls; in a crowd with many of them, 2.5 times the usual number reduces overlaps by another
/// seventh.
const HEAVY_SWEEPS: u32 = 2 * SWEEPS;
const HEAVY_SWEEPS_PER_ROOT: f32 = 2.5 * SWEEPS_PER_ROOT;
const HEAVY_SWEEPS_MAX: u32 = 5 * SWEEPS_MAX / 2;
/// Threshold from which sliding counts as motion in islands with such a heavy body, relative to others. With too
/// little support, the body sinks into its bed, which then boils.
const HEAVY_AGITATION: f32 = 8.0;
/// Number of visits that every island in motion may take, and its maximum number of sweeps. In rain, it is the
/// small islands that determine when everything comes to rest.
const SMALL_VISITS: u32 = 4400;
const SMALL_SWEEPS_MAX: u32 = 128;
/// Number of visits that every other island may take. With only 6400, a rain of 4000 bodies overlaps by ten slops when
/// it lands.
pub(crate) const CALM_VISITS: u32 = 8800;
/// Divisor for the maximum number of sweeps over an island that is solved again with late pairs.
const LATE_PART: u32 = 2;
/// Sweeps over an island in motion end when relative velocities change by less than this share of its mean sliding
/// velocity.
const SLIDING_SHARE: f32 = 0.2;
/// Number of contacts beyond which an island that its sweeps leave unsolved counts as still moving.
pub(crate) const UNSOLVED_MIN: usize = 200;

/// How an island moved at the start of its sweeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Agitation {
    /// Whether its residual is so small that the first sweep is likely to be the last.
    is_near: bool,
    /// Whether its bodies move past each other, in which case the next step sees other contacts, and few loads
    /// follow a column.
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

    /// Chooses how the positions of an island of `count` contacts are corrected after the step.
    pub fn correction(&self, is_solved: bool, count: usize) -> Correction {
        if self.in_motion {
            Correction::Singly
        } else if !is_solved && count > UNSOLVED_MIN {
            Correction::Light
        } else {
            Correction::Thorough
        }
    }

    /// Limits on the sweeps over an island of `count` contacts. Among islands in motion, those with far heavier
    /// bodies get more sweeps, and small ones, which cost little, get as many as they need. Islands that are solved
    /// again with late pairs start near their solution and get fewer. If the settings ask for a finer tolerance than
    /// the default, all limits are multiplied by `precision`.
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
