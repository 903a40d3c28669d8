//! The conjugate solver finds velocities that satisfy all contacts at once, by accelerated sweeps
//! that continue until they converge.
//!
//! There is one file for each stage. In the order of a step, they are:
//! 1. `impact_queue`: pairs bounce one by one, each at its time of impact;
//! 2. `contact_constraint`: pairs that may touch within the step get constraints (`separation`
//!    predicts when and along which normal); `crowd`: bodies that lie close to others bounce;
//! 3. `integrate`: gravity and other forces act (see `forces`);
//! 4. `islands`: constraints that share no movable body are solved separately (`solve_island`); the motion of an
//!    island (`agitation`) decides how:
//!    - `warm_start`: the previous step's impulses, to the extent that they cannot add energy,
//!    - `sweep::solve_in_motion`: if bodies move past each other, a few over-relaxed sweeps by
//!      colour (`graph_coloring`) over groups of four contacts that share no movable body,
//!    - `sweep`: Gauss-Seidel with conjugate directions until the residual is small, over
//!      `spanning_forest` (the contacts that bear the load, solved exactly if none begins to slide
//!      or to separate), `chains` (contacts along an axis, solved exactly in any case by pooling,
//!      see `pava`), and the rest,
//!    - `direct`: elimination of up to 128 contacts, if masses differ too much for sweeps to converge,
//!    - `energy_guard`: plain sweeps or rest, if masses differ too much for f32;
//!
//!    then once more with `late_pairs`, which only the new velocities bring together;
//! 5. `integrate`: the bodies move;
//! 6. `position_correction`: removes overlap beyond the slop;
//! 7. `static_clamp`: makes sure that no body ends up inside an immovable one.

mod solve_island;

use super::contact_constraint::{self, ContactSet, Correction, GatherScratch, GatherStep};
use super::direct::DirectSolver;
use super::energy_guard::EnergyGuard;
use super::islands::Islands;
use super::position_correction::PositionCorrection;
use super::step_context::StepContext;
use super::sweep::{Blocks, Swept};
use super::warm_start;
use crate::bodies::{Bodies, REACH_MIN};
use crate::broad_phase::pairs::{Pair, PairList};
use crate::continuous::impact_queue::{self, ImpactQueue, Progress};
use crate::continuous::late_pairs::{self, LatePairs};
use crate::continuous::static_clamp::StaticClamp;
use crate::features::GENERAL_ONLY;
use crate::forces::{Forces, Move};
use crate::integrate::{self, Displacements};
use crate::math::{clamp_length, max};
use crate::shape::{Aabb, shapes};
use crate::solver::tolerances::LARGE_WORLD;
use crate::steady::{Steady, StepContacts};
use crate::step_counts::StepCounts;
use crate::touches::Found;
use glam::Vec2;

/// Maximum number of times that a step may extend the reach of bodies that bounces have sped up.
const BOUNCE_ROUNDS_MAX: u32 = 16;

/// Scratch memory for a step; not part of the state.
#[derive(Debug, Default)]
pub(crate) struct ConjugateSolver {
    pub contacts: ContactSet,
    gather_scratch: GatherScratch,
    impact_queue: ImpactQueue,
    islands: Islands,
    blocks: Blocks,
    late_pairs: LatePairs,
    energy_guard: EnergyGuard,
    direct: DirectSolver,
    /// Whether more than [`LARGE_WORLD`] bodies can move.
    is_large_world: bool,
    /// By constraint: whether the step changed its impulses; only kept if islands may be left out.
    is_changed: Vec<bool>,
    displacements: Displacements,
    position_correction: PositionCorrection,
    static_clamp: StaticClamp,
    pub work: StepWork,
}

