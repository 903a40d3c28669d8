//! Finds the signed separation of two bodies, and the normal along which they will meet.
//!
//! A constraint of the solver requires that the relative displacement d of a step satisfies n.d >= -s. That is a
//! half-plane, and the free space around a shape is not one, so it matters where the shape is replaced by its
//! tangent. The tangent is taken at the place to which the current velocities lead: at the time of impact within the
//! step, or else at the closest approach. Bodies that pass each other are therefore unaffected, and a body cannot
//! tunnel through another one. Pairs that move by more than their size and pass each other have no constraint, since
//! a tangent at the place where they might have met says nothing about where they end up if another contact stops
//! them (see `late_pairs`). The sweep against a box is the slab test (Kay and Kajiya 1986) with rounded corners
//! (Ericson 2005, section 5.5.7).

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Axis;
use crate::math::{clamp, max, min};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::overlap::{box_circle_at_rest, circles_at_rest, corner_normal, side};
use crate::shape::Shape;
use crate::solver::tolerances::{CORNER, CORNER_SHARE, ROUNDING, STRAIGHT};
use glam::Vec2;

/// One of a pair's shapes at its position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedShape {
    pub shape: Shape,
    pub center: Vec2,
    pub slot: u32,
}

#[inline]
pub(crate) fn placed(bodies: &Bodies, slot: u32) -> PlacedShape {
    let index = slot as usize;
    PlacedShape { shape: bodies.shape[index], center: bodies.center[index], slot }
}

/// The manifold of two bodies if b moves by `path` relative to a without being stopped. `kept` is the axis of the
/// face on which the contact was in the previous step. Returns `None` if the two pass each other, as two boxes may
/// around a corner, and any two shapes on a path longer than the smaller one.
// A call would take a fifth of the time spent on a pair. The page makes one anyway, since it is downloaded.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(crate) fn between(a: PlacedShape, b: PlacedShape, path: Vec2, kept: Axis) -> Option<Manifold> {
    let offset = b.center - a.center;
    let size = a.center.abs() + b.center.abs();
    match (a.shape, b.shape) {
        (Shape::Circle { radius: ra }, Shape::Circle { radius: rb }) => {
            circles(offset, path, (ra, rb), (a.slot, b.slot))
        }
        (Shape::Box { half: ha }, Shape::Box { half: hb }) => boxes(offset, path, (ha, hb), kept),
        (Shape::Box { half }, Shape::Circle { radius }) => {
            box_circle(offset, path, half, radius, size)
        }
        (Shape::Circle { radius }, Shape::Box { half }) => {
            box_circle(-offset, -path, half, radius, size).map(Manifold::flipped)
        }
    }
}

/// Whether a path is longer than the smallest half-size.
#[inline]
fn is_fast(path: Vec2, smallest: f32) -> bool {
    path.length_squared() > smallest * smallest
}

/// The axis that a contact keeps, which is that of a box's face.
#[inline]
pub(crate) fn axis_of(a: Shape, b: Shape, normal: Vec2) -> Axis {
    match (a, b) {
        (Shape::Circle { .. }, Shape::Circle { .. }) => Axis::Free,
        _ if normal.y == 0.0 => Axis::X,
        _ if normal.x == 0.0 => Axis::Y,
        _ => Axis::Free,
    }
}

/// For two circles, the tangent at the end of the path, perpendicular to the line of centres.
#[inline]
fn circles(offset: Vec2, path: Vec2, radii: (f32, f32), ids: (u32, u32)) -> Option<Manifold> {
    let reach = radii.0 + radii.1;
    let along = offset.dot(path);
    let squared = offset.length_squared();
    let straight = path.length_squared() <= STRAIGHT * reach * reach;
    if straight || squared <= reach * reach {
        return Some(circles_at_rest(offset, squared, reach, ids));
    }
    let share = match first_touch_of_circle(offset, path, reach) {
        Some(share) => share,
        None if is_fast(path, min(radii.0, radii.1)) => return None,
        None if along >= 0.0 => return Some(circles_at_rest(offset, squared, reach, ids)),
        None => min(-along / path.length_squared(), 1.0),
    };
    let touching = offset + path * share;
    let distance = touching.length();
    Some(tangent(touching / distance, distance - reach, path * share))
}

