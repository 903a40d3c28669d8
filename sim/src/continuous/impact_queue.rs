//! The first part of a step handles impacts, one pair at a time, each at its own time of impact.
//!
//! Simultaneous impact laws spread an impact over everything in contact and lose energy; handling one pair at a
//! time conserves energy and momentum exactly. A queue holds the next impacts, ordered by (time, pair). Each
//! impact gives the two bodies their impulse (by Newton's law of restitution, with Coulomb friction), after which
//! their other pairs are predicted again (Alder and Wainwright 1959, "Studies in molecular dynamics"; see
//! `impact_prediction`).
//!
//! A body has one position and one velocity per step. Both belong to its path after its last impact, extended
//! backwards to the start of the step. An impulse at time t that changes the velocity by d therefore moves the start
//! of the path by -d t. The rest of the step only needs the time from which the path is valid.
//!
//! Pairs that do not bounce are handled here too if one body moves by more than the size of the other. A constraint
//! is a single tangent for the whole step, and a body that is stopped and then slides within the step soon leaves
//! it far behind. All other pairs are left to the constraints, unless one of their bodies has an impact later in
//! the step. In that case they first stop each other here, and resting contacts hold until that impact. A path is
//! swept along its chord, since shapes are swept along straight lines. Gravity bends it, so before each impact both
//! bodies are checked for obstructions up to that time.

use super::crowd::Crowd;
use super::impact_prediction::{
    Hit, as_obstruction, bounces, gravity_on, predict, restitution, tunnels,
};
use super::paths::{Paths, is_fast};
use crate::bodies::{Bodies, REACH_MIN};
use crate::broad_phase::pairs::{Pair, near};
use crate::math::{clamp, clamp_length, max};
use crate::solver::contact_constraint::ContactSet;
use crate::solver::step_context::StepContext;
use glam::Vec2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Maximum number of impacts of a body per step. After this many, it stays at its last impact
/// point, and the contact solver handles the rest of the step.
const IMPACTS_MAX: u32 = 32;
/// A pair is fast if one of the two bodies moves by more than this many half-sizes of the smaller
/// one in a step.
const FAST: f32 = 4.0;
/// Number of predictions in a step, per movable body and in total, after which the remaining impacts are handled as
/// in a crowd. This applies to worlds with more such bodies than [`FEW_BODIES`]. In a small room, a few fast bodies
/// may need more predictions and would gain energy without them, so there the limit is [`PREDICTIONS_FEW_MAX`].
const PREDICTIONS_PER_BODY: u64 = 40;
const PREDICTIONS_MIN: u64 = 40_000;
const FEW_BODIES: usize = 128;
const PREDICTIONS_FEW_MAX: u64 = 700_000;
/// Number of waiting bodies that can be searched in the time of one prediction. Every impact searches them all.
const WAITING_PER_PREDICTION: u64 = 8;
/// Number of pairs within reach that a round can check in the time of one prediction.
const PAIRS_PER_PREDICTION: u64 = 8;
/// Maximum depth of the search for an obstruction that is itself obstructed.
const OBSTRUCTIONS_MAX: u32 = 8;
/// Maximum number of queued impacts for each pair that the budget allows. Outdated ones count too.
const QUEUED_PER_PAIR: usize = 4;

/// An impact of this step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Impact {
    pub a: u32,
    pub b: u32,
    /// Closing speed, units/s.
    pub closing: f32,
}

/// A predicted impact, ordered by time, then by pair. It is valid until one of the bodies has another impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Event {
    time_bits: u32,
    pair: u32,
    /// Number of impacts that both bodies together have had so far.
    version: u32,
}

/// The impacts of a step, and scratch memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImpactQueue {
    pub impacts: Vec<Impact>,
    /// Number of predictions in this step, a measure of the cost of its impacts.
    pub predictions: u64,
    /// Number of movable bodies, including those in steady islands.
    movable: usize,
    pub paths: Paths,
    pub crowd: Crowd,
    /// By slot: number of impacts in this step.
    impact_count: Vec<u32>,
    /// Slots with at least one impact.
    impacted: Vec<u32>,
    /// By slot: whether the body may have an impact.
    may_impact: Vec<bool>,
    /// By slot: whether the body waits for the next round.
    waits: Vec<bool>,
    waiting: Vec<u32>,
    queue: BinaryHeap<Reverse<Event>>,
    /// Indices of the pairs whose bodies may meet in this round.
    near: Vec<u32>,
    /// The same pairs, grouped by body.
    near_of: Vec<u32>,
    /// By slot: start of its pairs in `near_of`, with one more entry for the end.
    starts: Vec<u32>,
}

