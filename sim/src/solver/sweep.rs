//! Block Gauss-Seidel accelerated by nonlinear conjugate gradients.
//!
//! A sweep solves the forest, then the chains, then every other constraint. For each of the latter, it finds first
//! the normal impulse that stops the two bodies from closing too fast, and then friction, whose limit is known by
//! then (Moreau 1988; Jean 1999). The change made by a sweep, d, acts as the negative gradient in the norm of the
//! effective masses. Between sweeps, the impulses are extrapolated along p by beta = |d|^2 / |previous d|^2, and p
//! becomes beta p + d. If beta exceeds 1, the direction is reset (Silcowitz-Hansen, Niebe and Erleben 2010, "A
//! nonsmooth nonlinear conjugate gradient method for interactive contact force problems"). The final step is always a
//! sweep, in which no constraint changes a relative velocity by more than the tolerance. `FRICTION` is false if
//! nothing has friction, so that no time is spent on computing zeros.
//!
//! `solve_in_motion` and `Sequence::Colors` work without forests: they visit contacts colour by colour and over-relax
//! each visit. `solve_in_motion` does not use search directions either.

use super::gauss_seidel::{SweepChange, limited, solve_contact, visit_change};
use super::graph_coloring::ColoredContacts;
use crate::features::GENERAL_ONLY;
use crate::math::{max, without_dust};
use crate::solver::chains::Chains;
use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::spanning_forest::SpanningForest;
use crate::solver::tolerances::{FIRST_SWEEP_SHARE, NEAR_SOLUTION};
use glam::Vec2;

/// Number of sweeps for which a forest is kept. If it does not help, the wait for the next one doubles.
const FOREST_SWEEPS: u32 = 4;

/// Parts of an island that a sweep solves exactly.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blocks {
    pub chains: Chains,
    pub forest: SpanningForest,
    pub colored: ColoredContacts,
    pub swept: Swept,
}

/// Counts of the work in a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Swept {
    /// Visits to contacts one after another.
    pub singles: u64,
    /// Visits to four contacts side by side.
    pub wide: u64,
    /// Visits to contacts in chains.
    pub links: u64,
    /// Number of bodies moved by forests.
    pub nodes: u64,
    /// Contacts with an overlap to remove.
    pub corrected: u64,
}

impl Blocks {
    /// Makes room for `slots` bodies.
    pub fn reserve(&mut self, slots: usize) {
        self.chains.reserve(slots);
        self.forest.reserve(slots);
        self.colored.reserve(slots);
    }
}

/// Limits on an island's sweeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweepLimits {
    /// Change in a relative velocity at which sweeps end, units/s.
    pub tolerance: f32,
    /// Change in a relative velocity that counts as rounding, units/s. An island that no visit would change by more
    /// than this needs no sweep.
    pub rounding: f32,
    pub sweeps_max: u32,
    /// Order of the visits.
    pub sequence: Sequence,
    /// Whether contacts have friction.
    pub friction: bool,
}

/// The order in which a sweep visits contacts outside the chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sequence {
    /// One after another, with forests.
    Forests,
    /// By colour, four side by side, in less than half the time; for sweeps that end early anyway.
    Colors,
}

/// Number of sweeps over only the contacts with immovable bodies. Two walls that meet in a corner need no more.
const IMMOVABLE_SWEEPS: u32 = 2;

/// Factor applied to the steps of sweeps by colour with search directions.
const CALM_FACTOR: f32 = 1.5;
/// The same for an island in motion, which is swept without search directions. With 1.8, overlaps are 1.5 times as
/// deep.
const MOTION_FACTOR: f32 = 1.9;
/// Number of final sweeps over such an island that take whole steps, so that no impulse ends up too large.
const LAST_SWEEPS: u32 = 2;

/// Sweeps an island in motion by colour, with over-relaxation (Young 1954). Returns the number of sweeps.
///
/// Like a whole step, a step scaled by a factor in (0, 2) lowers the remaining kinetic energy of the problem, so
/// stopping at any time adds none.
pub(crate) fn solve_in_motion(
    constraints: &mut [ContactConstraint],
    island: &[u32],
    blocks: &mut Blocks,
    velocity: &mut [Vec2],
    limits: SweepLimits,
) -> u32 {
    let colored = &mut blocks.colored;
    colored.color(constraints, island);
    let sweep = match limits.friction || GENERAL_ONLY {
        true => ColoredContacts::sweep::<true>,
        false => ColoredContacts::sweep::<false>,
    };
    let mut sweeps = limits.sweeps_max;
    for count in 1..=limits.sweeps_max {
        let is_last = count + LAST_SWEEPS > limits.sweeps_max;
        let mut change = SweepChange::default();
        sweep(colored, velocity, &mut change, if is_last { 1.0 } else { MOTION_FACTOR });
        if change.worst < limits.tolerance {
            sweeps = count;
            break;
        }
    }
    colored.store(constraints);
    blocks.swept.wide += u64::from(sweeps) * colored.wide_count();
    sweeps
}