/// The work done in a step, and how much it may take.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StepWork {
    /// Number of sweeps over the island that needed the most.
    pub sweeps: u32,
    /// Number of constraint visits by sweeps, and of impact predictions.
    pub done: u64,
    /// The part of the work that was charged for elimination.
    eliminated: u64,
    /// Visits made by sweeps over very stiff islands before elimination.
    very_stiff: u64,
    /// Constraint visits made by the passes over positions.
    pub corrections: u64,
    /// Bodies, pairs, eliminations and predictions of earlier attempts at the current step, if any.
    earlier: StepCounts,
    /// Work that the step may still do.
    left: u64,
    /// Whether the step needed more work than that.
    is_over: bool,
}

impl StepWork {
    /// Spends work from the step's budget, and returns whether there was enough.
    fn spend(&mut self, work: u64) -> bool {
        self.is_over |= work > self.left;
        self.left = self.left.saturating_sub(work);
        !self.is_over
    }
}

/// Leaves out scratch, except what is read when worlds are compared within a step, since a page that predicts clones
/// its world.
impl Clone for ConjugateSolver {
    fn clone(&self) -> ConjugateSolver {
        let constraints = self.contacts.constraints.clone();
        ConjugateSolver {
            contacts: ContactSet { constraints, infos: Vec::new() },
            is_large_world: self.is_large_world,
            impact_queue: self.impact_queue.counts(),
            blocks: Blocks { swept: self.blocks.swept, ..Blocks::default() },
            work: self.work,
            ..ConjugateSolver::default()
        }
    }
}

impl ConjugateSolver {
    /// Releases all scratch; called between steps.
    pub fn release(&mut self) {
        self.contacts.clear();
        *self = self.clone();
    }

    pub fn begin(
        &mut self,
        bodies: &mut Bodies,
        steady: &mut Steady,
        leaves_out: bool,
        work_max: u64,
    ) {
        let StepWork { sweeps, is_over, .. } = self.work;
        self.work = StepWork { sweeps, is_over, left: work_max, ..StepWork::default() };
        self.blocks.swept = Swept::default();
        if is_large_world(bodies, steady) != self.is_large_world {
            // Islands are solved differently in a world of the other size class.
            steady.readmit_all(bodies);
        }
        steady.begin(bodies, leaves_out);
    }

    /// Counts of all attempts at a step with this many moving bodies and pairs.
    pub fn counts(&self, moving: usize, pairs: usize) -> StepCounts {
        let earlier = self.work.earlier;
        let Swept { singles, wide, links, nodes, corrected } = self.blocks.swept;
        StepCounts {
            moving: earlier.moving + moving as u64,
            pairs: earlier.pairs + pairs as u64,
            visits: singles,
            wide,
            links,
            nodes,
            eliminated: earlier.eliminated + self.work.eliminated,
            predictions: earlier.predictions + self.impact_queue.predictions,
            corrected,
            ..StepCounts::default()
        }
    }

    /// Begins another attempt at the same step. The page does not count work, so it drops the earlier counts.
    pub fn try_again(&mut self, moving: usize, pairs: usize) {
        if !GENERAL_ONLY {
            self.work.earlier = self.counts(moving, pairs);
        }
        (self.work.done, self.work.eliminated) = (0, 0);
    }

    /// Whether a step needed more work than it may take.
    pub fn is_over(&self) -> bool {
        self.work.is_over
    }