/// Whether the impacts of a step are complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// All impacts are done.
    Done,
    /// There may be more, with bodies beyond the current reach.
    BeyondReach,
    /// The impacts need more predictions than the step may make.
    OverBudget,
}

impl ImpactQueue {
    /// Returns a queue without impacts, but with the same prediction count.
    pub fn counts(&self) -> ImpactQueue {
        ImpactQueue { predictions: self.predictions, ..ImpactQueue::default() }
    }

    /// Begins a step of a world with this number of slots and of movable bodies.
    pub fn begin(&mut self, slots: usize, movable: usize) {
        self.movable = movable;
        self.impacts.clear();
        self.predictions = 0;
        for slot in self.impacted.drain(..) {
            self.paths.impact_time[slot as usize] = 0.0;
            self.impact_count[slot as usize] = 0;
        }
        self.paths.impact_time.resize(slots, 0.0);
        self.impact_count.resize(slots, 0);
        self.waits.resize(slots, false);
    }

    /// Whether the step had no impact.
    pub fn is_empty(&self) -> bool {
        self.impacted.is_empty()
    }

    /// Finds the bodies that may have an impact, which are fast ones and those that may bounce. If two bodies
    /// close faster than the threshold, at least one is faster than half of it. Returns whether any were found.
    pub fn find_candidates(&mut self, bodies: &mut Bodies, context: &StepContext) -> bool {
        self.may_impact.clear();
        self.may_impact.resize(bodies.alive.len(), false);
        let bounce_speed = bounce_speed(context);
        let fast_speed = FAST * bodies.thinnest() / context.dt;
        let mut any = false;
        for &slot in &bodies.moving {
            let slot = slot as usize;
            let squared = bodies.velocity[slot].length_squared();
            let may_bounce = bounce_speed < 0.0 || squared > bounce_speed * bounce_speed;
            let bounces = may_bounce && bodies.material[slot].restitution > 0.0;
            self.may_impact[slot] = bounces || squared > fast_speed * fast_speed;
            any |= self.may_impact[slot];
        }
        any
    }

    /// Leaves out crowded bodies, and returns whether any other body may have an impact. Extends the reach of fast
    /// bodies, and of bodies in a gas, to twice their path plus their own thickness, since a bounce may make them
    /// faster. Bodies that outrun this reach take another round.
    pub fn leave_out_crowd(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        context: &StepContext,
    ) -> bool {
        self.crowd.find(bodies, pairs, &self.paths, context);
        let is_weightless = context.gravity == Vec2::ZERO;
        let mut any = false;
        for index in 0..bodies.moving.len() {
            let slot = bodies.moving[index];
            let may_impact = &mut self.may_impact[slot as usize];
            *may_impact &= !self.crowd.has(slot);
            if !*may_impact {
                continue;
            }
            any = true;
            let slot = slot as usize;
            let (thickness, path) =
                (bodies.thickness(slot), bodies.velocity[slot].length() * context.dt);
            let is_elastic = is_weightless && bodies.material[slot].restitution >= 1.0;
            if is_elastic || path > FAST * thickness {
                bodies.reach[slot] += 0.5 * (path + thickness);
            }
        }
        any
    }

    /// Extends the reach of a body that outruns it, and defers its further impacts to the next round.
    fn extend_reach_of_impacted(&mut self, bodies: &mut Bodies, slot: u32, context: &StepContext) {
        if outruns_reach(bodies, slot, context.dt) {
            let index = slot as usize;
            let path = bodies.velocity[index].length() * context.dt;
            let reach = REACH_MIN + context.fall_distance() + 2.0 * path + bodies.thickness(index);
            bodies.reach[index] = reach;
            self.let_wait(bodies, slot);
        }
    }

