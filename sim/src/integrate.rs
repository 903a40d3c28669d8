//! Integrates positions, exactly in free flight and exactly at the surface of a contact.
//!
//! A body that falls or slides has a constant acceleration, and x += h (v0 + v1) / 2 is its exact
//! path. Along an axis on which a contact holds it, the velocity jumps instead, and x += h v1 is
//! the motion for which the constraints were solved. In between, friction that stops a slide with a
//! share t of its greatest impulse does so after a share t of the step, after which the body rests,
//! so x += h (v1 + t (v0 - v1) / 2). A single weight of v0 per body and axis covers all cases.

use crate::bodies::{Bodies, REACH_MIN};
use crate::forces::{Move, MoveKind};
use crate::math::{clamp, clamp_length, max, min};
use crate::solver::contact_constraint::{ContactConstraint, ContactInfo, ContactSet};
use crate::solver::step_context::StepContext;
use crate::solver::tolerances::{OVERLAP, REST_SHARE, ROUNDING, SPEED_ROUNDING};
use glam::Vec2;

/// Weight of v0 in free flight.
const FREE: f32 = 0.5;

/// Scratch memory for the integration, by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Displacements {
    pub start_velocity: Vec<Vec2>,
    /// Weights of v0 in the path, in [0, 0.5]. Once the bodies have moved, this holds the displacements of a position
    /// pass.
    pub weight: Vec<Vec2>,
    /// The path in this step, then the path in a position pass. Zero between steps, and always zero for bodies that
    /// do not move.
    pub path: Vec<Vec2>,
    /// Paths set by springs.
    given: Vec<(u32, Vec2)>,
}

/// Saves the velocities in `start_velocity`, by slot, and adds gravity to them. Returns whether all
/// positions and velocities are finite.
// When inlined into its caller, the loop compiles to slower code. The same holds for the other `never` attributes
// in this crate.
#[inline(never)]
pub(crate) fn accelerate(
    bodies: &mut Bodies,
    gain: Vec2,
    speed_max: f32,
    start_velocity: &mut Vec<Vec2>,
) -> bool {
    let Bodies { moving, center, velocity, gravity_scale, motion, .. } = bodies;
    start_velocity.resize(velocity.len(), Vec2::ZERO);
    let mut is_finite = true;
    for &slot in moving.iter() {
        let slot = slot as usize;
        let (position, speed) = (center[slot], velocity[slot]);
        start_velocity[slot] = speed;
        is_finite &= (position.x + speed.x + position.y + speed.y).is_finite();
        if Bodies::is_pushed(motion[slot]) {
            velocity[slot] = clamp_length(speed + gain * gravity_scale[slot], speed_max);
        }
    }
    is_finite
}

/// Sets the reach of each moving body to its path at the current velocity.
pub(crate) fn reach_paths(bodies: &mut Bodies, dt: f32) {
    let Bodies { moving, velocity, reach, .. } = bodies;
    for &slot in moving.iter() {
        reach[slot as usize] = REACH_MIN + velocity[slot as usize].length() * dt;
    }
}

/// The second half of symplectic Euler, which derives positions from the new velocities. `start_velocity` holds the
/// velocities at the start of the step, by slot.
pub(crate) fn advance(bodies: &mut Bodies, moves: &[Move], start_velocity: &[Vec2], dt: f32) {
    let Bodies { moving, velocity, center, reach, .. } = bodies;
    for &slot in moving.iter() {
        let path = velocity[slot as usize] * dt;
        center[slot as usize] += path;
        reach[slot as usize] = REACH_MIN + path.length();
    }
    // Resting impulses act throughout the step, like the force that they oppose, so a body that they hold does not
    // move.
    for found in moves {
        let slot = found.slot as usize;
        let path = velocity[slot] * dt;
        let before = start_velocity[slot];
        let (gain, bend) = (found.velocity - before, found.path - before * dt);
        let squared = gain.length_squared();
        if matches!(found.kind, MoveKind::Held(_)) {
            center[slot] += found.path - path;
            reach[slot] = REACH_MIN + path.length() + found.path.length();
            continue;
        }
        let acting = if squared > 0.0 { clamp(bend.dot(gain) / squared, 0.0, dt) } else { dt };
        let exact = found.path + (velocity[slot] - found.velocity) * acting;
        center[slot] += exact - path;
        reach[slot] = REACH_MIN + path.length() + exact.length();
    }
}