    /// Finds a step's contact constraints after all bounces, which change velocities and thereby which pairs may
    /// touch. Finds none once the budget is used up.
    pub fn find_contacts(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut PairList,
        steady: &Steady,
        forces: &Forces,
        context: &StepContext,
    ) {
        self.is_large_world = is_large_world(bodies, steady);
        self.impact_queue.begin(bodies.alive.len(), movable(bodies, steady));
        forces.find_sprung(bodies, context.dt, &mut self.impact_queue.paths.sprung);
        self.static_clamp.remember(bodies);
        let may_bounce =
            self.reach(bodies, context) && self.impact_queue.find_candidates(bodies, context);
        pairs.refresh(bodies, context.filter);
        let mut may_impact = false;
        if may_bounce && !pairs.is_over() {
            may_impact = self.impact_queue.leave_out_crowd(bodies, &pairs.pairs, context);
        }
        if pairs.drop_large_boxes(bodies) || may_impact {
            pairs.refresh(bodies, context.filter);
        }
        if may_impact {
            self.find_impacts(bodies, pairs, context);
            self.reach(bodies, context);
            pairs.refresh(bodies, context.filter);
        }
        let work = self.impact_queue.predictions + pairs.pairs.len() as u64;
        if self.work.spend(work) && !pairs.is_over() {
            self.gather(bodies, &pairs.pairs, &steady.takes_no_part, context);
            if context.features.restitution {
                let ImpactQueue { crowd, paths, .. } = &mut self.impact_queue;
                crowd.bounce(bodies, &mut self.contacts, paths, context);
            }
        }
    }

    fn find_impacts(&mut self, bodies: &mut Bodies, pairs: &mut PairList, context: &StepContext) {
        for round in 1..=BOUNCE_ROUNDS_MAX {
            let last = round == BOUNCE_ROUNDS_MAX;
            let (queue, work_max) = (&mut self.impact_queue, self.work.left);
            let progress = queue.process(bodies, &pairs.pairs, context, last, work_max);
            self.work.is_over |= progress == Progress::OverBudget;
            if progress != Progress::BeyondReach || pairs.is_over() {
                break;
            }
            pairs.refresh(bodies, context.filter);
        }
    }

    /// Sets the reach of each moving body. Returns whether any of them may bounce or pass another body within the
    /// step.
    fn reach(&self, bodies: &mut Bodies, context: &StepContext) -> bool {
        let (fall, mut fastest) = (context.fall_distance(), 0.0);
        let thinnest = bodies.thinnest();
        let Bodies { moving, motion, velocity, reach, .. } = bodies;
        for &slot in moving.iter() {
            let slot = slot as usize;
            if Bodies::is_pushed(motion[slot]) {
                velocity[slot] = clamp_length(velocity[slot], context.speed_max);
            }
            let squared = velocity[slot].length_squared();
            reach[slot] = self::reach(squared, fall, context.dt);
            fastest = max(fastest, squared);
        }
        context.features.restitution || fastest.sqrt() * context.dt > thinnest
    }

    /// Whether the step has had bounces so far.
    pub fn has_bounced(&self) -> bool {
        self.impact_queue.crowd.has_bounced || !self.impact_queue.is_empty()
    }

    /// Completes the pair list after the reach of bodies was extended.
    pub fn refresh(&mut self, bodies: &Bodies, pairs: &mut PairList, context: &StepContext) {
        if pairs.refresh(bodies, context.filter) && !pairs.is_over() {
            late_pairs::reindex_pairs(&mut self.contacts.constraints, &pairs.pairs);
        }
    }

    fn gather(
        &mut self,
        bodies: &Bodies,
        pairs: &[Pair],
        takes_no_part: &[bool],
        context: &StepContext,
    ) {
        if bodies.moving.is_empty() {
            self.contacts.clear();
            return;
        }
        let step = GatherStep { dt: context.dt, fall: context.fall_distance() };
        let paths = &self.impact_queue.paths;
        let gather = match context.features.takes_shapes() {
            shapes::CIRCLES => contact_constraint::gather::<{ shapes::CIRCLES }>,
            shapes::BOXES => contact_constraint::gather::<{ shapes::BOXES }>,
            _ => contact_constraint::gather::<{ shapes::BOTH }>,
        };
        gather(
            bodies,
            pairs,
            takes_no_part,
            paths,
            step,
            &mut self.contacts,
            &mut self.gather_scratch,
        );
    }