/// The half-plane tangent to the shape at `ahead`, relative to the start. Rounding must not let it cut off the start
/// itself: a constraint never pushes bodies that do not overlap.
#[inline]
fn tangent(normal: Vec2, distance: f32, ahead: Vec2) -> Manifold {
    Manifold { normal, separation: max(distance - normal.dot(ahead), 0.0) }
}

/// Share of the path, in [0, 1], after which a point comes within `reach` of the origin. The starting point lies
/// outside.
#[inline]
fn first_touch_of_circle(offset: Vec2, path: Vec2, reach: f32) -> Option<f32> {
    let along = offset.dot(path);
    let length_squared = path.length_squared();
    if along >= 0.0 {
        return None;
    }
    // Uses the closest approach, since the textbook discriminant loses its digits far from the origin.
    let nearest = -along / length_squared;
    let miss = (offset + path * nearest).length_squared();
    let inside = reach * reach - miss;
    if inside <= 0.0 {
        return None;
    }
    let share = nearest - (inside / length_squared).sqrt();
    (share <= 1.0).then_some(max(share, 0.0))
}

/// For two boxes, the axis on which they begin to overlap last, or on which they overlap least.
#[inline]
fn boxes(offset: Vec2, path: Vec2, halves: (Vec2, Vec2), kept: Axis) -> Option<Manifold> {
    let reach = halves.0 + halves.1;
    let overlap = reach - offset.abs();
    let smallest = min(min(halves.0.x, halves.0.y), min(halves.1.x, halves.1.y));
    let corner = min(CORNER, CORNER_SHARE * 2.0 * smallest);
    let axis = if overlap.x >= corner && overlap.y >= corner {
        least_overlap(overlap, kept, 2.0 * corner)
    } else if let Some(axis) = last_entry(offset, path, reach - Vec2::splat(corner)) {
        axis
    } else {
        // Measured on the side where the path starts, because on the other side the box has already passed.
        let ahead = reach - (offset + path) * Vec2::new(side(offset.x), side(offset.y));
        let apart = overlap.x < -corner || overlap.y < -corner;
        let has_passed = ahead.x > corner && ahead.y > corner;
        let is_at_corner = ahead.x.abs() < corner && ahead.y.abs() < corner;
        // In that case, the tangent to the face is valid wherever another contact stops the bodies.
        let end = reach - (offset + path).abs();
        let stays_over_face =
            overlap.x > corner && end.x > corner || overlap.y > corner && end.y > corner;
        if has_passed || is_at_corner || apart && !stays_over_face && is_fast(path, smallest) {
            return None;
        }
        least_overlap(ahead, kept, 2.0 * corner)
    };
    let (normal, overlap_along) = match axis {
        Axis::X => (Vec2::new(side(offset.x), 0.0), overlap.x),
        _ => (Vec2::new(0.0, side(offset.y)), overlap.y),
    };
    // Boxes that separate on one axis may still be apart only on the other.
    let apart = overlap.x < 0.0 || overlap.y < 0.0;
    let separation = if apart { max(-overlap_along, 0.0) } else { -overlap_along };
    Some(Manifold { normal, separation })
}

/// The axis of least overlap. A tie goes to y, as in [`crate::narrow_phase::overlap::collide`].
#[inline]
fn least_overlap(overlap: Vec2, kept: Axis, faith: f32) -> Axis {
    let (x, y) = match kept {
        Axis::Free => (overlap.x, overlap.y),
        Axis::X => (overlap.x - faith, overlap.y),
        Axis::Y => (overlap.x, overlap.y - faith),
    };
    if x < y { Axis::X } else { Axis::Y }
}

/// The axis on which a point enters a box last, if it enters the box along its path.
#[inline]
fn last_entry(offset: Vec2, path: Vec2, half: Vec2) -> Option<Axis> {
    let (enter_x, leave_x) = slab(offset.x, path.x, half.x)?;
    let (enter_y, leave_y) = slab(offset.y, path.y, half.y)?;
    let (enter, leave) = (max(enter_x, enter_y), min(leave_x, leave_y));
    let enters = enter <= leave && enter <= 1.0 && leave >= 0.0;
    enters.then_some(if enter_x > enter_y { Axis::X } else { Axis::Y })
}

/// Shares of the path at which a coordinate enters and leaves (-half, half), or `None` if it never enters.
#[inline]
fn slab(offset: f32, path: f32, half: f32) -> Option<(f32, f32)> {
    if path == 0.0 {
        return (offset.abs() < half).then_some((f32::NEG_INFINITY, f32::INFINITY));
    }
    let (one, other) = ((-half - offset) / path, (half - offset) / path);
    Some(if path > 0.0 { (one, other) } else { (other, one) })
}

