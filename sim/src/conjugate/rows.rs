//! Rows: for every pair that may touch within the step, what the solver needs to know of it.
//!
//! A row asks two things of the velocities at the end of the step. Along the normal the bodies may
//! close no more than their gap: n.(vb - va) >= -s / h, held by an impulse that only pushes. Across
//! it Coulomb friction opposes sliding by at most mu times that impulse. Pairs that are still apart
//! have rows too (speculative contacts; Catto 2013, "Continuous collision"): a body lands exactly
//! and nothing overlaps. A row that does not push costs one comparison a sweep.

use super::gap::{self, FAR, Gap, Placed};
use super::impacts::Paths;
use crate::bodies::Bodies;
use crate::features::CAN;
use crate::math::{max, min};
use crate::pairs::{Axis, Pair, near, shapes};
use glam::Vec2;

/// Distance within which a pair has a row even if neither body moves, world units.
const SPECULATIVE: f32 = 0.02;
/// A gap of at most this share of the coordinates is rounding: to close it would take a speed that
/// moves nobody.
const ROUNDING: f32 = 1.2e-7;
/// Share of the greatest friction from which on a pair slides.
const SLIDING: f32 = 0.999;
/// Share of the thinner one's half-size that two bodies may overlap at most, whatever else is left
/// alone: who is in a wall to the middle has no side any more.
const THIN_SHARE: f32 = 0.25;

/// Overlap, as a share of the thinner one's half-size, from which on it does not say a side.
const SIDELESS: f32 = 0.5;
/// Rows with such an overlap that every body has at least.
const CROWD: u8 = 32;

/// What a sweep reads and writes of a pair: one cache line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub a: u32,
    pub b: u32,
    /// Unit vector from a to b; friction acts along it turned left.
    pub normal: Vec2,
    /// Least relative speed along the normal, units/s; not positive.
    pub bound: f32,
    /// Effective mass: 1 / (sum of the inverse masses).
    pub mass: f32,
    /// Inverse masses.
    pub weight_a: f32,
    pub weight_b: f32,
    /// Coulomb coefficient: geometric mean of the two.
    pub friction: f32,
    /// Accumulated impulses of this step: along the normal, not negative, and across it.
    pub press: f32,
    pub rub: f32,
    /// What they were before the last sweep.
    pub press_before: f32,
    pub rub_before: f32,
    /// The direction of the conjugate gradients.
    pub press_along: f32,
    pub rub_along: f32,
    /// Place in the pair list.
    pub pair: u32,
}

/// What is known of a row beside the sweeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts {
    /// Distance that the two may close along the normal, world units; negative where they overlap.
    pub separation: f32,
    /// What is left of it after the bodies moved.
    pub left: f32,
    /// Largest closing speed met in this step, units/s; not negative.
    pub closing: f32,
    /// Whether the two bounced in this step.
    pub struck: bool,
    /// Whether one of them moves by more than the smaller one's half-size.
    pub fast: bool,
    /// Whether the two slid on each other in the last step.
    pub slid: bool,
}

/// What rows need to know of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    /// Its length, seconds.
    pub dt: f32,
    /// How far gravity takes a body, world units.
    pub fall: f32,
    /// Whether somebody may move by more than the thinnest body's half-size.
    pub quick: bool,
}

/// The rows of a step in (a, b) order, from where the bodies are and how they move before gravity
/// and contacts act, in a world with these [`shapes`] only. Of a crowd at one place, whose
/// pairs are as many as the square of its bodies, [`CROWD`] a body have rows: these part first.
/// Whether one row is of a fast pair.
pub(crate) fn gather<const SHAPES: u8>(
    bodies: &Bodies,
    pairs: &[Pair],
    paths: &Paths,
    step: Step,
    (rows, facts, crowd): (&mut Vec<Row>, &mut Vec<Facts>, &mut Vec<u8>),
) -> bool {
    let Step { dt, fall, .. } = step;
    let mut doubtful = false;
    rows.clear();
    facts.clear();
    crowd.clear();
    crowd.resize(bodies.alive.len(), 0);
    for (place, pair) in (0u32..).zip(pairs) {
        if !near(bodies, pair.a, pair.b) {
            continue;
        }
        let (a, b) = (pair.a as usize, pair.b as usize);
        let (velocity_a, velocity_b) = (bodies.velocity[a], bodies.velocity[b]);
        let path = (velocity_b - velocity_a) * dt;
        let gap = sight::<SHAPES>(bodies, paths, pair, path, dt);
        let Some(gap) = gap else { continue };
        // Their own speeds, not the relative one: what stops one of them must not let it overlap
        // the other, beside which it fell so far.
        let speeds = gap.normal.dot(velocity_a).abs() + gap.normal.dot(velocity_b).abs();
        if gap.separation == FAR || gap.separation < SPECULATIVE + fall + speeds * dt {
            let (row, fact) = meet::<SHAPES>(bodies, pair, place, gap, step);
            if row.is_sideless(bodies, gap.separation) {
                if crowd[a] >= CROWD && crowd[b] >= CROWD {
                    continue;
                }
                crowd[a] = crowd[a].saturating_add(1);
                crowd[b] = crowd[b].saturating_add(1);
            }
            doubtful |= fact.fast;
            rows.push(row);
            facts.push(fact);
        }
    }
    doubtful
}

