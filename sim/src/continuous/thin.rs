//! Thin and fast bodies: distances in a step compared with the sizes of bodies.

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::math::{max, min};
use crate::solver::tolerances::TOLERATED_SHARE;

/// Whether one of a pair moves in a step by more than `times` the smaller one's half-size.
#[inline]
pub(crate) fn is_fast(bodies: &Bodies, pair: &Pair, dt: f32, times: f32) -> bool {
    let speed = |slot: u32| {
        let speed = bodies.velocity[slot as usize].abs();
        max(speed.x, speed.y)
    };
    max(speed(pair.a), speed(pair.b)) * dt > times * thickness(bodies, pair)
}

/// The smaller half-size of a pair, world units.
#[inline]
pub(crate) fn thickness(bodies: &Bodies, pair: &Pair) -> f32 {
    let of = |slot: u32| bodies.thickness(slot as usize);
    min(of(pair.a), of(pair.b))
}

/// Limits a tolerated overlap for bodies of this size.
#[inline]
pub(crate) fn overlap_limit(thickness: f32, overlap: f32) -> f32 {
    min(overlap, TOLERATED_SHARE * thickness)
}
