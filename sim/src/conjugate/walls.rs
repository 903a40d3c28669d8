//! Walls: what nothing can push has the last word over places.
//!
//! Sweeps end when their budget does, a solved speed may bring a body to a wall that it had no row
//! with, and those that overlap are moved apart by displacements of their own. None of that may take
//! a body through a wall. So after a step in which somebody moved by more than the thinnest body's
//! half-size or overlapped, every pair with an immovable side is swept once more, from where the last
//! bounce of the step left it to where it ended: n.d >= -max(-s, slop), with the gap s and the normal n
//! of `gap`. Where that does not hold the body ends on the wall, the deepest first, and its speed
//! towards the wall ends there too, as an impulse of the wall: nothing is gained, and whom it overlaps
//! instead the next step parts.

use super::gap::{self, Gap};
use super::impacts::Paths;
use super::rows::{bearable, placed, thickness};
use crate::bodies::Bodies;
use crate::math::max;
use crate::pairs::Pair;
use glam::Vec2;
use std::cmp::Ordering;

/// How often it is looked: who is put out of one wall may be in the next one, in a corner.
const ROUNDS: u32 = 4;

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Walls {
    /// By slot: the place at the start of the step.
    start: Vec<Vec2>,
    /// How deep a body would be, and the place of the pair.
    passed: Vec<(f32, u32)>,
}

impl Walls {
    /// Keeps the places before anything bounces or moves.
    pub fn remember(&mut self, bodies: &Bodies) {
        self.start.clone_from(&bodies.center);
    }

    /// Whether anybody went so far, or is so deep in another one, that a wall may have been passed:
    /// `least` is what is left of the gap that closed most, and only in `quick` steps somebody may
    /// have gone far.
    pub fn may_be_passed(&self, bodies: &mut Bodies, least: f32, slop: f32, quick: bool) -> bool {
        let thin = bodies.thinnest();
        let left_alone = -bearable(thin, slop);
        let far =
            |slot: usize| (bodies.center[slot] - self.start[slot]).length_squared() > thin * thin;
        least < left_alone || quick && bodies.moving.iter().any(|&slot| far(slot as usize))
    }

    /// Puts bodies that passed a wall on it.
    pub fn keep(&mut self, bodies: &mut Bodies, pairs: &[Pair], paths: &Paths, slop: f32) {
        for _ in 0..ROUNDS {
            self.passed.clear();
            for (place, pair) in (0u32..).zip(pairs) {
                if let Some((_, depth)) = self.look(bodies, pair, paths, slop) {
                    self.passed.push((depth, place));
                }
            }
            if self.passed.is_empty() {
                return;
            }
            self.passed.sort_unstable_by(|one, other| {
                let deeper = other.0.partial_cmp(&one.0).unwrap_or(Ordering::Equal);
                deeper.then(one.1.cmp(&other.1))
            });
            for &(_, place) in &self.passed {
                let pair = &pairs[place as usize];
                if let Some((normal, depth)) = self.look(bodies, pair, paths, slop) {
                    put_out(bodies, pair, normal, depth);
                }
            }
        }
    }

    /// Normal and depth where a pair with an immovable side went into each other.
    fn look(&self, bodies: &Bodies, pair: &Pair, paths: &Paths, slop: f32) -> Option<(Vec2, f32)> {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let free = [bodies.inverse_mass[a] > 0.0, bodies.inverse_mass[b] > 0.0];
        if free[0] == free[1] {
            return None;
        }
        let reach = bodies.half[a] + bodies.half[b];
        let thin = thickness(bodies, pair);
        let slop = bearable(thin, slop);
        let end = (bodies.center[b] - bodies.center[a]).abs();
        let overlaps = end.x < reach.x - slop && end.y < reach.y - slop;
        let way = (bodies.center[b] - self.start[b] - bodies.center[a] + self.start[a]).abs();
        if !overlaps && max(way.x, way.y) <= thin {
            return None;
        }
        let since = paths.start(pair);
        let from = |slot: usize| match paths.since[slot] {
            0.0 => self.start[slot] + bodies.velocity[slot] * since,
            _ => paths.there[slot],
        };
        match self.swept(bodies, pair, (from(a), from(b))) {
            // Even the bounce was in the wall.
            Some((gap, _)) if since > 0.0 && gap.separation < -slop => {
                self.swept(bodies, pair, (self.start[a], self.start[b]))
            }
            found => found,
        }
        .map(|(gap, depth)| (gap.normal, depth - max(-gap.separation, slop)))
        .filter(|&(_, beyond)| beyond > 0.0)
    }

    /// The gap of a pair at places from which it went straight to where it is, and how deep it is.
    fn swept(
        &self,
        bodies: &Bodies,
        pair: &Pair,
        (from_a, from_b): (Vec2, Vec2),
    ) -> Option<(Gap, f32)> {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let path = (bodies.center[b] - from_b) - (bodies.center[a] - from_a);
        let (mut at_a, mut at_b) = (placed(bodies, pair.a), placed(bodies, pair.b));
        (at_a.center, at_b.center) = (from_a, from_b);
        let gap = gap::between(at_a, at_b, path, pair.axis)?;
        Some((gap, -gap.separation - gap.normal.dot(path)))
    }
}

/// Moves the body of a pair off its wall, and takes its speed towards it.
fn put_out(bodies: &mut Bodies, pair: &Pair, normal: Vec2, depth: f32) {
    let (a, b) = (pair.a as usize, pair.b as usize);
    let closing = -normal.dot(bodies.velocity[b] - bodies.velocity[a]);
    let stop = max(closing, 0.0);
    let (slot, away) = if bodies.inverse_mass[a] > 0.0 { (a, -normal) } else { (b, normal) };
    bodies.center[slot] += away * depth;
    bodies.velocity[slot] += away * stop;
}