/// A circle relative to a box. `size` is the magnitude of the coordinates, which limits their precision.
#[inline]
fn box_circle(offset: Vec2, path: Vec2, half: Vec2, radius: f32, size: Vec2) -> Option<Manifold> {
    let outside = offset.abs() - half;
    let start = box_circle_at_rest(offset, outside, half, radius);
    let straight = path.length_squared() <= STRAIGHT * radius * radius;
    if straight || stays_over_face(offset, outside, path, half) {
        return Some(start);
    }
    let across = path.perp().abs() / path.length();
    let graze = 2.0 * ROUNDING * (across.dot(size) + radius);
    let over_face = outside.x <= 0.0 || outside.y <= 0.0;
    if start.separation <= if over_face { graze } else { -graze } {
        return Some(start);
    }
    if let Some((share, normal)) = first_touch_of_box(offset, path, half, radius, graze) {
        return Some(tangent(normal, 0.0, path * share));
    }
    if is_fast(path, min(radius, min(half.x, half.y))) {
        return None;
    }
    Some(closest_approach(offset, path, half, radius, start))
}

/// The manifold of a circle that misses the box, taken at the start of its path if it moves away, and otherwise
/// at the end or where it passes the corner closest to its path, whichever is nearer.
#[inline]
fn closest_approach(
    offset: Vec2,
    path: Vec2,
    half: Vec2,
    radius: f32,
    start: Manifold,
) -> Manifold {
    if start.normal.dot(path) >= 0.0 {
        return tangent(start.normal, start.separation, Vec2::ZERO);
    }
    let across = if path.perp().dot(offset) < 0.0 { -path.perp() } else { path.perp() };
    let corner = Vec2::new(half.x * side(across.x), half.y * side(across.y));
    let nearest = clamp((corner - offset).dot(path) / path.length_squared(), 0.0, 1.0);
    let at = |share: f32| {
        let touching = offset + path * share;
        (box_circle_at_rest(touching, touching.abs() - half, half, radius), path * share)
    };
    let ((by_corner, ahead), (by_end, whole)) = (at(nearest), at(1.0));
    if by_corner.separation < by_end.separation {
        tangent(by_corner.normal, by_corner.separation, ahead)
    } else {
        tangent(by_end.normal, by_end.separation, whole)
    }
}

/// Whether the nearest point of the box lies on one face for the whole path.
#[inline]
fn stays_over_face(offset: Vec2, outside: Vec2, path: Vec2, half: Vec2) -> bool {
    let end = (offset + path).abs() - half;
    outside.x <= 0.0 && end.x <= 0.0 || outside.y <= 0.0 && end.y <= 0.0
}

/// First contact of a circle with a box outside which it starts, as the share of the path and the normal there.
///
/// The centre must enter the box grown by the radius. If it does so in a corner square, it touches only within the
/// radius of that corner. The four corner squares are separate, so a centre cannot get from one to another without
/// touching. Passing a corner by less than `graze` counts as rounding, so that a circle can roll from tile to tile.
#[inline]
fn first_touch_of_box(
    offset: Vec2,
    path: Vec2,
    half: Vec2,
    radius: f32,
    graze: f32,
) -> Option<(f32, Vec2)> {
    let (enter_x, leave_x) = slab(offset.x, path.x, half.x + radius)?;
    let (enter_y, leave_y) = slab(offset.y, path.y, half.y + radius)?;
    let (enter, leave) = (max(enter_x, enter_y), min(leave_x, leave_y));
    if enter > leave || enter > 1.0 || leave < 0.0 {
        return None;
    }
    let touching = offset + path * max(enter, 0.0);
    let beside = touching.abs() - half;
    if beside.x > 0.0 && beside.y > 0.0 {
        let corner = Vec2::new(half.x * side(touching.x), half.y * side(touching.y));
        let share = first_touch_of_circle(offset - corner, path, radius - graze)?;
        let (normal, _) = {
            let difference = offset - corner + path * share;
            corner_normal(difference, difference.length_squared())
        };
        return Some((share, normal));
    }
    let normal = if enter_x > enter_y {
        Vec2::new(-side(path.x), 0.0)
    } else {
        Vec2::new(0.0, -side(path.y))
    };
    Some((max(enter, 0.0), normal))
}

#[cfg(test)]
mod tests;