/// Replaces the effect of gravity with the moves due to other forces. The stored start velocity is chosen so that
/// the mean of both ends gives the exact path.
pub(crate) fn apply_moves(
    bodies: &mut Bodies,
    moves: &[Move],
    dt: f32,
    displacements: &mut Displacements,
) {
    for found in moves {
        let slot = found.slot as usize;
        let velocity = match found.kind {
            MoveKind::Smooth => found.velocity,
            MoveKind::Fast { .. } => found.path / dt,
            MoveKind::Held(hold) => hold.velocity,
        };
        bodies.velocity[slot] = velocity;
        displacements.start_velocity[slot] = found.path * (2.0 / dt) - velocity;
    }
}

/// Completes the moves of stiff springs after contacts have acted on them, by finding their paths, and the
/// final velocities if nothing was in the way.
pub(crate) fn finish_moves(
    bodies: &mut Bodies,
    moves: &[Move],
    dt: f32,
    displacements: &mut Displacements,
) {
    displacements.given.clear();
    for found in moves {
        let velocity = &mut bodies.velocity[found.slot as usize];
        let mean = found.path / dt;
        let path = match found.kind {
            MoveKind::Fast { .. }
                if (*velocity - mean).length() <= SPEED_ROUNDING * mean.length() =>
            {
                *velocity = found.velocity;
                found.path
            }
            MoveKind::Held(_) => *velocity * dt,
            MoveKind::Smooth | MoveKind::Fast { .. } => continue,
        };
        displacements.given.push((found.slot, path));
    }
}

/// Result of moving the bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved {
    /// Whether all positions are finite.
    pub is_finite: bool,
    /// Smallest separation after the move, world units.
    pub separation_min: f32,
    /// Whether a pair overlaps by more than the tolerance.
    pub overlaps: bool,
}

/// Moves the bodies, and updates the separation of every constraint.
#[inline(never)]
pub(crate) fn move_bodies(
    bodies: &mut Bodies,
    contacts: &mut ContactSet,
    displacements: &mut Displacements,
    context: &StepContext,
) -> Moved {
    let dt = context.dt;
    displacements.path.resize(bodies.alive.len(), Vec2::ZERO);
    find_weights(bodies, contacts, &mut displacements.weight, context);
    let ContactSet { constraints, infos } = contacts;
    find_paths(bodies, displacements, dt);
    if limit_overlapping(constraints, infos, displacements) {
        find_paths(bodies, displacements, dt);
    }
    let mut is_finite = true;
    let rest_speed = REST_SHARE * context.tolerance();
    for &slot in &bodies.moving {
        let slot = slot as usize;
        if is_rounding(bodies, slot, displacements, rest_speed) {
            // Its position would change in every step and keep other bodies from resting.
            bodies.velocity[slot] = Vec2::ZERO;
            displacements.path[slot] = Vec2::ZERO;
        }
        let center = &mut bodies.center[slot];
        *center += displacements.path[slot];
        is_finite &= (center.x + center.y).is_finite();
    }
    let (mut separation_min, mut overlaps) = (f32::INFINITY, false);
    for (constraint, info) in constraints.iter().zip(infos) {
        info.separation_after = separation_after(constraint, info, displacements);
        separation_min = min(separation_min, info.separation_after);
        overlaps |= info.separation_after < -info.tolerated(context.settings.slop);
    }
    for &slot in &bodies.moving {
        displacements.path[slot as usize] = Vec2::ZERO;
    }
    Moved { is_finite, separation_min, overlaps }
}