/// Solves an island, and returns the number of sweeps.
pub(crate) fn solve(
    constraints: &mut [ContactConstraint],
    island: &[u32],
    blocks: &mut Blocks,
    velocity: &mut [Vec2],
    limits: SweepLimits,
) -> u32 {
    let with_friction = limits.friction || GENERAL_ONLY;
    match (limits.sequence, with_friction) {
        (Sequence::Forests, true) => {
            solve_with_forests::<true>(constraints, island, blocks, velocity, limits)
        }
        (Sequence::Forests, false) => {
            solve_with_forests::<false>(constraints, island, blocks, velocity, limits)
        }
        (Sequence::Colors, true) => solve_colored::<true>(constraints, blocks, velocity, limits),
        (Sequence::Colors, false) => solve_colored::<false>(constraints, blocks, velocity, limits),
    }
}

/// Solves an island without forests, by solving chain after chain, and the contacts outside the chains
/// (`others`) by colour. Returns the number of sweeps.
fn solve_colored<const FRICTION: bool>(
    constraints: &mut [ContactConstraint],
    blocks: &mut Blocks,
    velocity: &mut [Vec2],
    limits: SweepLimits,
) -> u32 {
    let Blocks { chains, colored, swept, .. } = blocks;
    colored.color(constraints, &chains.others);
    for &index in chains.links() {
        constraints[index as usize].remember();
    }
    let mut sweeps = limits.sweeps_max;
    let mut squared_before = 0.0;
    for count in 1..=limits.sweeps_max {
        let mut change = chains.sweep::<FRICTION>(constraints, velocity);
        colored.sweep::<FRICTION>(velocity, &mut change, CALM_FACTOR);
        if change.worst < limits.tolerance {
            sweeps = count;
            break;
        }
        let beta = beta(change.squared, squared_before);
        squared_before = change.squared;
        if count < limits.sweeps_max {
            for &index in chains.links() {
                extrapolate::<FRICTION>(&mut constraints[index as usize], velocity, beta);
            }
            colored.extrapolate::<FRICTION>(velocity, beta);
        }
    }
    colored.store(constraints);
    swept.wide += u64::from(sweeps) * colored.wide_count();
    swept.links += u64::from(sweeps) * chains.links().len() as u64;
    sweeps
}

/// Length of the step along the direction, or `None` if the change has grown, so that the direction is reset.
fn beta(squared: f32, squared_before: f32) -> Option<f32> {
    let ratio = if squared_before > 0.0 { squared / squared_before } else { 0.0 };
    // For implausible numbers, sums of squares may be infinite, and their ratio may be NaN.
    (ratio <= 1.0).then_some(ratio)
}

/// Solves an island contact by contact, with the forest of its constraints as the first block if that helps.
/// Returns the number of sweeps.
fn solve_with_forests<const FRICTION: bool>(
    constraints: &mut [ContactConstraint],
    island: &[u32],
    blocks: &mut Blocks,
    velocity: &mut [Vec2],
    limits: SweepLimits,
) -> u32 {
    let is_rounding =
        |&index: &u32| visit_change(&constraints[index as usize], velocity) < limits.rounding;
    if limits.rounding > 0.0 && island.iter().all(is_rounding) {
        for &index in island {
            stay_at_rest(&constraints[index as usize], velocity, limits.rounding);
        }
        return 0;
    }
    let is_near_solution = is_near_solution(constraints, island, velocity, limits.tolerance);
    let (mut forest_at, mut wait) = (if is_near_solution { 2 } else { 1 }, FOREST_SWEEPS);
    let mut squared_before = 0.0;
    blocks.forest.clear();
    for &index in island {
        constraints[index as usize].remember();
    }
    for count in 1..=limits.sweeps_max {
        if count == forest_at {
            blocks.forest.find::<FRICTION>(constraints, island);
            forest_at += wait;
        }
        blocks.swept.nodes += blocks.forest.node_count();
        blocks.swept.links += blocks.chains.links().len() as u64;
        blocks.swept.singles += blocks.chains.others.len() as u64;
        if !blocks.forest.solve::<FRICTION>(constraints, velocity) {
            blocks.forest.clear();
            wait *= 2;
            forest_at = count + wait;
        }
        let change = sweep::<FRICTION>(constraints, &mut blocks.chains, velocity);
        let strict = if is_near_solution && count == 1 { FIRST_SWEEP_SHARE } else { 1.0 };
        if change.worst < strict * limits.tolerance {
            return count;
        }
        let beta = beta(change.squared, squared_before);
        squared_before = change.squared;
        if count < limits.sweeps_max {
            for &index in island {
                extrapolate::<FRICTION>(&mut constraints[index as usize], velocity, beta);
            }
        }
    }
    limits.sweeps_max
}

