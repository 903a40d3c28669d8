//! Impacts: bounces, before anything else, one pair at a time, each at its own time in the step.
//!
//! Simultaneous rules spread a blow over everything that touches and lose energy; one pair at a
//! time keeps energy and momentum exactly. A queue holds what will touch next, by (time, pair);
//! who is struck gets the two-body impulse (Newton's law of restitution, with Coulomb friction) and
//! his pairs are looked at again (Alder and Wainwright 1959, "Studies in molecular dynamics").
//! Times are exact under gravity: over the gap s a pair that closes with c and accelerates by g
//! touches with w, w^2 = c^2 + 2 g s, after 2 s / (c + w).
//!
//! A body has one place and one velocity a step, and both are those of its path after its last
//! impact, drawn out backwards to the step's start: an impulse at time t that changes its velocity
//! by d moves that start by -d t. The rest of the step needs to know no more than `since` when the
//! path holds.
//!
//! Pairs that do not bounce are here too if one moves by more than the size of the other: a row is a
//! tangent for a whole step, and whoever is stopped and slides on in the same step is long past it.
//! All others are left to the rows, unless something bounces beyond: then they stop there first, and
//! what rests is held until then. A path is looked at along its chord, since shapes are swept along
//! straight lines; gravity bends it, so whoever is struck is asked what was in the way up to that time.

use super::rows::{Facts, Row, bearable, is_fast, placed, thickness};
use super::{Frame, gap};
use crate::bodies::{Bodies, REACH_MIN};
use crate::body::Motion;
use crate::features::CAN;
use crate::math::{clamp, clamp_length, max, min};
use crate::pairs::{Pair, near};
use glam::Vec2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Impacts of a body in a step. Whoever has had so many stands where the last one was, on a surface,
/// and the rows do the rest.
const IMPACTS_MAX: u32 = 32;
/// A pair is fast where one of the two moves in a step by more than so many half-sizes of the
/// smaller one.
const FAST: f32 = 4.0;
/// How often something is looked for in the way of what is in the way.
const WAYS_MAX: u32 = 8;
/// End of a list of pairs.
const NONE: u32 = u32::MAX;

/// A bounce of this step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strike {
    pub a: u32,
    pub b: u32,
    /// Closing speed, units/s.
    pub closing: f32,
}

/// A touch to come: by time, then by pair. It holds while neither body was struck since.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Event {
    time_bits: u32,
    pair: u32,
    /// Impacts of the two so far.
    version: u32,
}

/// Since when the paths of bodies hold; by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paths {
    /// Seconds into the step; 0 for who was not struck.
    pub since: Vec<f32>,
    /// The place then.
    pub there: Vec<Vec2>,
}

impl Paths {
    /// Since when both paths of a pair hold.
    #[inline]
    pub fn start(&self, pair: &Pair) -> f32 {
        max(self.since[pair.a as usize], self.since[pair.b as usize])
    }

    /// Where a body is at a time after it was struck, if it goes straight on to where its present
    /// speed takes it in the step.
    pub fn place(&self, bodies: &Bodies, slot: u32, time: f32, dt: f32) -> Vec2 {
        let slot = slot as usize;
        let (center, velocity, since) =
            (bodies.center[slot], bodies.velocity[slot], self.since[slot]);
        if since == 0.0 {
            return center + velocity * time;
        }
        let there = self.there[slot];
        if since >= time {
            return there;
        }
        there + (center + velocity * dt - there) * ((time - since) / (dt - since))
    }
}

/// Result and scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Impacts {
    pub strikes: Vec<Strike>,
    pub paths: Paths,
    /// By slot: impacts in this step.
    count: Vec<u32>,
    /// Who was struck.
    struck: Vec<u32>,
    /// Who is held after all: see `squeezes`.
    pub held: Vec<u32>,
    /// By slot: whether it may have an impact.
    lively: Vec<bool>,
    queue: BinaryHeap<Reverse<Event>>,
    /// By slot its first pair, and by pair the next one of either body.
    first: Vec<u32>,
    next: Vec<[u32; 2]>,
}