/// Finds the weights of v0 in the paths, which are those of free flight, limited by the contacts that hold a body.
#[inline]
fn find_weights(
    bodies: &Bodies,
    contacts: &ContactSet,
    weight: &mut Vec<Vec2>,
    context: &StepContext,
) {
    weight.resize(bodies.alive.len(), Vec2::ZERO);
    for &slot in &bodies.moving {
        weight[slot as usize] = Vec2::splat(FREE);
    }
    for (constraint, info) in contacts.constraints.iter().zip(&contacts.infos) {
        let inv_mass = constraint.inv_mass_a + constraint.inv_mass_b;
        // Rounding leaves tiny impulses between bodies that fall side by side, which hold neither body.
        let velocity = bodies.velocity[constraint.a as usize].abs();
        let least = context.rounding() + SPEED_ROUNDING * max(velocity.x, velocity.y);
        if constraint.normal_impulse * inv_mass <= least {
            continue;
        }
        limit_weight(constraint, constraint.normal, 0.0, weight);
        let limit = constraint.friction * constraint.normal_impulse;
        if constraint.tangent_impulse.abs() < limit {
            let share =
                if info.slid { FREE * constraint.tangent_impulse.abs() / limit } else { 0.0 };
            limit_weight(constraint, constraint.normal.perp(), share, weight);
        }
    }
}

/// Whether a body held by contacts is so slow that its path is lost in the rounding of its position or size.
#[inline]
fn is_rounding(
    bodies: &Bodies,
    slot: usize,
    displacements: &Displacements,
    rest_speed: f32,
) -> bool {
    let is_held = displacements.weight[slot] != Vec2::splat(FREE);
    if !is_held || bodies.velocity[slot].length_squared() >= rest_speed * rest_speed {
        return false;
    }
    let (center, path) = (bodies.center[slot], displacements.path[slot]);
    let least = ROUNDING * bodies.thickness(slot);
    let is_lost = center + path == center || path.length_squared() < least * least;
    is_lost && Bodies::is_pushed(bodies.motion[slot])
}

/// Limits the weights of both bodies on the axes along which `direction` has a component.
#[inline]
fn limit_weight(constraint: &ContactConstraint, direction: Vec2, limit: f32, weight: &mut [Vec2]) {
    for body in [constraint.a, constraint.b] {
        let weight = &mut weight[body as usize];
        for axis in 0..2 {
            if direction[axis] != 0.0 {
                weight[axis] = min(weight[axis], limit);
            }
        }
    }
}

fn find_paths(bodies: &Bodies, displacements: &mut Displacements, dt: f32) {
    for &slot in &bodies.moving {
        let slot = slot as usize;
        let (start_velocity, after) = (displacements.start_velocity[slot], bodies.velocity[slot]);
        let path = (after + displacements.weight[slot] * (start_velocity - after)) * dt;
        // No body moves further than the reach for which its pairs were found.
        displacements.path[slot] = clamp_length(path, bodies.reach[slot]);
    }
    for &(slot, path) in &displacements.given {
        let slot = slot as usize;
        displacements.path[slot] = clamp_length(path, bodies.reach[slot]);
    }
}

/// Constraints were solved for v1. If the mean of v0 and v1 would make a pair without an impulse overlap, or
/// overlap further, by more than rounding error, both bodies use v1. Returns whether there are such pairs.
fn limit_overlapping(
    constraints: &[ContactConstraint],
    infos: &[ContactInfo],
    displacements: &mut Displacements,
) -> bool {
    let mut any = false;
    for (constraint, info) in constraints.iter().zip(infos) {
        let after = separation_after(constraint, info, displacements);
        if constraint.normal_impulse <= 0.0 && after < min(info.separation, 0.0) - 0.01 * OVERLAP {
            limit_weight(constraint, constraint.normal, 0.0, &mut displacements.weight);
            any = true;
        }
    }
    any
}

#[inline]
fn separation_after(
    constraint: &ContactConstraint,
    info: &ContactInfo,
    displacements: &Displacements,
) -> f32 {
    let path =
        displacements.path[constraint.b as usize] - displacements.path[constraint.a as usize];
    info.separation + constraint.normal.dot(path)
}
