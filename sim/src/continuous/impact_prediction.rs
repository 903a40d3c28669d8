//! Predicts when and how fast two bodies on their current paths meet.
//!
//! Times are exact under gravity. A pair that closes a separation s with initial speed c and acceleration g touches
//! at speed w, where w^2 = c^2 + 2 g s, after a time of 2 s / (c + w).

use super::paths::{Paths, overlap_limit, thickness};
use crate::bodies::Bodies;
use crate::body::Motion;
use crate::broad_phase::pairs::Pair;
use crate::math::{max, min};
use crate::narrow_phase::separation::{self, placed};
use crate::solver::step_context::StepContext;
use glam::Vec2;

/// A contact within the step.
pub(crate) struct Hit {
    pub normal: Vec2,
    /// Closing speed at the time of impact, units/s.
    pub closing: f32,
    /// Closing acceleration due to gravity, units/s^2.
    pub gain: f32,
    /// Time of impact, seconds into the step.
    pub time: f32,
    /// Penetration caused by gravity until the impact, world units; 0 unless the pair rests.
    pub depth: f32,
}

/// Predicts a pair's next contact on its current paths, up to a given time. Bodies on springs are left to
/// `crowd`.
pub(crate) fn predict(
    bodies: &Bodies,
    paths: &Paths,
    pair: &Pair,
    until: f32,
    context: &StepContext,
) -> Option<Hit> {
    let (a, b) = (pair.a as usize, pair.b as usize);
    let start = paths.start_time(pair);
    let left = until - start;
    let is_sprung = |slot: u32| paths.sprung_acceleration(slot).is_some();
    if left <= 0.0 || is_sprung(pair.a) || is_sprung(pair.b) {
        return None;
    }
    let acceleration = gravity_on(bodies, b, context) - gravity_on(bodies, a, context);
    let first = bodies.velocity[b] - bodies.velocity[a];
    let velocity = first + acceleration * start;
    let ahead = (first + velocity) * (0.5 * start);
    let path = (velocity + acceleration * (0.5 * left)) * left;
    let (at_a, mut at_b) = (placed(bodies, pair.a), placed(bodies, pair.b));
    at_b.center += ahead;
    let apart =
        (at_b.center - at_a.center).abs() - at_a.shape.half_extent() - at_b.shape.half_extent();
    // The bodies must be closing on each axis on which their boxes are apart.
    let toward = (at_a.center - at_b.center).signum() * path;
    if apart.x > max(toward.x, 0.0) || apart.y > max(toward.y, 0.0) {
        return None;
    }
    let manifold = separation::between(at_a, at_b, path, pair.axis)?;
    let (distance, closing) = (max(manifold.separation, 0.0), -manifold.normal.dot(velocity));
    let gain = -manifold.normal.dot(acceleration);
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
    let hit = Hit { normal: manifold.normal, closing: touching, gain, time, depth: 0.0 };
    (after <= left).then_some(hit)
}

/// Restitution of a pair.
#[inline]
pub(crate) fn restitution(bodies: &Bodies, pair: &Pair) -> f32 {
    restitution_of(bodies, pair.a, pair.b)
}

/// Restitution between two bodies: the smaller of their two values.
#[inline]
pub(crate) fn restitution_of(bodies: &Bodies, a: u32, b: u32) -> f32 {
    let of = |slot: u32| bodies.material[slot as usize].restitution;
    min(of(a), of(b))
}

/// Whether a contact bounces.
#[inline]
pub(crate) fn bounces(bodies: &Bodies, pair: &Pair, hit: &Hit, context: &StepContext) -> bool {
    hit.depth == 0.0
        && hit.closing > context.settings.bounce_threshold
        && restitution(bodies, pair) > 0.0
}

/// Overlap that is left to the constraints, which handle the effect of gravity within a step.
#[inline]
fn allowed_overlap(bodies: &Bodies, pair: &Pair, context: &StepContext) -> f32 {
    overlap_limit(thickness(bodies, pair), context.settings.slop + context.fall_distance())
}

/// Whether a pair would overlap too far at the end of the step if nothing stopped it.
#[inline]
pub(crate) fn tunnels(bodies: &Bodies, pair: &Pair, hit: &Hit, context: &StepContext) -> bool {
    (context.dt - hit.time) * hit.closing > allowed_overlap(bodies, pair, context)
}

/// Returns the contact that stops a pair which would otherwise overlap too far. This is its impact or, if only
/// gravity pulls the bodies further, a resting contact at that time.
#[inline]
pub(crate) fn as_obstruction(
    bodies: &Bodies,
    pair: &Pair,
    hit: Hit,
    time: f32,
    context: &StepContext,
) -> Option<Hit> {
    let (since, allowed) = (time - hit.time, allowed_overlap(bodies, pair, context));
    if since * hit.closing > allowed {
        return Some(hit);
    }
    let depth = since * (hit.closing + 0.5 * hit.gain * since);
    let closing = hit.closing + hit.gain * since;
    (depth > allowed).then_some(Hit { closing, time, depth, ..hit })
}

/// Acceleration of a body due to gravity.
#[inline]
pub(crate) fn gravity_on(bodies: &Bodies, slot: usize, context: &StepContext) -> Vec2 {
    match bodies.motion[slot] {
        Motion::Dynamic => context.gravity * bodies.gravity_scale[slot],
        Motion::Static | Motion::Kinematic => Vec2::ZERO,
    }
}
