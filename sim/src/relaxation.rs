//! The relaxation solver: projection and impulse, all pairs of the scene together in id order, N
//! passes, leaving early when nothing is left to correct.
//!
//! A step is `warm_start`, moving the bodies (the world does that), `gather`, `relax`, `store`.
//! Each pass looks at every pair where its bodies are by then: it finds the contact, applies the
//! normal impulse, then friction, then moves the two apart by a share of the overlap.
//!
//! The passes exist once for each set of shapes, with and without friction and bounces: what no body
//! brings is not even asked for. All of them give the same bits.

use crate::bodies::Bodies;
use crate::contact::Contact;
use crate::features::Features;
use crate::math::{clamp, max, min};
use crate::pairs::{Pair, near, overlap, overlap_of, shapes};
use glam::Vec2;

/// Settings of the relaxation; chapter rows A2.18 to A2.25.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// Passes over all pairs a step, 1..=240. Default 15.
    pub iterations: u32,
    /// Share of the overlap removed a pass, in (0, 1]. Default 0.8.
    pub correction: f32,
    /// Overlap left alone, world units, 0..=1. Default 0.005.
    pub slop: f32,
    /// Closing speed below which nothing bounces, units/s, not negative. Default 2.
    pub bounce_threshold: f32,
    /// Start each step from the last step's resting impulses. Default true.
    pub warm_start: bool,
}

impl Default for Relaxation {
    fn default() -> Relaxation {
        Relaxation {
            iterations: 15,
            correction: 0.8,
            slop: 0.005,
            bounce_threshold: 2.0,
            warm_start: true,
        }
    }
}

impl Relaxation {
    /// Panics unless every setting is in its documented range (C22c: nothing is mended silently).
    pub(crate) fn check(&self) {
        assert!((1..=240).contains(&self.iterations), "iterations {}", self.iterations);
        assert!(self.correction > 0.0 && self.correction <= 1.0, "correction {}", self.correction);
        assert!((0.0..=1.0).contains(&self.slop), "slop {}", self.slop);
        let threshold = self.bounce_threshold;
        assert!(threshold >= 0.0 && threshold.is_finite(), "bounce threshold {threshold}");
    }
}

/// A pass that changes no velocity by more than this and no overlap by more than
/// [`DEPTH_TOLERANCE`] is the last one. Units/s.
const SPEED_TOLERANCE: f32 = 1e-3;
/// Cosine below which a contact's normal counts as another one; a rolling contact turns by less.
const SAME_NORMAL: f32 = 0.7;
/// Overlap beyond the slop that counts as none, world units.
const DEPTH_TOLERANCE: f32 = 1e-4;

/// A pair that takes part in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub a: u32,
    pub b: u32,
    /// Place in the pair list.
    pair: u32,
    /// Values of [`Bodies::moves`] for which `normal` and `depth` hold.
    seen_a: u32,
    seen_b: u32,
    /// Inverse masses of the two.
    weight_a: f32,
    weight_b: f32,
    /// Effective mass: 1 / (sum of the inverse masses).
    mass: f32,
    /// Coulomb coefficient of the pair: geometric mean.
    friction: f32,
    /// Restitution of the pair: the smaller one.
    restitution: f32,
    /// Normal of the last contact or, before it, of the warm start; from a to b.
    normal: Vec2,
    /// Normal along which `holding` and `tangent` were applied.
    acted: Vec2,
    /// Overlap, world units; 0 while the two are apart.
    depth: f32,
    /// Largest closing speed met so far in this step, units/s; not negative.
    pub closing: f32,
    /// Normal impulse that holds the pair apart; can be taken back down to 0.
    holding: f32,
    /// Normal impulse spent on bounces; final.
    bounced: f32,
    /// Friction impulse along the normal turned left.
    tangent: f32,
}

/// Applies the last step's resting impulses to the velocities, before the bodies move.
///
/// Only pairs that still overlap count. An impulse is scaled by the smaller [`calmness`] of its
/// two bodies: what stopped an impact must not be given again (it would add energy).
pub(crate) fn warm_start(bodies: &mut Bodies, pairs: &mut [Pair]) {
    for pair in pairs.iter_mut().filter(|pair| pair.normal_impulse > 0.0) {
        let Some(contact) = overlap(bodies, pair.a, pair.b) else {
            pair.normal_impulse = 0.0;
            pair.tangent_impulse = 0.0;
            continue;
        };
        let trust = min(bodies.calm[pair.a as usize], bodies.calm[pair.b as usize]);
        pair.normal_impulse *= trust;
        pair.tangent_impulse *= trust;
        pair.warm_normal = contact.normal;
        let impulse =
            contact.normal * pair.normal_impulse + contact.normal.perp() * pair.tangent_impulse;
        let (a, b) = (pair.a as usize, pair.b as usize);
        bodies.velocity[a] -= impulse * bodies.inverse_mass[a];
        bodies.velocity[b] += impulse * bodies.inverse_mass[b];
    }
}

