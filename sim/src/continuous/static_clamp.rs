//! The final, position-based check against immovable bodies.
//!
//! Sweeps may end early because their budget is used up, a solved velocity may take a body to a wall for which it has
//! no constraint, and overlapping bodies are pushed apart by separate displacements. None of this may take a body
//! through a wall. The check runs after a step in which a body moved by more than half of the thinnest body's
//! half-size, overlapped another, or may have met a wall without a constraint. It sweeps every pair with an immovable
//! body once more, in up to four rounds, from the last impact in the step to the end, and requires n.d >= -max(-s,
//! slop), with the separation s and the normal n of the manifold. Where this is violated, the body is put onto the
//! wall, deepest first, and its velocity towards the wall is removed, as if by an impulse from the wall. This adds no
//! energy, and any overlap it causes is corrected in the next step.

use super::paths::{Paths, overlap_limit, thickness};
use crate::bodies::Bodies;
use crate::body::Motion;
use crate::broad_phase::pairs::{Pair, key, near};
use crate::math::{max, ordered_bits};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::separation;
use crate::narrow_phase::separation::placed;
use crate::solver::step_context::StepContext;
use glam::Vec2;

/// Maximum number of rounds. In a corner, a body moved out of one wall may end up in the other. The last round
/// considers only static bodies, so that a body between a platform and the ground stays above the ground.
const ROUNDS: u32 = 4;

#[derive(Clone, Debug, Default)]
pub(crate) struct StaticClamp {
    /// By slot: position at the start of the step.
    start: Vec<Vec2>,
    /// Pairs with an immovable body that the step may have brought together.
    pairs: Vec<Pair>,
    /// Bodies that moved beyond their reach, and, if there are any, also the immovable bodies.
    outran: Vec<u32>,
    immovable: Vec<u32>,
    /// Penetrating pairs, deepest first, each stored as the inverted bits of the depth followed by the pair's index.
    penetrating: Vec<u64>,
}

impl StaticClamp {
    /// Saves the positions before anything bounces or moves.
    pub fn remember(&mut self, bodies: &Bodies) {
        self.start.clone_from(&bodies.center);
    }

    /// Whether a body moved so far, or is so deep inside another one, that it may have passed a wall.
    /// `separation_min` is the smallest separation at the end of the step; `is_unsure` says whether bodies may touch
    /// a wall without a constraint. Never returns false if `resolve` would do something.
    pub fn may_tunnel(
        &self,
        bodies: &mut Bodies,
        separation_min: f32,
        slop: f32,
        is_unsure: bool,
    ) -> bool {
        let thickness_min = bodies.thinnest();
        // The wall itself may cover half of the distance.
        let half = 0.5 * thickness_min;
        let far = |slot: &u32| {
            let slot = *slot as usize;
            (bodies.center[slot] - self.start[slot]).length_squared() > half * half
        };
        is_unsure
            || separation_min < -overlap_limit(thickness_min, slop)
            || bodies.moving.iter().any(far)
    }

    /// Moves bodies that passed into a wall back to its surface.
    pub fn resolve(
        &mut self,
        bodies: &mut Bodies,
        pairs: &[Pair],
        paths: &Paths,
        context: &StepContext,
    ) {
        let slop = context.settings.slop;
        self.find_pairs(bodies, pairs, context);
        let pairs = std::mem::take(&mut self.pairs);
        self.clamp(bodies, &pairs, paths, slop);
        self.pairs = pairs;
    }

    /// Finds the pairs within reach of each other of which one body is immovable. The list is complete only for
    /// bodies that stayed within their reach, and overlaps and late pairs may take others further.
    fn find_pairs(&mut self, bodies: &mut Bodies, listed: &[Pair], context: &StepContext) {
        self.outran.clear();
        for index in 0..bodies.moving.len() {
            let slot = bodies.moving[index] as usize;
            let path = (bodies.center[slot] - self.start[slot]).length();
            if path > bodies.reach[slot] {
                bodies.reach[slot] = path;
                self.outran.push(bodies.moving[index]);
            }
        }
        self.pairs.clear();
        let has_wall = |pair: &Pair| {
            let inv_masses = [pair.a, pair.b].map(|slot| bodies.inverse_mass[slot as usize]);
            (inv_masses[0] > 0.0) != (inv_masses[1] > 0.0)
        };
        let within = listed.iter().filter(|pair| has_wall(pair) && near(bodies, pair.a, pair.b));
        self.pairs.extend(within);
        if self.outran.is_empty() {
            return;
        }
        self.immovable.clear();
        self.immovable
            .extend(bodies.slots().filter(|&slot| bodies.inverse_mass[slot as usize] == 0.0));
        for &slot in &self.outran {
            for &wall in &self.immovable {
                if near(bodies, slot, wall) && context.filter.takes(bodies, slot, wall) {
                    let key = key(slot, wall);
                    if listed.binary_search_by_key(&key, Pair::key).is_err() {
                        self.pairs.push(Pair::of(key));
                    }
                }
            }
        }
    }

