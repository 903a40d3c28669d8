//! Solves an island. A single constraint takes one visit, while larger islands are swept within limits that depend
//! on their masses and motion.

use super::ConjugateSolver;
use crate::bodies::Bodies;
use crate::math::{clamp, max, min};
use crate::solver::agitation::{Agitation, CALM_VISITS, UNSOLVED_MIN};
use crate::solver::contact_constraint::{ContactConstraint, Correction};
use crate::solver::direct;
use crate::solver::settings::TOLERANCE;
use crate::solver::step_context::StepContext;
use crate::solver::sweep::{self, Sequence, SweepLimits};
use crate::solver::tolerances::{
    CALM_MIN, IMPULSE_ROUNDING, LARGE_ISLAND, MOTION_MIN, SMALL_ISLAND, SMALL_ISLAND_SHARE,
    SPEED_ROUNDING, STIFF_BODIES, STIFF_MASS_RATIO, STIFF_VISITS,
};
use glam::Vec2;

/// Minimum number of sweeps over an island, no matter how many constraints it has.
pub(super) const SWEEPS_MIN: u32 = 4;

/// Limits on the work for an island.
#[derive(Clone, Copy, Debug)]
struct IslandLimits {
    /// Limits on its sweeps.
    sweeps: SweepLimits,
    /// Ratio of the greatest mass to the smallest.
    mass_ratio: f32,
    /// How the island moves, if that limits its sweeps.
    agitation: Option<Agitation>,
}

impl ConjugateSolver {
    /// Solves a constraint whose movable bodies have no other constraint. One visit is exact, since both impulses
    /// act on the same masses. A second visit removes the rounding error of the first.
    pub(super) fn solve_single(&mut self, index: u32, bodies: &mut Bodies, context: &StepContext) {
        const VISITS: u32 = 2;
        let rounding = self.rounding(&[index], &bodies.velocity, context);
        let (constraint, velocity) =
            (&mut self.contacts.constraints[index as usize], &mut bodies.velocity);
        let visits = match context.features.takes_friction() {
            true => sweep::solve_single::<true>(constraint, velocity, VISITS, rounding),
            false => sweep::solve_single::<false>(constraint, velocity, VISITS, rounding),
        };
        self.work.done += u64::from(visits);
        self.blocks.swept.singles += u64::from(visits);
        self.work.sweeps = self.work.sweeps.max(visits);
    }

    /// Solves the constraints of an island from their current impulses and velocities, or sweeps it until its limits
    /// are reached.
    pub(super) fn solve_island(
        &mut self,
        number: usize,
        is_late: bool,
        bodies: &mut Bodies,
        context: &StepContext,
    ) {
        let found = self.limits(number, is_late, &bodies.velocity, context);
        let IslandLimits { sweeps: limits, mass_ratio, agitation } = found;
        let is_stiff = mass_ratio > STIFF_MASS_RATIO;
        let velocity = &mut bodies.velocity;
        if is_stiff {
            let island = &self.islands.constraints[self.islands.range(number)];
            self.energy_guard.remember(&self.contacts.constraints, island, velocity);
        }
        let sweeps = self.sweep_island(number, found, velocity);
        let island = &self.islands.constraints[self.islands.range(number)];
        let constraints = &mut self.contacts.constraints;
        let mut is_solved = sweeps < limits.sweeps_max;
        let mut visits = sweeps * island.len() as u32;
        let rounds_max = direct::rounds_left(island.len(), self.work.eliminated);
        let is_worth = agitation.is_none() && direct::is_worth(island.len(), mass_ratio);
        if !is_solved && is_worth && rounds_max > 0 {
            let (solved, rounds) =
                self.direct.solve(constraints, island, velocity, limits.tolerance, rounds_max);
            is_solved = solved;
            let elimination = rounds * direct::VISITS * island.len() as u32;
            self.work.eliminated += u64::from(elimination);
            visits += elimination;
        }
        if is_stiff && is_worth {
            self.work.very_stiff += u64::from(sweeps * island.len() as u32);
        }
        if is_stiff {
            visits += self.energy_guard.check(constraints, island, velocity);
        }
        if is_stiff || !is_solved {
            sweep::sweep_immovable(constraints, island, velocity);
        }
        let correction = match agitation {
            Some(agitation) => Some(agitation.correction(is_solved, island.len())),
            None if is_stiff && !is_solved && island.len() > UNSOLVED_MIN => {
                Some(Correction::Light)
            }
            None => None,
        };
        if let Some(correction) = correction {
            for &index in island {
                self.contacts.infos[index as usize].correction = correction;
            }
        }
        self.work.done += u64::from(visits);
        self.work.sweeps = self.work.sweeps.max(sweeps);
    }

    /// Sweeps an island within its limits, and returns the number of sweeps.
    #[inline]
    fn sweep_island(&mut self, number: usize, found: IslandLimits, velocity: &mut [Vec2]) -> u32 {
        let IslandLimits { sweeps: mut limits, agitation, .. } = found;
        let island = &self.islands.constraints[self.islands.range(number)];
        let (constraints, blocks) = (&mut self.contacts.constraints, &mut self.blocks);
        if agitation.is_some_and(|agitation| agitation.in_motion) {
            self.late_pairs.note_motion(constraints, island);
            return sweep::solve_in_motion(constraints, island, blocks, velocity, limits);
        }
        blocks.chains.find(constraints, island);
        if agitation.is_some_and(|agitation| agitation.is_slow)
            && 2 * blocks.chains.links().len() > island.len()
        {
            // This is a fallen tower, whose columns lean on each other. Sweeping by colour would let it keep creeping.
            limits.sequence = Sequence::Forests;
        }
        sweep::solve(constraints, island, blocks, velocity, limits)
    }

