//! The conjugate solver: velocities that satisfy all contacts at once, found by accelerated sweeps
//! until they converge.
//!
//! One file for each stage, in the order of a step:
//! 1. `impact_queue`: bounces, pair by pair, each at its time of impact;
//! 2. `contact_constraint`: pairs that may touch within the step (`separation` predicts when and
//!    along which normal); `crowd`: the bounces of bodies that lie close to others;
//! 3. `integrate`: gravity, and other forces (see `forces`);
//! 4. `islands`: constraints that share no movable body are solved separately, each with
//!    - `warm_start`: the last step's impulses, as far as they cannot add energy,
//!    - `sweep::solve_in_motion`: where bodies move past each other, a few over-relaxed sweeps over
//!      `graph_coloring`: eight contacts at a time, that share no movable body,
//!    - `local_sweeps`: large islands, with a budget of visits for each contact,
//!    - `sweep`: Gauss-Seidel with conjugate directions until the residual is small, over
//!      `spanning_forest`: the contacts that carry the load, solved exactly if none begins to slide
//!      or to separate, `chains`: along an axis, solved exactly in any case by pooling (`pava`),
//!      and the rest,
//!    - `direct`: elimination, for masses so different that sweeps do not converge,
//!    - `energy_guard`: plain sweeps, or rest, for masses so different that f32 fails,
//!    - `held_after_impact`: bodies that bounced and are held by another contact,
//!    - `late_pairs`: pairs that only these velocities bring together;
//! 5. `integrate`: the bodies move;
//! 6. `position_correction`: removes overlap beyond the slop;
//! 7. `static_clamp`: no body ends inside an immovable one.

use super::contact_constraint::{
    self, ContactConstraint, ContactSet, Correction, GatherScratch, GatherStep,
};
use super::energy_guard::EnergyGuard;
use super::islands::Islands;
use super::local_sweeps::{
    Agitation, LATE_VISITS_PER_CONTACT, LocalSweeps, UNSOLVED_MIN, VISITS_PER_CONTACT, Work,
};
use super::position_correction::PositionCorrection;
use super::step_context::StepContext;
use super::sweep::{Blocks, Sequence, SweepLimits};
use super::{direct, sweep, warm_start};
use crate::bodies::{Bodies, REACH_MIN};
use crate::broad_phase::pairs::{Pair, PairList};
use crate::continuous::held_after_impact;
use crate::continuous::impact_queue::{self, ImpactQueue, Progress};
use crate::continuous::late_pairs::{self, LatePairs};
use crate::continuous::static_clamp::StaticClamp;
use crate::forces::{Forces, Move};
use crate::integrate::{self, Displacements};
use crate::math::{clamp, clamp_length, max, min};
use crate::shape::{Aabb, shapes};
use crate::solver::tolerances::{
    IMPULSE_ROUNDING, LARGE_ISLAND, LARGE_WORLD, LOCAL_ISLAND, MOTION_MIN, SMALL_ISLAND,
    SMALL_ISLAND_SHARE, SPEED_ROUNDING, STIFF_BODIES, STIFF_MASS_RATIO, STIFF_VISITS,
};
use crate::steady::{Steady, StepContacts};
use crate::touches::{Found, Touch};
use glam::Vec2;

/// Fewest sweeps of an island, however many constraints it has.
pub const SWEEPS_MIN: u32 = 4;
/// Times that a step may find that bounces sped bodies up beyond their reach.
const BOUNCE_ROUNDS_MAX: u32 = 16;

/// Scratch of a step; none of it is state.
#[derive(Debug, Default)]
pub(crate) struct ConjugateSolver {
    pub contacts: ContactSet,
    gather_scratch: GatherScratch,
    impact_queue: ImpactQueue,
    islands: Islands,
    blocks: Blocks,
    local_sweeps: LocalSweeps,
    late_pairs: LatePairs,
    energy_guard: EnergyGuard,
    /// Whether more than [`LARGE_WORLD`] bodies can move.
    is_large_world: bool,
    /// By constraint: whether the step changed its impulses, if islands may be left out.
    is_changed: Vec<bool>,
    displacements: Displacements,
    position_correction: PositionCorrection,
    static_clamp: StaticClamp,
    /// Sweeps of the island that needed most.
    pub sweeps: u32,
    /// Visits of constraints by sweeps, and predictions of impacts.
    pub work: u64,
    /// Work that the step may still take.
    work_left: u64,
    /// Whether a step needed more.
    is_over: bool,
}