/// The pairs that take part in this step, in (a, b) order.
pub(crate) fn gather(bodies: &Bodies, pairs: &[Pair], features: Features, rows: &mut Vec<Row>) {
    match (features.circles, features.boxes) {
        (true, false) => gather_of::<{ shapes::CIRCLES }>(bodies, pairs, rows),
        (false, true) => gather_of::<{ shapes::BOXES }>(bodies, pairs, rows),
        _ => gather_of::<{ shapes::BOTH }>(bodies, pairs, rows),
    }
}

fn gather_of<const SHAPES: u8>(bodies: &Bodies, pairs: &[Pair], rows: &mut Vec<Row>) {
    rows.clear();
    for (place, pair) in (0u32..).zip(pairs) {
        if near(bodies, pair.a, pair.b) {
            rows.push(Row::new::<SHAPES>(bodies, pair, place));
        }
    }
}

impl Row {
    #[inline]
    fn new<const SHAPES: u8>(bodies: &Bodies, pair: &Pair, place: u32) -> Row {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let (material_a, material_b) = (bodies.material[a], bodies.material[b]);
        let (weight_a, weight_b) = (bodies.inverse_mass[a], bodies.inverse_mass[b]);
        let mut row = Row {
            a: pair.a,
            b: pair.b,
            pair: place,
            seen_a: 0,
            seen_b: 0,
            weight_a,
            weight_b,
            mass: 1.0 / (weight_a + weight_b),
            friction: (material_a.friction * material_b.friction).sqrt(),
            restitution: min(material_a.restitution, material_b.restitution),
            normal: pair.warm_normal,
            acted: pair.warm_normal,
            depth: 0.0,
            closing: 0.0,
            holding: pair.normal_impulse,
            bounced: 0.0,
            tangent: pair.tangent_impulse,
        };
        row.look::<SHAPES>(bodies);
        row
    }

    /// Finds the contact where the bodies are now.
    #[inline]
    fn look<const SHAPES: u8>(&mut self, bodies: &Bodies) {
        self.seen_a = bodies.moves[self.a as usize];
        self.seen_b = bodies.moves[self.b as usize];
        self.depth = 0.0;
        if let Some(contact) = overlap_of::<SHAPES>(bodies, self.a, self.b) {
            self.normal = contact.normal;
            self.depth = contact.depth;
        }
    }

    /// The same, unless neither body was moved since the last look: the contact is a pure function
    /// of the two places, and in a settled pile nothing moves.
    #[inline]
    fn look_again<const SHAPES: u8>(&mut self, bodies: &Bodies) {
        let moved_a = bodies.moves[self.a as usize] != self.seen_a;
        let moved_b = bodies.moves[self.b as usize] != self.seen_b;
        if moved_a || moved_b {
            self.look::<SHAPES>(bodies);
        }
    }

    /// Takes back what was applied along another normal: where the contact of two boxes jumps from
    /// a top to a side, the load that it held must not become a push along the new normal.
    #[inline]
    fn undo_if_turned(&mut self, bodies: &mut Bodies) {
        let holds = self.holding > 0.0 || self.tangent != 0.0;
        if holds && self.acted.dot(self.normal) < SAME_NORMAL {
            self.push(bodies, self.acted * -self.holding - self.acted.perp() * self.tangent);
            self.holding = 0.0;
            self.tangent = 0.0;
        }
        self.acted = self.normal;
    }

    /// The contact at the end of the step, if the two overlap.
    pub fn contact(&mut self, bodies: &Bodies) -> Option<Contact> {
        self.look_again::<{ shapes::BOTH }>(bodies);
        (self.depth > 0.0).then_some(Contact { normal: self.normal, depth: self.depth })
    }

    /// Velocity of b relative to a.
    #[inline]
    fn relative_velocity(&self, bodies: &Bodies) -> Vec2 {
        bodies.velocity[self.b as usize] - bodies.velocity[self.a as usize]
    }

    /// Applies an impulse to b and its opposite to a.
    #[inline]
    fn push(&self, bodies: &mut Bodies, impulse: Vec2) {
        bodies.velocity[self.a as usize] -= impulse * self.weight_a;
        bodies.velocity[self.b as usize] += impulse * self.weight_b;
    }
}

/// At most N passes over all rows; returns how many were made.
pub(crate) fn relax(
    bodies: &mut Bodies,
    rows: &mut [Row],
    settings: &Relaxation,
    features: Features,
) -> u32 {
    let passes = match (features.circles, features.boxes) {
        (true, false) => passes_with::<{ shapes::CIRCLES }>(features),
        (false, true) => passes_with::<{ shapes::BOXES }>(features),
        _ => passes_with::<{ shapes::BOTH }>(features),
    };
    passes(bodies, rows, settings)
}

type Passes = fn(&mut Bodies, &mut [Row], &Relaxation) -> u32;

/// The passes that deal with these features and no others.
fn passes_with<const SHAPES: u8>(features: Features) -> Passes {
    match (features.friction, features.restitution) {
        (true, true) => passes::<SHAPES, true, true>,
        (true, false) => passes::<SHAPES, true, false>,
        (false, true) => passes::<SHAPES, false, true>,
        (false, false) => passes::<SHAPES, false, false>,
    }
}