/// What became of the bounces of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bounces {
    /// There are none.
    None,
    /// All were taken.
    All,
    /// There may be more, with bodies that were out of reach.
    Ahead,
}

/// A touch within the step.
struct Hit {
    normal: Vec2,
    /// Closing speed then, units/s.
    closing: f32,
    /// What gravity adds to it, units/s^2.
    gain: f32,
    /// Seconds into the step.
    time: f32,
    /// How deep gravity has drawn the two into each other by then, world units: 0 unless they rest.
    depth: f32,
}

impl Impacts {
    /// Forgets the last step.
    pub fn begin(&mut self, slots: usize) {
        self.strikes.clear();
        for slot in self.struck.drain(..) {
            self.paths.since[slot as usize] = 0.0;
            self.count[slot as usize] = 0;
        }
        self.paths.since.resize(slots, 0.0);
        self.paths.there.resize(slots, Vec2::ZERO);
        self.count.resize(slots, 0);
    }

    /// Whether nobody was struck.
    pub fn is_empty(&self) -> bool {
        self.struck.is_empty()
    }

    /// Finds who may have an impact at all: who bounces, since of two that close faster than the
    /// threshold one is faster than half of it, and who is fast. Whether there are any. They look
    /// further than their present speeds would take them, since a bounce may make them faster: twice
    /// as far, and as far as the others on average.
    pub fn reach_further(&mut self, bodies: &mut Bodies, frame: &Frame) -> bool {
        self.lively.clear();
        let slow = 0.5 * frame.settings.bounce_threshold - frame.gravity.length() * frame.dt;
        let quick =
            if CAN.continuous { FAST * bodies.thinnest() / frame.dt } else { f32::INFINITY };
        let (mut count, mut sum) = (0, 0.0);
        for &slot in &bodies.moving {
            let slot = slot as usize;
            let squared = bodies.velocity[slot].length_squared();
            let bounces = slow < 0.0 || squared > slow * slow;
            if bounces && bodies.material[slot].restitution > 0.0 || squared > quick * quick {
                self.lively.resize(bodies.alive.len(), false);
                self.lively[slot] = true;
                count += 1;
                sum += squared.sqrt() * frame.dt;
            }
        }
        if count == 0 {
            return false;
        }
        let mean = sum / count as f32;
        for &slot in &bodies.moving {
            let slot = slot as usize;
            if self.lively[slot] {
                bodies.reach[slot] += bodies.velocity[slot].length() * frame.dt + mean;
            }
        }
        true
    }

    /// Takes impacts in the order of their times. Unless it is the `last` time, it ends when one makes
    /// a body faster than its reach: the list may then lack its pairs.
    pub fn take(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        frame: &Frame,
        last: bool,
    ) -> Bounces {
        self.queue.clear();
        for (place, pair) in (0u32..).zip(pairs) {
            if self.lively[pair.a as usize] || self.lively[pair.b as usize] {
                self.expect(bodies, (place, pair), frame);
            }
        }
        if self.queue.is_empty() {
            return Bounces::None;
        }
        self.link(bodies, pairs);
        while let Some(Reverse(event)) = self.queue.pop() {
            let pair = &pairs[event.pair as usize];
            if event.version != self.version(pair) {
                continue;
            }
            let time = f32::from_bits(event.time_bits);
            let (pair, hit) = match self.in_the_way(bodies, pairs, pair, time, frame) {
                // Between walls that close it would never end; the rows hold both.
                Some((other, _)) if self.is_tired(other) => continue,
                Some(found) => found,
                None => match self.look(bodies, pair, frame.dt, frame) {
                    Some(hit) if hit.closing > 0.0 => (pair, hit),
                    Some(_) | None => continue,
                },
            };
            self.strike(bodies, pair, &hit, frame);
            for slot in [pair.a, pair.b] {
                self.expect_again(bodies, pairs, slot, frame);
            }
            if self.is_tired(pair) {
                self.stand(bodies, pair.a, frame);
                self.stand(bodies, pair.b, frame);
            }
            if !last && (outran(bodies, pair.a, frame.dt) || outran(bodies, pair.b, frame.dt)) {
                return Bounces::Ahead;
            }
        }
        Bounces::All
    }