    /// Processes impacts in chronological order, stopping when more than `predictions_max` predictions were needed.
    /// Except in the `last` round, a body that becomes faster than its reach allows has to wait, since the list may
    /// lack some of its pairs. Every body within its reach waits too, as it would otherwise get ahead in time. The
    /// next round continues with the waiting bodies.
    pub fn process(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        context: &StepContext,
        last: bool,
        predictions_max: u64,
    ) -> Progress {
        self.fill_queue(bodies, pairs, context);
        if self.queue.is_empty() {
            return Progress::Done;
        }
        self.list_pairs(bodies, pairs);
        self.paths.impact_position.resize(bodies.alive.len(), Vec2::ZERO);
        let queued_max = context.filter.pairs_max.saturating_mul(QUEUED_PER_PAIR);
        let enough = max_predictions(self.movable);
        while let Some(Reverse(event)) = self.queue.pop() {
            self.predictions += self.waiting.len() as u64 / WAITING_PER_PREDICTION;
            if self.predictions > predictions_max || self.queue.len() > queued_max {
                return Progress::OverBudget;
            }
            if self.predictions > enough {
                self.waiting.drain(..).for_each(|slot| self.waits[slot as usize] = false);
                return Progress::Done;
            }
            let pair = &pairs[event.pair as usize];
            if event.version != self.version(pair) {
                continue;
            }
            let time = f32::from_bits(event.time_bits);
            let obstruction = self.find_obstruction(bodies, pairs, pair, time, context);
            let stops = obstruction.as_ref().map_or(pair, |(other, _)| other);
            let ends = [pair.a, pair.b, stops.a, stops.b];
            if ends.into_iter().any(|slot| self.meets_waiting(bodies, slot)) {
                ends.into_iter().for_each(|slot| self.let_wait(bodies, slot));
                continue;
            }
            let (pair, hit) = match obstruction {
                // Between closing walls this would never end, so the constraints hold both bodies.
                Some((other, _)) if self.has_exhausted_impacts(other) => continue,
                Some(found) => found,
                None => match predict(bodies, &self.paths, pair, context.dt, context) {
                    Some(hit) if hit.closing > 0.0 => (pair, hit),
                    Some(_) | None => continue,
                },
            };
            self.apply_impact(bodies, pair, &hit, context);
            self.follow_up(bodies, pairs, &event, pair, context, last);
        }
        if self.waiting.is_empty() { Progress::Done } else { Progress::BeyondReach }
    }

    /// Queues the impacts that follow an event involving `pair`. Both bodies move on, unless it was their last one.
    #[inline]
    fn follow_up(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        event: &Event,
        pair: &Pair,
        context: &StepContext,
        last: bool,
    ) {
        for slot in [pair.a, pair.b] {
            self.push_impacts_of(bodies, pairs, slot, context);
        }
        // Stopping an obstruction may have changed neither body of the event.
        let stopped = &pairs[event.pair as usize];
        if event.version == self.version(stopped) {
            self.push_next_impact(bodies, event.pair, stopped, context);
        }
        if self.has_exhausted_impacts(pair) {
            self.stop_at_impact(bodies, pair.a, context);
            self.stop_at_impact(bodies, pair.b, context);
        }
        if !last {
            self.extend_reach_of_impacted(bodies, pair.a, context);
            self.extend_reach_of_impacted(bodies, pair.b, context);
        }
    }

    /// Queues the first impacts of a round: those of all pairs, or of the bodies that waited for it.
    fn fill_queue(&mut self, bodies: &Bodies, pairs: &[Pair], context: &StepContext) {
        self.queue.clear();
        self.near.clear();
        let continues = !self.waiting.is_empty();
        for (index, pair) in (0u32..).zip(pairs) {
            if !near(bodies, pair.a, pair.b) {
                continue;
            }
            self.near.push(index);
            let counts = match continues {
                true => self.is_waiting(pair),
                false => self.can_impact(pair.a) || self.can_impact(pair.b),
            };
            if counts {
                self.predictions += 1;
                self.push_next_impact(bodies, index, pair, context);
            }
        }
        // Pairs beyond reach are not counted, since the number that are listed depends on when the list was built.
        self.predictions += self.near.len() as u64 / PAIRS_PER_PREDICTION;
        for slot in self.waiting.drain(..) {
            self.waits[slot as usize] = false;
        }
    }

    fn is_waiting(&self, pair: &Pair) -> bool {
        self.waits[pair.a as usize] || self.waits[pair.b as usize]
    }

    /// Whether a body waits, or is within reach of a waiting body, which may still turn towards it.
    fn meets_waiting(&self, bodies: &Bodies, slot: u32) -> bool {
        let may_wait = bodies.inverse_mass[slot as usize] > 0.0;
        may_wait && self.waiting.iter().any(|&other| other == slot || near(bodies, slot, other))
    }

    /// Defers a body's further impacts to the next round. Bodies that nothing can push need not wait.
    fn let_wait(&mut self, bodies: &Bodies, slot: u32) {
        if bodies.inverse_mass[slot as usize] > 0.0 && !self.waits[slot as usize] {
            self.waits[slot as usize] = true;
            self.waiting.push(slot);
        }
    }

    fn can_impact(&self, slot: u32) -> bool {
        self.may_impact[slot as usize] || self.impact_count[slot as usize] > 0
    }