fn passes<const SHAPES: u8, const RUBS: bool, const BOUNCES: bool>(
    bodies: &mut Bodies,
    rows: &mut [Row],
    settings: &Relaxation,
) -> u32 {
    for pass in 1..=settings.iterations {
        let mut busy = false;
        for row in rows.iter_mut() {
            busy |= relax_row::<SHAPES, RUBS, BOUNCES>(bodies, row, settings);
        }
        if !busy {
            return pass;
        }
    }
    settings.iterations
}

/// One pair in one pass; whether it changed anything worth another pass.
#[inline]
fn relax_row<const SHAPES: u8, const RUBS: bool, const BOUNCES: bool>(
    bodies: &mut Bodies,
    row: &mut Row,
    settings: &Relaxation,
) -> bool {
    row.look_again::<SHAPES>(bodies);
    if row.depth > 0.0 {
        row.undo_if_turned(bodies);
        let changed_normal = push_apart::<BOUNCES>(bodies, row, settings.bounce_threshold);
        let changed_tangent = RUBS && rub(bodies, row);
        let changed_place = project(bodies, row, settings);
        changed_normal | changed_tangent | changed_place
    } else {
        row.holding > 0.0 && release::<RUBS>(bodies, row)
    }
}

/// The normal impulse (row A2.21): a bounce above the threshold, else what stops the approach,
/// accumulated so that later passes may take back what turned out too much (C16).
///
/// A pair that already holds a load does not bounce: inside a pile the passes make closing speeds
/// that no impact ever had, and bouncing on them would keep the pile boiling.
#[inline]
fn push_apart<const BOUNCES: bool>(bodies: &mut Bodies, row: &mut Row, threshold: f32) -> bool {
    let speed = row.relative_velocity(bodies).dot(row.normal);
    row.closing = max(row.closing, -speed);
    if BOUNCES && -speed > threshold && row.restitution > 0.0 && row.holding <= 0.0 {
        let impulse = -(1.0 + row.restitution) * speed * row.mass;
        row.bounced += impulse;
        row.push(bodies, row.normal * impulse);
        return true;
    }
    let wanted = row.holding - speed * row.mass;
    let holding = if wanted > 0.0 { wanted } else { 0.0 };
    let change = holding - row.holding;
    row.holding = holding;
    row.push(bodies, row.normal * change);
    change.abs() > SPEED_TOLERANCE * row.mass
}

/// Coulomb friction on the relative tangential velocity, limited by the pair's whole normal
/// impulse in this step (C08 to C14).
#[inline]
fn rub(bodies: &mut Bodies, row: &mut Row) -> bool {
    let limit = row.friction * (row.holding + row.bounced);
    if limit <= 0.0 && row.tangent == 0.0 {
        return false;
    }
    let along = row.normal.perp();
    let slide = row.relative_velocity(bodies).dot(along);
    let tangent = clamp(row.tangent - slide * row.mass, -limit, limit);
    let change = tangent - row.tangent;
    row.tangent = tangent;
    row.push(bodies, along * change);
    change.abs() > SPEED_TOLERANCE * row.mass
}

/// Positional correction (row A2.19): both move by their share of the overlap beyond the slop.
#[inline]
fn project(bodies: &mut Bodies, row: &Row, settings: &Relaxation) -> bool {
    let excess = row.depth - settings.slop;
    if excess <= DEPTH_TOLERANCE {
        return false;
    }
    let shift = row.normal * (excess * settings.correction * row.mass);
    bodies.shift(row.a as usize, shift * -row.weight_a);
    bodies.shift(row.b as usize, shift * row.weight_b);
    true
}

/// A pair that was held but came apart: the part of its impulse that drives it apart was too much
/// and is taken back, and the friction that went with it.
#[inline]
fn release<const RUBS: bool>(bodies: &mut Bodies, row: &mut Row) -> bool {
    if row.relative_velocity(bodies).dot(row.normal) <= 0.0 {
        return false;
    }
    let changed_normal = push_apart::<false>(bodies, row, f32::INFINITY);
    let changed_tangent = RUBS && rub(bodies, row);
    changed_tangent | changed_normal
}

/// Keeps the resting impulses of the rows for the next step's warm start.
pub(crate) fn store(rows: &[Row], pairs: &mut [Pair]) {
    for pair in pairs.iter_mut() {
        pair.normal_impulse = 0.0;
        pair.tangent_impulse = 0.0;
    }
    for row in rows.iter().filter(|row| row.holding > 0.0) {
        let pair = &mut pairs[row.pair as usize];
        pair.normal_impulse = row.holding;
        pair.tangent_impulse = row.tangent;
    }
}

/// How far a body's impulses of a step may be given again: 1 at rest, falling with the change of
/// velocity in the step beyond what gravity alone does in it (`free_change`, units/s).
#[inline]
pub(crate) fn calmness(change: Vec2, free_change: f32) -> f32 {
    let speed = change.length();
    if speed <= free_change { 1.0 } else { free_change / speed }
}