/// Whether an island's residual is so small that the first sweep is likely to be the last.
pub(crate) fn is_near_solution(
    constraints: &[ContactConstraint],
    island: &[u32],
    velocity: &[Vec2],
    tolerance: f32,
) -> bool {
    residual(constraints, island, velocity) < NEAR_SOLUTION * tolerance
}

/// The largest residual of a constraint, units/s.
fn residual(constraints: &[ContactConstraint], island: &[u32], velocity: &[Vec2]) -> f32 {
    let mut worst = 0.0;
    for &index in island {
        let constraint = &constraints[index as usize];
        let relative = constraint.relative_velocity(velocity);
        let lack = constraint.min_normal_velocity - constraint.normal.dot(relative);
        if constraint.normal_impulse <= 0.0 {
            worst = max(worst, lack);
        } else {
            worst = max(worst, lack.abs());
            // This is never true without friction.
            if constraint.sticks() {
                worst = max(worst, constraint.normal.perp().dot(relative).abs());
            }
        }
    }
    worst
}

/// Solves the chains, and all other constraints one by one.
fn sweep<const FRICTION: bool>(
    constraints: &mut [ContactConstraint],
    chains: &mut Chains,
    velocity: &mut [Vec2],
) -> SweepChange {
    let mut change = chains.sweep::<FRICTION>(constraints, velocity);
    for &index in &chains.others {
        let constraint = &mut constraints[index as usize];
        let off = solve_contact::<FRICTION>(constraint, velocity);
        change.count::<FRICTION>(constraint, off);
    }
    change
}

/// Applies the stored impulses of a constraint and visits it `visits` times, unless that would change every relative
/// velocity by less than `rounding`. Returns the number of visits.
#[inline]
pub(crate) fn solve_single<const FRICTION: bool>(
    constraint: &mut ContactConstraint,
    velocity: &mut [Vec2],
    visits: u32,
    rounding: f32,
) -> u32 {
    constraint.apply(velocity, constraint.accumulated::<FRICTION>());
    if visit_change(constraint, velocity) < rounding {
        stay_at_rest(constraint, velocity, rounding);
        return 0;
    }
    for _ in 0..visits {
        solve_contact::<FRICTION>(constraint, velocity);
    }
    visits
}

/// Removes the rounding errors that forces and impulses leave in the velocities of two bodies at rest. Otherwise they
/// would creep, and their island would never be the same as in the step before.
#[inline]
fn stay_at_rest(constraint: &ContactConstraint, velocity: &mut [Vec2], rounding: f32) {
    for (slot, inv_mass) in constraint.bodies() {
        let body = &mut velocity[slot as usize];
        if inv_mass > 0.0 && body.length_squared() < rounding * rounding {
            *body = Vec2::ZERO;
        }
    }
}

/// A sweep without chains, forests or search directions.
pub(crate) fn plain_sweep(
    constraints: &mut [ContactConstraint],
    island: &[u32],
    velocity: &mut [Vec2],
) {
    for &index in island {
        solve_contact::<true>(&mut constraints[index as usize], velocity);
    }
}

/// Gives immovable bodies precedence where sweeps ended before they converged, since an overlap between two
/// bodies is better than a body inside a wall.
pub(crate) fn sweep_immovable(
    constraints: &mut [ContactConstraint],
    island: &[u32],
    velocity: &mut [Vec2],
) {
    for _ in 0..IMMOVABLE_SWEEPS {
        for &index in island {
            let constraint = &mut constraints[index as usize];
            if !constraint.is_free() {
                solve_contact::<false>(constraint, velocity);
            }
        }
    }
}

/// Moves a constraint's impulses along the direction, within their limits, or resets the direction. The next sweep
/// starts from there.
#[inline]
fn extrapolate<const FRICTION: bool>(
    constraint: &mut ContactConstraint,
    velocity: &mut [Vec2],
    beta: Option<f32>,
) {
    if let Some(beta) = beta {
        let normal = max(constraint.normal_impulse + beta * constraint.normal_direction, 0.0);
        constraint.normal_direction = without_dust(
            beta * constraint.normal_direction
                + (constraint.normal_impulse - constraint.normal_before),
        );
        let normal_change = normal - constraint.normal_impulse;
        let mut tangent_change = 0.0;
        if FRICTION {
            let limit = constraint.friction * normal;
            let tangent =
                limited(constraint.tangent_impulse + beta * constraint.tangent_direction, limit);
            constraint.tangent_direction = without_dust(
                beta * constraint.tangent_direction
                    + (constraint.tangent_impulse - constraint.tangent_before),
            );
            tangent_change = tangent - constraint.tangent_impulse;
            constraint.tangent_impulse = tangent;
        }
        if normal_change != 0.0 || tangent_change != 0.0 {
            constraint.normal_impulse = normal;
            constraint
                .apply(velocity, constraint.impulse_of::<FRICTION>(normal_change, tangent_change));
        }
    } else {
        constraint.normal_direction = 0.0;
        constraint.tangent_direction = 0.0;
    }
    constraint.remember();
}