    /// The limits on the sweeps over an island.
    fn limits(
        &self,
        number: usize,
        is_late: bool,
        velocity: &[Vec2],
        context: &StepContext,
    ) -> IslandLimits {
        let constraints = &self.contacts.constraints;
        let island = &self.islands.constraints[self.islands.range(number)];
        let (tolerance, mass_ratio) = tolerance(constraints, island, velocity, context);
        let is_stiff = mass_ratio > STIFF_MASS_RATIO;
        let is_exact = is_stiff
            && (direct::is_worth(island.len(), mass_ratio) || is_overfull(constraints, island));
        let calm_min = if is_stiff { usize::MAX } else { CALM_MIN };
        let agitation = (!self.is_large_world && !is_exact && island.len() > MOTION_MIN)
            .then(|| Agitation::of(constraints, island, velocity, tolerance, mass_ratio))
            .filter(|agitation| agitation.in_motion || island.len() >= calm_min);
        let mut work_max = context.settings.work_max / island.len() as u32;
        if agitation.is_none() {
            // One sweep more than the step has left, so that an island which needs it exceeds the budget instead
            // of being solved less precisely. Islands with an agitation take few sweeps.
            let work_left = (self.work.left / island.len() as u64).saturating_add(1);
            work_max = work_max.min(u32::try_from(work_left).unwrap_or(u32::MAX));
        }
        let precision = max(TOLERANCE / context.settings.tolerance, 1.0);
        if agitation.is_none() && !is_stiff && !self.is_large_world {
            // As many visits as a larger island that is not in motion gets. Without a limit, small islands would
            // cause the longest steps in small scenes.
            work_max = work_max.min((CALM_VISITS as f32 * precision) as u32 / island.len() as u32);
        }
        if is_stiff && direct::is_worth(island.len(), mass_ratio) {
            work_max = work_max.min(direct::sweeps_before(island.len(), self.work.very_stiff));
        } else if is_stiff && !is_exact {
            work_max = work_max.min(STIFF_VISITS / island.len() as u32);
        }
        let sweeps_max = work_max.max(SWEEPS_MIN).min(context.settings.sweeps_max);
        let friction = context.features.takes_friction();
        let (rounding, sequence) = (self.rounding(island, velocity, context), Sequence::Forests);
        let sweeps = SweepLimits { tolerance, rounding, sweeps_max, sequence, friction };
        let sweeps = match agitation {
            Some(agitation) => {
                agitation.limits(sweeps, island.len(), mass_ratio, is_late, precision)
            }
            None => sweeps,
        };
        IslandLimits { sweeps, mass_ratio, agitation }
    }

    /// Change in a relative velocity that counts as rounding in an island that was at rest, units/s; 0 in other
    /// islands.
    fn rounding(&self, island: &[u32], velocity: &[Vec2], context: &StepContext) -> f32 {
        let start_velocity = &self.displacements.start_velocity;
        let was_at_rest = |&index: &u32| {
            let bodies = self.contacts.constraints[index as usize].bodies();
            bodies.into_iter().all(|(slot, inv_mass)| {
                let before = if inv_mass > 0.0 { start_velocity } else { velocity };
                before[slot as usize] == Vec2::ZERO
            })
        };
        if !island.iter().all(was_at_rest) {
            return 0.0;
        }
        let strongest = island.iter().fold(0.0, |strongest, &index| {
            let constraint = &self.contacts.constraints[index as usize];
            let inv_mass = constraint.inv_mass_a + constraint.inv_mass_b;
            max(strongest, constraint.normal_impulse * inv_mass)
        });
        max(context.rounding(), IMPULSE_ROUNDING * strongest)
    }
}

/// Returns the change in a relative velocity at which the sweeps over an island end, units/s, and the ratio of its
/// greatest mass to the smallest.
fn tolerance(
    constraints: &[ContactConstraint],
    island: &[u32],
    velocity: &[Vec2],
    context: &StepContext,
) -> (f32, f32) {
    let (mut fastest, mut lightest, mut heaviest) = (0.0, 0.0, f32::INFINITY);
    for &index in island {
        let constraint = &constraints[index as usize];
        for (body, inv_mass) in constraint.bodies() {
            let speed = velocity[body as usize].abs();
            fastest = max(fastest, max(speed.x, speed.y));
            lightest = max(lightest, inv_mass);
            heaviest = if inv_mass > 0.0 { min(heaviest, inv_mass) } else { heaviest };
        }
    }
    let count = island.len() as f32;
    let (few, many) = (count / SMALL_ISLAND, LARGE_ISLAND / count);
    let share = clamp(few * few, SMALL_ISLAND_SHARE, 1.0) * min(many, 1.0);
    (max(context.tolerance() * share, fastest * SPEED_ROUNDING), lightest / heaviest)
}

/// Whether an island has at most [`STIFF_BODIES`] movable bodies and more than three contacts per body, the most
/// that they can have at once. In this case, the space that they have is small compared with their paths.
fn is_overfull(constraints: &[ContactConstraint], island: &[u32]) -> bool {
    let mut known = [u32::MAX; STIFF_BODIES];
    let mut count = 0;
    for &index in island {
        for (slot, inv_mass) in constraints[index as usize].bodies() {
            if inv_mass == 0.0 || known[..count].contains(&slot) {
                continue;
            }
            if count == STIFF_BODIES {
                return false;
            }
            known[count] = slot;
            count += 1;
        }
    }
    island.len() > 3 * count
}
