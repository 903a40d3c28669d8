//! Takes back motion by which a body cannot really have reached its position inside immovable ones, such as through
//! a side of a box although it was above the top, or into a gap narrower than itself.

use super::RelaxationSolver;
use crate::bodies::Bodies;
use crate::broad_phase::pairs::Axis;
use crate::math::{clamp, max, min};
use crate::narrow_phase::overlap::{separation_along, side};
use crate::narrow_phase::separation::{self, PlacedShape, placed};
use crate::shape::Shape;
use crate::solver::tolerances::{OVERLAP, SAME_FACE};
use glam::Vec2;

/// Maximum number of other immovable bodies checked for a gap with each immovable body near a movable one. This
/// limits the time taken on tiled floors.
const WALLS_MAX: usize = 16;
/// Amount by which a gap may be narrower than a body, world units. Rounding may double it while both move.
const NARROW: f32 = 2.0 * OVERLAP;
/// Maximum number of points on a path that are checked for gaps, one for each half-size of the body.
const LOOKS_MAX: f32 = 16.0;
/// Number of bisections of the path between two such points to find where the gap becomes too narrow.
const GAP_HALVINGS: u32 = 12;

impl RelaxationSolver {
    /// Moves bodies back along their paths if they cannot really have got where they are.
    pub(super) fn step_back(&mut self, bodies: &mut Bodies, slop: f32) {
        self.walls.clear();
        for constraint in self.constraints.iter().filter(|constraint| !constraint.is_free()) {
            let (slot, wall) = constraint.ends();
            leave_by_entry(bodies, &self.from, (slot, wall), slop);
            self.walls.push(u64::from(slot) << 32 | u64::from(wall));
        }
        self.walls.sort_unstable();
        for (at, &one) in self.walls.iter().enumerate() {
            let slot = one >> 32;
            let others = self.walls[at + 1..].iter().take_while(|&&other| other >> 32 == slot);
            for &other in others.take(WALLS_MAX) {
                leave_gap(bodies, &self.from, (slot as u32, [one as u32, other as u32]));
            }
        }
    }
}

/// Moves a body whose centre entered an immovable box back to the face through which it came. At the seam
/// between two boxes, each would otherwise push it into the other.
fn leave_by_entry(bodies: &mut Bodies, from: &[Vec2], (slot, wall): (u32, u32), slop: f32) {
    let (began, half) = (from[slot as usize] - from[wall as usize], bodies.half[wall as usize]);
    let now = bodies.center[slot as usize] - bodies.center[wall as usize];
    let (outside, inside) = (began.abs() - half, half - now.abs());
    let is_box = matches!(bodies.shape[wall as usize], Shape::Box { .. });
    let entered = inside.x > 0.0 && inside.y > 0.0 && (outside.x >= 0.0 || outside.y >= 0.0);
    if !is_box || !entered {
        return;
    }
    // The axis on which the body entered last.
    let axis = usize::from(outside.y * (outside.x + inside.x) > outside.x * (outside.y + inside.y));
    let mut face = Vec2::ZERO;
    face[axis] = side(began[axis]);
    let depth = -separation_along(bodies, (wall, slot), face) - slop;
    let back = min(depth, (began - now).dot(face));
    bodies.shift(slot as usize, face * max(back, 0.0));
}

/// Moves a body that two immovable ones each push into the other back along its path to a point where they did not,
/// and stops it if it cannot move at all. If they did so from the start, they are squeezing it, and it stays where it
/// is.
fn leave_gap(bodies: &mut Bodies, from: &[Vec2], (slot, walls): (u32, [u32; 2])) {
    let end = bodies.center[slot as usize];
    // Its starting position relative to the walls' current positions.
    let moved = |wall: u32| bodies.center[wall as usize] - from[wall as usize];
    let starts = walls.map(|wall| from[slot as usize] + moved(wall));
    let is_free_at = |share: f32, tolerated: f32| {
        let manifold = |index: usize| {
            let center = starts[index] + (end - starts[index]) * share;
            let at = PlacedShape { center, ..placed(bodies, slot) };
            separation::between(placed(bodies, walls[index]), at, Vec2::ZERO, Axis::Free)
        };
        let (Some(one), Some(other)) = (manifold(0), manifold(1)) else { return true };
        let are_opposed = one.normal.dot(other.normal) < -SAME_FACE;
        !are_opposed || one.separation + other.separation >= -tolerated
    };
    let back = (starts[0] + starts[1]) * 0.5 - end;
    // A long path may lead into the gap and out again.
    let looks = clamp(back.length() / bodies.thickness(slot as usize), 0.0, LOOKS_MAX).ceil();
    let blocked =
        (1..=looks as u32).map(|look| look as f32 / looks).find(|&at| !is_free_at(at, NARROW));
    let Some(mut blocked) = blocked.filter(|_| is_free_at(0.0, 2.0 * NARROW)) else { return };
    let mut free = blocked - 1.0 / looks;
    for _ in 0..GAP_HALVINGS {
        let middle = 0.5 * (free + blocked);
        if is_free_at(middle, NARROW) { free = middle } else { blocked = middle }
    }
    bodies.shift(slot as usize, back * (1.0 - free));
    if free == 0.0 {
        let [one, other] = walls.map(|wall| bodies.velocity[wall as usize]);
        bodies.velocity[slot as usize] = (one + other) * 0.5;
    }
}