    fn version(&self, pair: &Pair) -> u32 {
        self.impact_count[pair.a as usize] + self.impact_count[pair.b as usize]
    }

    /// Leaves a body at its last impact point, with the whole step still ahead of it.
    fn stop_at_impact(&mut self, bodies: &mut Bodies, slot: u32, context: &StepContext) {
        let slot = slot as usize;
        if bodies.inverse_mass[slot] > 0.0 {
            bodies.center[slot] = self.paths.impact_position[slot];
            let gain = gravity_on(bodies, slot, context) * self.paths.impact_time[slot];
            bodies.velocity[slot] += gain;
            self.paths.impact_time[slot] = 0.0;
            self.impact_count[slot] = IMPACTS_MAX;
        }
    }

    fn has_exhausted_impacts(&self, pair: &Pair) -> bool {
        let of = |slot: u32| self.impact_count[slot as usize];
        of(pair.a) >= IMPACTS_MAX || of(pair.b) >= IMPACTS_MAX
    }

    /// Queues the next impact of a pair, if it has one.
    fn push_next_impact(
        &mut self,
        bodies: &Bodies,
        index: u32,
        pair: &Pair,
        context: &StepContext,
    ) {
        let fast = is_fast(bodies, pair, context.dt, FAST);
        let counts = fast || restitution(bodies, pair) > 0.0;
        let in_crowd = self.crowd.has(pair.a) && self.crowd.has(pair.b);
        if !counts || in_crowd || self.has_exhausted_impacts(pair) {
            return;
        }
        if let Some(hit) = predict(bodies, &self.paths, pair, context.dt, context)
            && (fast && tunnels(bodies, pair, &hit, context)
                || bounces(bodies, pair, &hit, context))
        {
            let (time_bits, version) = (hit.time.to_bits(), self.version(pair));
            self.queue.push(Reverse(Event { time_bits, pair: index, version }));
        }
    }

    /// Queues the next impacts of all pairs of a body whose path has changed.
    fn push_impacts_of(
        &mut self,
        bodies: &Bodies,
        pairs: &[Pair],
        slot: u32,
        context: &StepContext,
    ) {
        let range = self.pairs_near(slot);
        self.predictions += range.len() as u64;
        for entry in range {
            let index = self.near_of[entry];
            self.push_next_impact(bodies, index, &pairs[index as usize], context);
        }
    }

    /// Range of a body's pairs in `near_of`; empty if nothing can push the body.
    fn pairs_near(&self, slot: u32) -> Range<usize> {
        let slot = slot as usize;
        self.starts[slot] as usize..self.starts[slot + 1] as usize
    }

    /// Groups the near pairs by body with a counting sort.
    fn list_pairs(&mut self, bodies: &Bodies, pairs: &[Pair]) {
        let pushed = |&slot: &u32| bodies.inverse_mass[slot as usize] > 0.0;
        self.starts.clear();
        self.starts.resize(bodies.alive.len() + 1, 0);
        for &index in &self.near {
            let Pair { a, b, .. } = pairs[index as usize];
            for slot in [a, b].into_iter().filter(pushed) {
                self.starts[slot as usize] += 1;
            }
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.near_of.clear();
        self.near_of.resize(end as usize, 0);
        for &index in self.near.iter().rev() {
            let Pair { a, b, .. } = pairs[index as usize];
            for slot in [a, b].into_iter().filter(pushed) {
                let start = &mut self.starts[slot as usize];
                *start -= 1;
                self.near_of[*start as usize] = index;
            }
        }
    }

    /// Finds the contact that stops one of the bodies before an impact at this time.
    fn find_obstruction<'a>(
        &mut self,
        bodies: &Bodies,
        pairs: &'a [Pair],
        impacting: &Pair,
        time: f32,
        context: &StepContext,
    ) -> Option<(&'a Pair, Hit)> {
        let mut found = self.first_obstruction(bodies, pairs, impacting, time, context)?;
        for _ in 1..OBSTRUCTIONS_MAX {
            match self.first_obstruction(bodies, pairs, found.0, found.1.time, context) {
                Some(next) if next.1.time < found.1.time => found = next,
                // The pair rests on an obstruction with the same time.
                Some(next) if next.1.depth > 0.0 && found.1.depth == 0.0 => found = next,
                Some(_) | None => break,
            }
        }
        Some(found)
    }