    fn version(&self, pair: &Pair) -> u32 {
        self.count[pair.a as usize] + self.count[pair.b as usize]
    }

    /// Leaves a body where it is now, with a whole step before it.
    fn stand(&mut self, bodies: &mut Bodies, slot: u32, frame: &Frame) {
        let slot = slot as usize;
        if bodies.inverse_mass[slot] > 0.0 {
            bodies.center[slot] = self.paths.there[slot];
            let gain = fall(bodies, slot, frame) * self.paths.since[slot];
            bodies.velocity[slot] += gain;
            self.paths.since[slot] = 0.0;
            self.count[slot] = IMPACTS_MAX;
        }
    }

    fn is_tired(&self, pair: &Pair) -> bool {
        let of = |slot: u32| self.count[slot as usize];
        of(pair.a) >= IMPACTS_MAX || of(pair.b) >= IMPACTS_MAX
    }

    /// Queues the next impact of a pair, if it has one.
    fn expect(&mut self, bodies: &Bodies, (place, pair): (u32, &Pair), frame: &Frame) {
        let fast = is_fast(bodies, pair, frame.dt, FAST);
        let counts = fast || restitution(bodies, pair) > 0.0;
        if !counts || self.is_tired(pair) || !near(bodies, pair.a, pair.b) {
            return;
        }
        if let Some(hit) = self.look(bodies, pair, frame.dt, frame)
            && (fast && goes_through(bodies, pair, &hit, frame)
                || bounces(bodies, pair, &hit, frame))
        {
            let (time_bits, version) = (hit.time.to_bits(), self.version(pair));
            self.queue.push(Reverse(Event { time_bits, pair: place, version }));
        }
    }

    /// The same for all pairs of a body whose path has changed.
    fn expect_again(&mut self, bodies: &Bodies, pairs: &[Pair], slot: u32, frame: &Frame) {
        if bodies.inverse_mass[slot as usize] == 0.0 {
            return;
        }
        let mut place = self.first[slot as usize];
        while place != NONE {
            let pair = &pairs[place as usize];
            self.expect(bodies, (place, pair), frame);
            place = self.next[place as usize][usize::from(pair.b == slot)];
        }
    }

    /// Lists the pairs of every body.
    fn link(&mut self, bodies: &Bodies, pairs: &[Pair]) {
        self.first.clear();
        self.first.resize(bodies.alive.len(), NONE);
        self.next.clear();
        for (place, pair) in (0u32..).zip(pairs) {
            let [a, b] = [pair.a as usize, pair.b as usize];
            self.next.push([self.first[a], self.first[b]]);
            (self.first[a], self.first[b]) = (place, place);
        }
    }