/// Leaves out the scratch that no comparison of worlds within a step reads: a page that predicts clones its world.
impl Clone for ConjugateSolver {
    fn clone(&self) -> ConjugateSolver {
        let constraints = self.contacts.constraints.clone();
        ConjugateSolver {
            contacts: ContactSet { constraints, infos: Vec::new() },
            is_large_world: self.is_large_world,
            sweeps: self.sweeps,
            work: self.work,
            is_over: self.is_over,
            ..ConjugateSolver::default()
        }
    }
}

/// Limits of the work on an island.
#[derive(Clone, Copy, Debug)]
struct IslandLimits {
    /// Limits of its sweeps.
    sweeps: SweepLimits,
    /// Greatest mass relative to the least.
    mass_ratio: f32,
    /// How it moves, if contacts are swept only where they still change.
    agitation: Option<Agitation>,
}

impl ConjugateSolver {
    /// Begins a step.
    pub fn begin(
        &mut self,
        bodies: &mut Bodies,
        steady: &mut Steady,
        leaves_out: bool,
        work_max: u64,
    ) {
        self.work_left = work_max;
        if is_large_world(bodies, steady) != self.is_large_world {
            // Their islands are solved in another way.
            steady.readmit_all(bodies);
        }
        steady.begin(bodies, leaves_out);
    }

    /// Whether a step needed more work than it may take.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Takes work from what the step may take; returns whether there was enough.
    fn spend(&mut self, work: u64) -> bool {
        self.is_over |= work > self.work_left;
        self.work_left = self.work_left.saturating_sub(work);
        !self.is_over
    }

    /// Finds the contact constraints of a step, once all bounces are done: bounces change
    /// velocities, and with them the pairs that may touch. Finds none where the budget is used up.
    pub fn find_contacts(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut PairList,
        steady: &Steady,
        forces: &Option<Forces>,
        context: &StepContext,
    ) {
        self.is_large_world = is_large_world(bodies, steady);
        self.impact_queue.begin(bodies.alive.len());
        if let Some(forces) = forces {
            forces.find_sprung(bodies, context.dt, &mut self.impact_queue.paths.sprung);
        }
        self.static_clamp.remember(bodies);
        let may_bounce = self.reach(bodies, context, true);
        pairs.refresh(bodies, context.filter);
        if may_bounce && !pairs.is_over() {
            if self.impact_queue.leave_out_crowd(bodies, &pairs.pairs, context) {
                self.find_impacts(bodies, pairs, context);
            }
            self.reach(bodies, context, false);
            pairs.refresh(bodies, context.filter);
        } else {
            self.impact_queue.crowd.clear(bodies.alive.len());
        }
        let work = self.impact_queue.predictions + pairs.pairs.len() as u64;
        if self.spend(work) && !pairs.is_over() {
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
            let (queue, work_max) = (&mut self.impact_queue, self.work_left);
            let progress = queue.process(bodies, &pairs.pairs, context, last, work_max);
            self.is_over |= progress == Progress::OverBudget;
            if progress != Progress::BeyondReach || pairs.is_over() {
                break;
            }
            pairs.refresh(bodies, context.filter);
        }
    }

    /// Sets the reach of each moving body; before bounces also for bodies that it may yet meet.
    /// Returns whether there may be bounces.
    fn reach(&mut self, bodies: &mut Bodies, context: &StepContext, bounces: bool) -> bool {
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
        let may = context.features.restitution || fastest.sqrt() * context.dt > thinnest;
        bounces && may && self.impact_queue.extend_reach(bodies, context)
    }