/// The row of a pair.
#[inline]
pub(crate) fn meet<const SHAPES: u8>(
    bodies: &Bodies,
    pair: &Pair,
    place: u32,
    gap: Gap,
    Step { dt, quick, .. }: Step,
) -> (Row, Facts) {
    let (a, b) = (pair.a as usize, pair.b as usize);
    let passes = gap.separation == FAR;
    let approach = -gap.normal.dot(bodies.velocity[b] - bodies.velocity[a]);
    let size = gap.normal.abs().dot(bodies.center[a].abs() + bodies.center[b].abs());
    let apart = gap.separation > ROUNDING * size;
    let bound = if apart { -gap.separation / dt } else { 0.0 };
    let mut row = row::<SHAPES>(bodies, pair, place, gap.normal, bound);
    if passes {
        (row.press, row.rub) = (0.0, 0.0);
    }
    let facts = Facts {
        separation: gap.separation,
        left: gap.separation,
        closing: max(approach, 0.0),
        struck: false,
        fast: passes || quick && is_fast(bodies, pair, dt, 1.0),
        slid: row.press > 0.0 && !row.sticks(),
    };
    (row, facts)
}

/// The gap of a pair of which b moves by `path` in the step relative to a. Where one was struck in
/// the step they are looked at from then on, but it is measured from where their paths begin: that
/// may be within each other.
#[inline]
pub(crate) fn sight<const SHAPES: u8>(
    bodies: &Bodies,
    paths: &Paths,
    pair: &Pair,
    path: Vec2,
    dt: f32,
) -> Option<Gap> {
    let (mut at_a, mut at_b) =
        (placed_of::<SHAPES>(bodies, pair.a), placed_of::<SHAPES>(bodies, pair.b));
    let start = paths.start(pair);
    if start == 0.0 {
        return gap::between(at_a, at_b, path, pair.axis);
    }
    let begin = at_b.center - at_a.center;
    at_a.center = paths.place(bodies, pair.a, start, dt);
    at_b.center = paths.place(bodies, pair.b, start, dt);
    let ahead = at_b.center - at_a.center - begin;
    let gap = gap::between(at_a, at_b, path - ahead, pair.axis)?;
    if gap.separation == FAR {
        return Some(gap);
    }
    Some(Gap { separation: gap.separation - gap.normal.dot(ahead), ..gap })
}

/// Whether one of a pair moves in a step by more than so many times the smaller one's half-size.
#[inline]
pub(crate) fn is_fast(bodies: &Bodies, pair: &Pair, dt: f32, times: f32) -> bool {
    let speed = |slot: u32| {
        let speed = bodies.velocity[slot as usize].abs();
        max(speed.x, speed.y)
    };
    if !CAN.continuous {
        return false;
    }
    max(speed(pair.a), speed(pair.b)) * dt > times * thickness(bodies, pair)
}

/// The smaller half-size of a pair, world units.
#[inline]
pub(crate) fn thickness(bodies: &Bodies, pair: &Pair) -> f32 {
    let of = |slot: u32| bodies.thickness(slot as usize);
    min(of(pair.a), of(pair.b))
}

/// As much of an overlap that is left alone as bodies of this size may have.
#[inline]
pub(crate) fn bearable(thickness: f32, overlap: f32) -> f32 {
    min(overlap, THIN_SHARE * thickness)
}

#[inline]
pub(crate) fn placed(bodies: &Bodies, slot: u32) -> Placed {
    placed_of::<{ shapes::BOTH }>(bodies, slot)
}