    /// What stops a pair before it strikes at that time.
    fn in_the_way<'a>(
        &self,
        bodies: &Bodies,
        pairs: &'a [Pair],
        struck: &Pair,
        time: f32,
        frame: &Frame,
    ) -> Option<(&'a Pair, Hit)> {
        let mut found = self.first_passed(bodies, pairs, struck, time, frame)?;
        for _ in 1..WAYS_MAX {
            match self.first_passed(bodies, pairs, found.0, found.1.time, frame) {
                Some(next) if next.1.time < found.1.time => found = next,
                // It rests on something up to the same time.
                Some(next) if next.1.depth > 0.0 && found.1.depth == 0.0 => found = next,
                Some(_) | None => break,
            }
        }
        Some(found)
    }

    /// The first pair of either body that would be through each other by then.
    fn first_passed<'a>(
        &self,
        bodies: &Bodies,
        pairs: &'a [Pair],
        struck: &Pair,
        time: f32,
        frame: &Frame,
    ) -> Option<(&'a Pair, Hit)> {
        let mut found: Option<(&Pair, Hit)> = None;
        for slot in [struck.a, struck.b] {
            if bodies.inverse_mass[slot as usize] == 0.0 {
                continue;
            }
            let mut place = self.first[slot as usize];
            while place != NONE {
                let pair = &pairs[place as usize];
                place = self.next[place as usize][usize::from(pair.b == slot)];
                if !near(bodies, pair.a, pair.b) {
                    continue;
                }
                let hit = self.look(bodies, pair, time, frame);
                let Some(hit) = hit.and_then(|hit| passed(bodies, pair, hit, time, frame)) else {
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

    /// The next touch of a pair as it moves now, until a time.
    fn look(&self, bodies: &Bodies, pair: &Pair, until: f32, frame: &Frame) -> Option<Hit> {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let start = max(self.paths.since[a], self.paths.since[b]);
        let left = until - start;
        if left <= 0.0 {
            return None;
        }
        let acceleration = fall(bodies, b, frame) - fall(bodies, a, frame);
        let first = bodies.velocity[b] - bodies.velocity[a];
        let velocity = first + acceleration * start;
        let ahead = (first + velocity) * (0.5 * start);
        let path = (velocity + acceleration * (0.5 * left)) * left;
        let (at_a, mut at_b) = (placed(bodies, pair.a), placed(bodies, pair.b));
        at_b.center += ahead;
        let apart =
            (at_b.center - at_a.center).abs() - at_a.shape.half_extent() - at_b.shape.half_extent();
        if apart.x > path.x.abs() || apart.y > path.y.abs() {
            return None;
        }
        let gap = gap::between(at_a, at_b, path, pair.axis)?;
        let (distance, closing) = (max(gap.separation, 0.0), -gap.normal.dot(velocity));
        let gain = -gap.normal.dot(acceleration);
        let squared = closing * closing + 2.0 * gain * distance;
        let touching = if squared >= 0.0 { squared.sqrt() } else { return None };
        let after = if closing > 0.0 {
            2.0 * distance / (closing + touching)
        } else if gain > 0.0 {
            (touching - closing) / gain
        } else {
            return None;
        };
        let time = start + after;
        let hit = Hit { normal: gap.normal, closing: touching, gain, time, depth: 0.0 };
        (after <= left).then_some(hit)
    }

    /// Gives both bodies of a pair their new paths.
    fn strike(&mut self, bodies: &mut Bodies, pair: &Pair, hit: &Hit, frame: &Frame) {
        let restitution =
            if bounces(bodies, pair, hit, frame) { restitution(bodies, pair) } else { 0.0 };
        let (a, b) = (pair.a as usize, pair.b as usize);
        let (weight_a, weight_b) = (bodies.inverse_mass[a], bodies.inverse_mass[b]);
        let mass = 1.0 / (weight_a + weight_b);
        let acceleration = fall(bodies, b, frame) - fall(bodies, a, frame);
        let relative = bodies.velocity[b] - bodies.velocity[a] + acceleration * hit.time;
        let press = (1.0 + restitution) * hit.closing * mass;
        let along = hit.normal.perp();
        let friction = (bodies.material[a].friction * bodies.material[b].friction).sqrt();
        let limit = friction * press;
        let rub = clamp(-along.dot(relative) * mass, -limit, limit);
        let (impulse, out) = (hit.normal * press + along * rub, hit.normal * (hit.depth * mass));
        for (slot, weight) in [(pair.a, -weight_a), (pair.b, weight_b)] {
            let index = slot as usize;
            if bodies.inverse_mass[index] == 0.0 {
                continue;
            }
            let velocity = bodies.velocity[index] + impulse * weight;
            let velocity = clamp_length(velocity, frame.speed_max);
            bodies.center[index] += out * weight - (velocity - bodies.velocity[index]) * hit.time;
            bodies.velocity[index] = velocity;
            if self.count[index] == 0 {
                self.struck.push(slot);
            }
            self.count[index] += 1;
            let fallen = fall(bodies, index, frame) * (0.5 * hit.time * hit.time);
            self.paths.there[index] = bodies.center[index] + velocity * hit.time + fallen;
            self.paths.since[index] = hit.time;
        }
        self.strikes.push(Strike { a: pair.a, b: pair.b, closing: hit.closing });
    }
}

/// Restitution of a pair: the smaller of the two.
#[inline]
fn restitution(bodies: &Bodies, pair: &Pair) -> f32 {
    let of = |slot: u32| bodies.material[slot as usize].restitution;
    min(of(pair.a), of(pair.b))
}

/// Whether a pair bounces off each other.
#[inline]
fn bounces(bodies: &Bodies, pair: &Pair, hit: &Hit, frame: &Frame) -> bool {
    hit.depth == 0.0
        && hit.closing > frame.settings.bounce_threshold
        && restitution(bodies, pair) > 0.0
}

/// Overlap of a pair that is left to the rows: they see to what gravity does in a step.
#[inline]
fn left_alone(bodies: &Bodies, pair: &Pair, frame: &Frame) -> f32 {
    bearable(thickness(bodies, pair), frame.settings.slop + frame.fall())
}

/// Whether a pair that nothing stops overlaps at the end of the step, by more than it may.
#[inline]
fn goes_through(bodies: &Bodies, pair: &Pair, hit: &Hit, frame: &Frame) -> bool {
    (frame.dt - hit.time) * hit.closing > left_alone(bodies, pair, frame)
}

/// What stops a pair that would overlap by then, by more than it may: its touch, or, if only gravity
/// draws it on from there, a support that has held it until then.
#[inline]
fn passed(bodies: &Bodies, pair: &Pair, hit: Hit, time: f32, frame: &Frame) -> Option<Hit> {
    let (since, allowed) = (time - hit.time, left_alone(bodies, pair, frame));
    if since * hit.closing > allowed {
        return Some(hit);
    }
    let depth = since * (hit.closing + 0.5 * hit.gain * since);
    let closing = hit.closing + hit.gain * since;
    (depth > allowed).then_some(Hit { closing, time, depth, ..hit })
}

/// Gravity on a body.
#[inline]
pub(crate) fn fall(bodies: &Bodies, slot: usize, frame: &Frame) -> Vec2 {
    match bodies.motion[slot] {
        Motion::Dynamic => frame.gravity * bodies.gravity_scale[slot],
        Motion::Static | Motion::Kinematic => Vec2::ZERO,
    }
}

#[inline]
fn outran(bodies: &Bodies, slot: u32, dt: f32) -> bool {
    let slot = slot as usize;
    bodies.inverse_mass[slot] > 0.0
        && bodies.velocity[slot].length() * dt > bodies.reach[slot] - REACH_MIN
}

/// Tells the rows who bounced.
pub(crate) fn mark(strikes: &mut [Strike], rows: &[Row], facts: &mut [Facts]) {
    strikes.sort_unstable_by_key(|strike| (strike.a, strike.b));
    let mut place = 0;
    for strike in strikes.iter() {
        while place < rows.len() && (rows[place].a, rows[place].b) < (strike.a, strike.b) {
            place += 1;
        }
        if place < rows.len() && (rows[place].a, rows[place].b) == (strike.a, strike.b) {
            facts[place].closing = max(facts[place].closing, strike.closing);
            facts[place].struck = true;
        }
    }
}