    fn clamp(&mut self, bodies: &mut Bodies, pairs: &[Pair], paths: &Paths, slop: f32) {
        for round in 1..=ROUNDS {
            self.penetrating.clear();
            for (index, pair) in (0u32..).zip(pairs) {
                if round == ROUNDS && !is_fixed(bodies, pair) {
                    continue;
                }
                if let Some((_, depth)) = self.penetration(bodies, pair, paths, slop) {
                    let shallowness = !ordered_bits(depth);
                    self.penetrating.push(u64::from(shallowness) << 32 | u64::from(index));
                }
            }
            if self.penetrating.is_empty() {
                return;
            }
            self.penetrating.sort_unstable();
            for &entry in &self.penetrating {
                let pair = &pairs[entry as u32 as usize];
                if let Some((normal, depth)) = self.penetration(bodies, pair, paths, slop) {
                    clamp_to_surface(bodies, pair, normal, depth);
                }
            }
        }
    }

    /// Normal and depth of the penetration of a pair.
    fn penetration(
        &self,
        bodies: &Bodies,
        pair: &Pair,
        paths: &Paths,
        slop: f32,
    ) -> Option<(Vec2, f32)> {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let reach = bodies.half[a] + bodies.half[b];
        let thin = thickness(bodies, pair);
        let slop = overlap_limit(thin, slop);
        let end = (bodies.center[b] - bodies.center[a]).abs();
        let overlaps = end.x < reach.x - slop && end.y < reach.y - slop;
        let path = (bodies.center[b] - self.start[b] - bodies.center[a] + self.start[a]).abs();
        if !overlaps && max(path.x, path.y) <= thin {
            return None;
        }
        let since = paths.start_time(pair);
        let from = |slot: usize| match paths.impact_time[slot] {
            0.0 => self.start[slot] + bodies.velocity[slot] * since,
            _ => paths.impact_position[slot],
        };
        match self.sweep_pair(bodies, pair, (from(a), from(b))) {
            // The point of impact itself was inside the wall.
            Some((manifold, _)) if since > 0.0 && manifold.separation < -slop => {
                self.sweep_pair(bodies, pair, (self.start[a], self.start[b]))
            }
            found => found,
        }
        .map(|(manifold, depth)| (manifold.normal, depth - max(-manifold.separation, slop)))
        .filter(|&(_, beyond)| beyond > 0.0)
    }

    /// Sweeps a pair in a straight line from these positions to the current ones, and returns the manifold and the
    /// depth at the end.
    fn sweep_pair(
        &self,
        bodies: &Bodies,
        pair: &Pair,
        (from_a, from_b): (Vec2, Vec2),
    ) -> Option<(Manifold, f32)> {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let path = (bodies.center[b] - from_b) - (bodies.center[a] - from_a);
        let (mut at_a, mut at_b) = (placed(bodies, pair.a), placed(bodies, pair.b));
        (at_a.center, at_b.center) = (from_a, from_b);
        let manifold = separation::between(at_a, at_b, path, pair.axis)?;
        Some((manifold, -manifold.separation - manifold.normal.dot(path)))
    }
}

/// Whether one body of a pair is static.
fn is_fixed(bodies: &Bodies, pair: &Pair) -> bool {
    [pair.a, pair.b].iter().any(|&slot| bodies.motion[slot as usize] == Motion::Static)
}

/// Moves a pair's body to the surface of the pair's wall, and removes its velocity towards the wall.
fn clamp_to_surface(bodies: &mut Bodies, pair: &Pair, normal: Vec2, depth: f32) {
    let (a, b) = (pair.a as usize, pair.b as usize);
    let closing = -normal.dot(bodies.velocity[b] - bodies.velocity[a]);
    let stop = max(closing, 0.0);
    let (slot, away) = if bodies.inverse_mass[a] > 0.0 { (a, -normal) } else { (b, normal) };
    bodies.center[slot] += away * depth;
    bodies.velocity[slot] += away * stop;
}