    /// Pairs that bounced or have a constraint.
    pub fn contacting_pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let impacts = self.impact_queue.impacts.iter().map(|impact| [impact.a, impact.b]);
        impacts
            .chain(self.contacts.constraints.iter().map(|constraint| [constraint.a, constraint.b]))
    }

    /// Finds the velocities at the end of the step, solving again as long as they bring new pairs
    /// together.
    pub fn find_velocities(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut PairList,
        moves: &[Move],
        context: &StepContext,
    ) {
        self.solve(bodies, moves, context);
        self.solve_late_pairs(bodies, pairs, moves, context);
    }

    fn solve_late_pairs(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut PairList,
        moves: &[Move],
        context: &StepContext,
    ) {
        for _ in 0..late_pairs::ROUNDS_MAX {
            if !self.late_pairs.extend_reach(bodies, moves, context.dt) || self.work.is_over {
                return;
            }
            self.refresh(bodies, pairs, context);
            if pairs.is_over() {
                return;
            }
            if !self.add_late_pairs(bodies, &pairs.pairs, context) {
                return;
            }
        }
    }

    fn solve(&mut self, bodies: &mut Bodies, moves: &[Move], context: &StepContext) {
        impact_queue::mark_bounced(&self.impact_queue.impacts, &mut self.contacts);
        let gain = context.gravity * context.dt;
        let start_velocity = &mut self.displacements.start_velocity;
        if !integrate::accelerate(bodies, gain, context.speed_max, start_velocity) {
            self.contacts.drop_non_finite(bodies);
        }
        integrate::apply_moves(bodies, moves, context.dt, &mut self.displacements);
        if !self.impact_queue.paths.sprung.is_empty() {
            self.set_masses(bodies);
        }
        self.find_islands(bodies.alive.len());
        self.late_pairs.begin(bodies.alive.len());
        self.work.sweeps = 0;
        self.work.done = self.impact_queue.predictions;
        (self.work.eliminated, self.work.very_stiff) = (0, 0);
        for number in 0..self.islands.count() {
            let work_before = self.work.done;
            let island = &self.islands.constraints[self.islands.range(number)];
            match *island {
                [index] => self.solve_single(index, bodies, context),
                _ => {
                    let (constraints, velocity) =
                        (&mut self.contacts.constraints, &mut bodies.velocity);
                    match context.features.takes_friction() {
                        true => warm_start::start::<true>(constraints, island, velocity),
                        false => warm_start::start::<false>(constraints, island, velocity),
                    }
                    self.solve_island(number, false, bodies, context);
                }
            }
            if !self.work.spend(self.work.done - work_before) {
                return;
            }
        }
    }

    /// Finds the islands of the constraints among `slots` bodies, and makes room for solving them.
    fn find_islands(&mut self, slots: usize) {
        self.islands.find(slots, &self.contacts.constraints, None);
        if self.islands.count() > 0 {
            self.blocks.reserve(slots);
        }
    }

    /// Updates the constraints' masses, which springs may have raised.
    fn set_masses(&mut self, bodies: &Bodies) {
        for constraint in &mut self.contacts.constraints {
            constraint.inv_mass_a = bodies.inverse_mass[constraint.a as usize];
            constraint.inv_mass_b = bodies.inverse_mass[constraint.b as usize];
            constraint.effective_mass = 1.0 / (constraint.inv_mass_a + constraint.inv_mass_b);
        }
    }

    /// Adds pairs that the new velocities bring together, and solves their islands. Returns whether there were any.
    fn add_late_pairs(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        context: &StepContext,
    ) -> bool {
        let paths = &self.impact_queue.paths;
        if !self.late_pairs.gather(bodies, pairs, paths, context, &mut self.contacts) {
            return false;
        }
        self.find_islands(bodies.alive.len());
        for number in 0..self.islands.count() {
            let island = &self.islands.constraints[self.islands.range(number)];
            if island.iter().any(|&index| self.late_pairs.is_new[index as usize]) {
                for &index in island {
                    self.contacts.infos[index as usize].correction = Correction::Thorough;
                }
                let work_before = self.work.done;
                self.solve_island(number, true, bodies, context);
                if !self.work.spend(self.work.done - work_before) {
                    return false;
                }
            }
        }
        true
    }

    /// Stores the impulses for the next step.
    pub fn store(&mut self, bodies: &Bodies, pairs: &mut [Pair], steady: &Steady) {
        let constraints = &self.contacts.constraints;
        if steady.is_on {
            contact_constraint::find_changed(bodies, constraints, pairs, &mut self.is_changed);
        }
        contact_constraint::store(bodies, constraints, pairs, &steady.takes_no_part);
    }

    /// Excludes everything that this step did not change from the next step.
    pub fn leave_out(
        &self,
        bodies: &mut Bodies,
        steady: &mut Steady,
        kill_zone: &Aabb,
        context: &StepContext,
    ) {
        let constraints = &self.contacts.constraints;
        // If constraints of bodies that are not finite were dropped, the islands differ. Eliminations and the sweeps
        // before them count towards limits shared by all islands.
        let is_complete = constraints.len() == self.is_changed.len()
            && self.work.eliminated == 0
            && self.work.very_stiff == 0;
        if is_complete && !impact_queue::still_bodies_may_impact(context) {
            let fall = context.fall_distance();
            let reach = |velocity: Vec2| reach(velocity.length_squared(), fall, context.dt);
            let contacts =
                StepContacts { constraints, islands: &self.islands, is_changed: &self.is_changed };
            steady.leave_out(bodies, contacts, kill_zone, reach);
        }
    }

    /// Finds the positions at the end of the step.
    pub fn find_positions(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        moves: &[Move],
        context: &StepContext,
    ) {
        integrate::finish_moves(bodies, moves, context.dt, &mut self.displacements);
        let moved =
            integrate::move_bodies(bodies, &mut self.contacts, &mut self.displacements, context);
        if !moved.is_finite {
            self.contacts.drop_non_finite(bodies);
        }
        let slop = context.settings.slop;
        // Late pairs ignore bodies in motion, and those that fall slightly into a wall before they bounce.
        let is_unsure = self.late_pairs.any_in_motion || context.features.restitution;
        let may_tunnel =
            self.static_clamp.may_tunnel(bodies, moved.separation_min, slop, is_unsure);
        self.work.corrections = 0;
        if moved.overlaps {
            self.work.corrections = self.position_correction.separate(
                bodies,
                &mut self.contacts,
                pairs,
                &mut self.blocks,
                &mut self.displacements,
                context,
            );
            self.work.spend(self.work.corrections);
        }
        if moved.overlaps || may_tunnel {
            self.static_clamp.resolve(bodies, pairs, &self.impact_queue.paths, context);
        }
    }

    /// Pairs that have an impulse, bounced or overlap at the end of the step.
    pub fn touching(&self) -> impl DoubleEndedIterator<Item = Found> + Clone {
        let constraints = self.contacts.constraints.iter().zip(&self.contacts.infos);
        constraints
            .filter(|(constraint, info)| {
                constraint.normal_impulse > 0.0 || info.bounced || info.separation_after < 0.0
            })
            .map(|(constraint, info)| Found {
                a: constraint.a,
                b: constraint.b,
                normal: constraint.normal,
                depth: max(-info.separation_after, 0.0),
                closing: info.closing,
            })
    }
}

/// Whether more than [`LARGE_WORLD`] bodies can move.
fn is_large_world(bodies: &Bodies, steady: &Steady) -> bool {
    movable(bodies, steady) > LARGE_WORLD
}

/// Number of movable bodies, including those left out of the step.
fn movable(bodies: &Bodies, steady: &Steady) -> usize {
    bodies.moving.len() + steady.count()
}

/// The reach of a body with this squared speed if gravity moves it by `fall` in a step.
fn reach(squared_speed: f32, fall: f32, dt: f32) -> f32 {
    REACH_MIN + fall + squared_speed.sqrt() * dt
}

#[cfg(test)]
mod tests;