    /// Whether the step had bounces so far.
    pub fn has_bounced(&self) -> bool {
        self.impact_queue.crowd.has_bounced || !self.impact_queue.is_empty()
    }

    /// Makes the pair list complete after bodies got more reach.
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

    /// Finds the velocities at the end of the step; solves again as long as they bring new pairs
    /// together.
    pub fn find_velocities(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut PairList,
        moves: &[Move],
        context: &StepContext,
    ) {
        self.solve(bodies, &pairs.pairs, moves, context);
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
            if !self.late_pairs.extend_reach(bodies, moves, context.dt) || self.is_over {
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

    fn solve(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        moves: &[Move],
        context: &StepContext,
    ) {
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
        self.blocks.reserve(bodies.alive.len());
        self.local_sweeps.reserve(bodies.alive.len());
        self.islands.find(bodies.alive.len(), &self.contacts.constraints);
        self.late_pairs.begin(bodies.alive.len());
        self.sweeps = 0;
        self.work = self.impact_queue.predictions;
        for number in 0..self.islands.count() {
            let work_before = self.work;
            let island = &self.islands.constraints[self.islands.range(number)];
            match *island {
                [index] if self.is_single(index) => self.solve_single(index, bodies, context),
                _ => {
                    let (constraints, velocity) =
                        (&mut self.contacts.constraints, &mut bodies.velocity);
                    match context.features.takes_friction() {
                        true => warm_start::start::<true>(constraints, island, velocity),
                        false => warm_start::start::<false>(constraints, island, velocity),
                    }
                    self.solve_island(number, VISITS_PER_CONTACT, bodies, pairs, context);
                }
            }
            if !self.spend(self.work - work_before) {
                return;
            }
        }
    }

    /// Gives constraints the masses of their bodies: springs may have raised them since.
    fn set_masses(&mut self, bodies: &Bodies) {
        for constraint in &mut self.contacts.constraints {
            constraint.inv_mass_a = bodies.inverse_mass[constraint.a as usize];
            constraint.inv_mass_b = bodies.inverse_mass[constraint.b as usize];
            constraint.effective_mass = 1.0 / (constraint.inv_mass_a + constraint.inv_mass_b);
        }
    }

    /// Whether an island of this one constraint needs nothing but its own impulses.
    fn is_single(&self, index: u32) -> bool {
        let constraint = &self.contacts.constraints[index as usize];
        let since = &self.impact_queue.paths.impact_time;
        let impacted = since[constraint.a as usize] > 0.0 || since[constraint.b as usize] > 0.0;
        !impacted
    }

    /// Solves a constraint that shares its movable bodies with no other: one visit is exact, since
    /// both impulses act on the same masses; a second one removes the rounding of the first.
    fn solve_single(&mut self, index: u32, bodies: &mut Bodies, context: &StepContext) {
        const VISITS: u32 = 2;
        let rounding = self.rounding(&[index], &bodies.velocity, context);
        let (constraint, velocity) =
            (&mut self.contacts.constraints[index as usize], &mut bodies.velocity);
        let visits = match context.features.takes_friction() {
            true => sweep::solve_single::<true>(constraint, velocity, VISITS, rounding),
            false => sweep::solve_single::<false>(constraint, velocity, VISITS, rounding),
        };
        self.work += u64::from(visits);
        self.sweeps = self.sweeps.max(visits);
    }

    /// Adds pairs that these velocities bring together, and solves their islands; returns whether
    /// there were any.
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
        self.islands.find(bodies.alive.len(), &self.contacts.constraints);
        for number in 0..self.islands.count() {
            let island = &self.islands.constraints[self.islands.range(number)];
            if island.iter().any(|&index| self.late_pairs.is_new[index as usize]) {
                for &index in island {
                    self.contacts.infos[index as usize].correction = Correction::Thorough;
                }
                let work_before = self.work;
                self.solve_island(number, LATE_VISITS_PER_CONTACT, bodies, pairs, context);
                if !self.spend(self.work - work_before) {
                    return false;
                }
            }
        }
        true
    }

    /// Solves the constraints of an island from their present impulses and velocities.
    fn solve_island(
        &mut self,
        number: usize,
        visits_per_contact: u32,
        bodies: &mut Bodies,
        pairs: &[Pair],
        context: &StepContext,
    ) {
        let limits = self.limits(number, visits_per_contact, &bodies.velocity, context);
        let count = self.islands.range(number).len();
        let mut work = Work::on(count, visits_per_contact, limits.sweeps.sweeps_max);
        for _ in 0..held_after_impact::ROUNDS_MAX {
            self.sweep_island(number, bodies, &limits, &mut work);
            let island = &self.islands.constraints[self.islands.range(number)];
            let held = held_after_impact::resolve(
                bodies,
                &mut self.contacts,
                island,
                pairs,
                &mut self.impact_queue,
                &mut self.displacements,
                context,
            );
            if !held {
                break;
            }
        }
        self.work += u64::from(work.visits);
        self.sweeps = self.sweeps.max(work.sweeps);
    }

    /// Sweeps an island until it is solved or its limits are reached.
    fn sweep_island(
        &mut self,
        number: usize,
        bodies: &mut Bodies,
        island_limits: &IslandLimits,
        work: &mut Work,
    ) {
        let island = &self.islands.constraints[self.islands.range(number)];
        let (constraints, velocity) = (&mut self.contacts.constraints, &mut bodies.velocity);
        let IslandLimits { sweeps: limits, mass_ratio, agitation } = *island_limits;
        let is_stiff = mass_ratio > STIFF_MASS_RATIO;
        if is_stiff {
            self.energy_guard.remember(constraints, island, velocity);
        }
        let blocks = &mut self.blocks;
        let mut is_solved = match agitation {
            Some(agitation) if agitation.in_motion => {
                let limits = agitation.motion_limits(limits, island.len(), mass_ratio);
                let sweeps = sweep::solve_in_motion(constraints, island, blocks, velocity, limits);
                work.add(sweeps, island.len());
                self.late_pairs.note_motion(constraints, island);
                sweeps < limits.sweeps_max
            }
            Some(agitation) => {
                let limits = (limits, agitation);
                self.local_sweeps.solve(constraints, island, blocks, velocity, limits, work)
            }
            None => {
                blocks.chains.find(constraints, island);
                // All rounds share the sweeps of the island.
                let sweeps_max = limits.sweeps_max.saturating_sub(work.sweeps).max(SWEEPS_MIN);
                let limits = SweepLimits { sweeps_max, ..limits };
                let sweeps = sweep::solve(constraints, island, blocks, velocity, limits);
                work.add(sweeps, island.len());
                sweeps < sweeps_max
            }
        };
        let in_motion = agitation.is_some_and(|agitation| agitation.in_motion);
        let is_affordable = !in_motion && self.work < direct::STEP_VISITS;
        if !is_solved && is_affordable && direct::is_worth(island.len(), mass_ratio) {
            let (solved, rounds) = direct::solve(constraints, island, velocity, limits.tolerance);
            is_solved = solved;
            work.visits += rounds * direct::VISITS * island.len() as u32;
        }
        if is_stiff {
            self.energy_guard.check(constraints, island, velocity);
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
    }

    /// The limits of the sweeps over an island.
    fn limits(
        &self,
        number: usize,
        visits_per_contact: u32,
        velocity: &[Vec2],
        context: &StepContext,
    ) -> IslandLimits {
        let constraints = &self.contacts.constraints;
        let island = &self.islands.constraints[self.islands.range(number)];
        let (tolerance, mass_ratio) = tolerance(constraints, island, velocity, context);
        let is_stiff = mass_ratio > STIFF_MASS_RATIO;
        let is_exact = is_stiff
            && (direct::is_worth(island.len(), mass_ratio) || is_overfull(constraints, island));
        let local_min = if is_stiff { usize::MAX } else { LOCAL_ISLAND };
        let agitation = (!self.is_large_world && !is_exact && island.len() > MOTION_MIN)
            .then(|| Agitation::of(constraints, island, velocity, tolerance, mass_ratio))
            .filter(|agitation| agitation.in_motion || island.len() >= local_min);
        let mut work_max = context.settings.work_max / island.len() as u32;
        if agitation.is_none() {
            // One sweep more than the step may still take: an island that needs it is over the budget, rather than solved
            // less well than without one. The visits of local sweeps are bounded by their contacts.
            let work_left = (self.work_left / island.len() as u64).saturating_add(1);
            work_max = work_max.min(u32::try_from(work_left).unwrap_or(u32::MAX));
        }
        if is_stiff && direct::is_worth(island.len(), mass_ratio) {
            work_max = work_max.min(direct::SWEEPS_BEFORE);
        } else if is_stiff && !is_exact {
            let visits = STIFF_VISITS / VISITS_PER_CONTACT * visits_per_contact;
            work_max = work_max.min(visits / island.len() as u32);
        }
        let sweeps_max = work_max.max(SWEEPS_MIN).min(context.settings.sweeps_max);
        let friction = context.features.takes_friction();
        let (rounding, sequence) = (self.rounding(island, velocity, context), Sequence::Forests);
        let sweeps = SweepLimits { tolerance, rounding, sweeps_max, sequence, friction };
        IslandLimits { sweeps, mass_ratio, agitation }
    }

    /// Change of a relative velocity that is rounding in an island that was at rest, units/s; 0 in other islands.
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

    /// Stores the impulses for the next step.
    pub fn store(&mut self, bodies: &Bodies, pairs: &mut [Pair], steady: &Steady) {
        let constraints = &self.contacts.constraints;
        if steady.is_on {
            contact_constraint::find_changed(bodies, constraints, pairs, &mut self.is_changed);
        }
        contact_constraint::store(bodies, constraints, pairs, &steady.takes_no_part);
    }

    /// Leaves out of the next step what this one has not changed; `touches` are those of this step.
    pub fn leave_out(
        &self,
        bodies: &mut Bodies,
        steady: &mut Steady,
        touches: &[Touch],
        kill_zone: &Aabb,
        context: &StepContext,
    ) {
        let constraints = &self.contacts.constraints;
        // Constraints of bodies that are not finite were dropped: the islands are others.
        let is_complete = constraints.len() == self.is_changed.len();
        if is_complete && !impact_queue::still_bodies_may_impact(context) {
            let fall = context.fall_distance();
            let reach = |velocity: Vec2| reach(velocity.length_squared(), fall, context.dt);
            let contacts =
                StepContacts { constraints, islands: &self.islands, is_changed: &self.is_changed };
            steady.leave_out(bodies, contacts, touches, kill_zone, reach);
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
        let far = self.static_clamp.may_tunnel(bodies, moved.separation_min, slop);
        let overlaps = moved.separation_min < -slop;
        if overlaps {
            let (contacts, blocks) = (&mut self.contacts, &mut self.blocks);
            self.position_correction.separate(bodies, contacts, pairs, blocks, context.settings);
        }
        if overlaps || far {
            self.static_clamp.resolve(bodies, pairs, &self.impact_queue.paths, slop);
        }
    }

    /// Pairs that have an impulse, bounced or overlap at the end of the step.
    pub fn touching(&self) -> impl Iterator<Item = Found> {
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
    bodies.moving.len() + steady.count() > LARGE_WORLD
}

/// The reach of a body with the square of its speed, which falls by `fall` in a step.
fn reach(squared_speed: f32, fall: f32, dt: f32) -> f32 {
    REACH_MIN + fall + squared_speed.sqrt() * dt
}

/// The change of a relative velocity at which the sweeps over an island end, units/s, and its
/// greatest mass relative to the least.
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

/// Whether an island has at most [`STIFF_BODIES`] that can move, and more contacts than they can have at once, three each:
/// they are in a room that is small beside their paths.
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

#[cfg(test)]
mod tests;
