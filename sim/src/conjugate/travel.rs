//! Where bodies go: exact in free flight, exactly onto what holds them.
//!
//! A body that falls or slides has a constant acceleration, and x += h (v0 + v1) / 2 is its path to
//! the last digit. Along an axis on which a contact holds it the speed jumps instead, and
//! x += h v1 is the motion that the rows solved for. In between, friction that stops a slide with
//! a share t of its greatest impulse has done so after a share t of the step, and the rest is rest:
//! x += h (v1 + t (v0 - v1) / 2). One weight of v0 for each body and axis says it all.

use super::rows::{Facts, Row};
use crate::bodies::Bodies;
use crate::forces::Move;
use crate::math::{clamp_length, min};
use glam::Vec2;

/// Weight of v0 in free flight.
const FREE: f32 = 0.5;

/// By slot, what a step remembers of a body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Travel {
    /// Velocity before gravity.
    pub before: Vec<Vec2>,
    /// Weights of v0 in the path, in [0, 0.5].
    weight: Vec<Vec2>,
    /// The path of this step; zero between steps, and always of what does not move.
    path: Vec<Vec2>,
}

/// Gravity: remembers the velocities before it, and adds what it gives in the step. Whether all
/// places and speeds are numbers.
// Within its caller its loop is compiled worse, and so are others in this crate that say `never`.
#[inline(never)]
pub(crate) fn accelerate(
    bodies: &mut Bodies,
    gain: Vec2,
    speed_max: f32,
    travel: &mut Travel,
) -> bool {
    travel.before.resize(bodies.alive.len(), Vec2::ZERO);
    let Bodies { moving, center, velocity, gravity_scale, motion, .. } = bodies;
    let mut sound = true;
    for &slot in moving.iter() {
        let slot = slot as usize;
        let (place, speed) = (center[slot], velocity[slot]);
        sound &= (place.x + speed.x + place.y + speed.y).is_finite();
        travel.before[slot] = speed;
        if Bodies::is_pushed(motion[slot]) {
            velocity[slot] = clamp_length(velocity[slot] + gain * gravity_scale[slot], speed_max);
        }
    }
    sound
}

/// Forces beside gravity: their moves replace what gravity did. A speed at the start from which
/// the mean of both ends gives the exact path is remembered in place of the true one.
pub(crate) fn force(bodies: &mut Bodies, moves: &[Move], dt: f32, travel: &mut Travel) {
    for found in moves {
        let slot = found.slot as usize;
        bodies.velocity[slot] = found.velocity;
        travel.before[slot] = found.path * (2.0 / dt) - found.velocity;
    }
}

/// What came of moving the bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gone {
    /// Whether all places are numbers.
    pub sound: bool,
    /// Least of what is left of the gaps, world units.
    pub least: f32,
}

/// Moves the bodies, and tells every row what is left of its gap.
#[inline(never)]
pub(crate) fn go(
    bodies: &mut Bodies,
    rows: &[Row],
    facts: &mut [Facts],
    travel: &mut Travel,
    dt: f32,
) -> Gone {
    travel.weight.resize(bodies.alive.len(), Vec2::ZERO);
    travel.path.resize(bodies.alive.len(), Vec2::ZERO);
    for &slot in &bodies.moving {
        travel.weight[slot as usize] = Vec2::splat(FREE);
    }
    for (row, facts) in rows.iter().zip(&*facts).filter(|(row, _)| row.press > 0.0) {
        hold(row, row.normal, 0.0, &mut travel.weight);
        let limit = row.friction * row.press;
        if row.rub.abs() < limit {
            let weight = if facts.slid { FREE * row.rub.abs() / limit } else { 0.0 };
            hold(row, row.normal.perp(), weight, &mut travel.weight);
        }
    }
    plan(bodies, travel, dt);
    if hold_back(rows, facts, travel) {
        plan(bodies, travel, dt);
    }
    let mut sound = true;
    for &slot in &bodies.moving {
        let center = &mut bodies.center[slot as usize];
        *center += travel.path[slot as usize];
        sound &= (center.x + center.y).is_finite();
    }
    let mut least = f32::INFINITY;
    for (row, facts) in rows.iter().zip(facts) {
        facts.left = left(row, facts, travel);
        least = min(least, facts.left);
    }
    for &slot in &bodies.moving {
        travel.path[slot as usize] = Vec2::ZERO;
    }
    Gone { sound, least }
}

/// Limits the weights of both bodies on the axes that a direction has a part of.
#[inline]
fn hold(row: &Row, direction: Vec2, most: f32, weight: &mut [Vec2]) {
    for body in [row.a, row.b] {
        let weight = &mut weight[body as usize];
        for axis in 0..2 {
            if direction[axis] != 0.0 {
                weight[axis] = min(weight[axis], most);
            }
        }
    }
}

fn plan(bodies: &Bodies, travel: &mut Travel, dt: f32) {
    for &slot in &bodies.moving {
        let slot = slot as usize;
        let (before, after) = (travel.before[slot], bodies.velocity[slot]);
        let path = (after + travel.weight[slot] * (before - after)) * dt;
        // Nobody goes further than the step looked for whom he meets.
        travel.path[slot] = clamp_length(path, bodies.reach[slot]);
    }
}

/// Rows were solved for v1. Where the mean would let a free pair overlap, or overlap more, both take
/// v1 after all; whether there are any.
fn hold_back(rows: &[Row], facts: &[Facts], travel: &mut Travel) -> bool {
    let mut any = false;
    for (row, facts) in rows.iter().zip(facts) {
        if row.press <= 0.0 && left(row, facts, travel) < min(facts.separation, 0.0) {
            hold(row, row.normal, 0.0, &mut travel.weight);
            any = true;
        }
    }
    any
}

#[inline]
fn left(row: &Row, facts: &Facts, travel: &Travel) -> f32 {
    let path = travel.path[row.b as usize] - travel.path[row.a as usize];
    facts.separation + row.normal.dot(path)
}