    /// Returns the first pair of either body that would have tunnelled by that time.
    fn first_obstruction<'a>(
        &mut self,
        bodies: &Bodies,
        pairs: &'a [Pair],
        impacting: &Pair,
        time: f32,
        context: &StepContext,
    ) -> Option<(&'a Pair, Hit)> {
        let mut found: Option<(&Pair, Hit)> = None;
        for slot in [impacting.a, impacting.b] {
            let range = self.pairs_near(slot);
            self.predictions += range.len() as u64;
            for &index in &self.near_of[range] {
                let pair = &pairs[index as usize];
                let hit = predict(bodies, &self.paths, pair, time, context);
                let Some(hit) =
                    hit.and_then(|hit| as_obstruction(bodies, pair, hit, time, context))
                else {
                    continue;
                };
                let earlier = found.as_ref().is_none_or(|(other, best)| {
                    (hit.time, pair.a, pair.b) < (best.time, other.a, other.b)
                });
                if earlier {
                    found = Some((pair, hit));
                }
            }
        }
        found
    }

    /// Applies the impulse of an impact, and starts the new paths of both bodies.
    fn apply_impact(&mut self, bodies: &mut Bodies, pair: &Pair, hit: &Hit, context: &StepContext) {
        let restitution =
            if bounces(bodies, pair, hit, context) { restitution(bodies, pair) } else { 0.0 };
        let (a, b) = (pair.a as usize, pair.b as usize);
        let (inv_mass_a, inv_mass_b) = (bodies.inverse_mass[a], bodies.inverse_mass[b]);
        let mass = 1.0 / (inv_mass_a + inv_mass_b);
        let acceleration = gravity_on(bodies, b, context) - gravity_on(bodies, a, context);
        let relative = bodies.velocity[b] - bodies.velocity[a] + acceleration * hit.time;
        let normal = (1.0 + restitution) * hit.closing * mass;
        let along = hit.normal.perp();
        let friction = (bodies.material[a].friction * bodies.material[b].friction).sqrt();
        let limit = friction * normal;
        let tangent = clamp(-along.dot(relative) * mass, -limit, limit);
        let (impulse, out) =
            (hit.normal * normal + along * tangent, hit.normal * (hit.depth * mass));
        for (slot, weight) in [(pair.a, -inv_mass_a), (pair.b, inv_mass_b)] {
            let index = slot as usize;
            if bodies.inverse_mass[index] == 0.0 {
                continue;
            }
            let velocity = bodies.velocity[index] + impulse * weight;
            let velocity = clamp_length(velocity, context.speed_max);
            bodies.center[index] += out * weight - (velocity - bodies.velocity[index]) * hit.time;
            bodies.velocity[index] = velocity;
            if self.impact_count[index] == 0 {
                self.impacted.push(slot);
            }
            self.impact_count[index] += 1;
            let fallen = gravity_on(bodies, index, context) * (0.5 * hit.time * hit.time);
            self.paths.impact_position[index] = bodies.center[index] + velocity * hit.time + fallen;
            self.paths.impact_time[index] = hit.time;
        }
        self.impacts.push(Impact { a: pair.a, b: pair.b, closing: hit.closing });
    }
}

/// Number of predictions in a step after which the remaining impacts are handled as in a crowd, in a world with this
/// many `movable` bodies.
fn max_predictions(movable: usize) -> u64 {
    match movable {
        0..=FEW_BODIES => PREDICTIONS_FEW_MAX,
        count => PREDICTIONS_MIN.max(PREDICTIONS_PER_BODY * count as u64),
    }
}

/// Minimum speed at which a body may bounce. If two bodies close faster than the threshold, at least one is
/// faster than half of it, apart from the effect of gravity.
fn bounce_speed(context: &StepContext) -> f32 {
    0.5 * context.settings.bounce_threshold - context.gravity.length() * context.dt
}

/// Whether a body at rest may bounce.
pub(crate) fn still_bodies_may_impact(context: &StepContext) -> bool {
    context.features.restitution && bounce_speed(context) < 0.0
}

#[inline]
fn outruns_reach(bodies: &Bodies, slot: u32, dt: f32) -> bool {
    let slot = slot as usize;
    bodies.inverse_mass[slot] > 0.0
        && bodies.velocity[slot].length() * dt > bodies.reach[slot] - REACH_MIN
}

/// Marks the constraints of pairs that bounced.
pub(crate) fn mark_bounced(impacts: &[Impact], contacts: &mut ContactSet) {
    for impact in impacts {
        let key = (impact.a, impact.b);
        let found = contacts.constraints.binary_search_by_key(&key, |pair| (pair.a, pair.b));
        if let Ok(index) = found {
            let info = &mut contacts.infos[index];
            info.closing = max(info.closing, impact.closing);
            info.bounced = true;
        }
    }
}