#[inline]
fn placed_of<const SHAPES: u8>(bodies: &Bodies, slot: u32) -> Placed {
    let index = slot as usize;
    Placed { shape: bodies.shape_of::<SHAPES>(index), center: bodies.center[index], slot }
}

#[inline]
fn row<const SHAPES: u8>(
    bodies: &Bodies,
    pair: &Pair,
    place: u32,
    normal: Vec2,
    bound: f32,
) -> Row {
    let (a, b) = (pair.a as usize, pair.b as usize);
    let (weight_a, weight_b) = (bodies.inverse_mass[a], bodies.inverse_mass[b]);
    let friction = (bodies.material[a].friction * bodies.material[b].friction).sqrt();
    // What a face carried says nothing about another face or a corner: a circle that has just
    // left a tile would be pushed on by it.
    let turned = pair.axis != Axis::Free && pair.axis != axis_of::<SHAPES>(bodies, a, b, normal);
    let (press, rub) =
        if turned { (0.0, 0.0) } else { (pair.normal_impulse, pair.tangent_impulse) };
    Row {
        a: pair.a,
        b: pair.b,
        normal,
        bound,
        mass: 1.0 / (weight_a + weight_b),
        weight_a,
        weight_b,
        friction,
        press,
        rub,
        press_before: 0.0,
        rub_before: 0.0,
        press_along: 0.0,
        rub_along: 0.0,
        pair: place,
    }
}

#[inline]
fn axis_of<const SHAPES: u8>(bodies: &Bodies, a: usize, b: usize, normal: Vec2) -> Axis {
    gap::axis_of(bodies.shape_of::<SHAPES>(a), bodies.shape_of::<SHAPES>(b), normal)
}

impl Row {
    /// Velocity of b relative to a.
    #[inline]
    pub fn relative(&self, velocity: &[Vec2]) -> Vec2 {
        velocity[self.b as usize] - velocity[self.a as usize]
    }

    /// Applies an impulse to b and its opposite to a.
    #[inline]
    pub fn apply(&self, velocity: &mut [Vec2], impulse: Vec2) {
        velocity[self.a as usize] -= impulse * self.weight_a;
        velocity[self.b as usize] += impulse * self.weight_b;
    }

    /// The impulses as one vector.
    #[inline]
    pub fn impulse(&self, press: f32, rub: f32) -> Vec2 {
        self.normal * press + self.normal.perp() * rub
    }

    /// The same where nothing rubs: what would be 0 is not computed.
    #[inline]
    pub fn impulse_of<const RUBS: bool>(&self, press: f32, rub: f32) -> Vec2 {
        if RUBS { self.impulse(press, rub) } else { self.normal * press }
    }

    /// A sweep begins here.
    #[inline]
    pub fn remember(&mut self) {
        (self.press_before, self.rub_before) = (self.press, self.rub);
    }

    /// Whether friction holds the two together; nobody need ask where nothing rubs.
    #[inline]
    pub fn sticks(&self) -> bool {
        self.rub.abs() < SLIDING * self.friction * self.press
    }

    /// Whether the pair passes each other: no impulse of it is ever needed.
    #[inline]
    pub fn passes(&self) -> bool {
        self.bound <= -FAR
    }

    /// Whether the two can part to any side, and are so deep in each other that none is theirs.
    pub fn is_sideless(&self, bodies: &Bodies, separation: f32) -> bool {
        if separation >= 0.0 || !self.is_free() {
            return false;
        }
        let thickness = |slot: u32| bodies.thickness(slot as usize);
        separation < -SIDELESS * min(thickness(self.a), thickness(self.b))
    }

    /// Whether both bodies can be pushed.
    #[inline]
    pub fn is_free(&self) -> bool {
        self.weight_a > 0.0 && self.weight_b > 0.0
    }
}

/// Keeps the impulses for the next step's start.
pub(crate) fn store<const SHAPES: u8>(bodies: &Bodies, rows: &[Row], pairs: &mut [Pair]) {
    for pair in pairs.iter_mut() {
        pair.normal_impulse = 0.0;
        pair.tangent_impulse = 0.0;
        pair.axis = Axis::Free;
    }
    for row in rows.iter().filter(|row| row.press > 0.0) {
        let pair = &mut pairs[row.pair as usize];
        let (a, b) = (row.a as usize, row.b as usize);
        pair.normal_impulse = row.press;
        pair.tangent_impulse = row.rub;
        pair.axis = axis_of::<SHAPES>(bodies, a, b, row.normal);
    }
}
