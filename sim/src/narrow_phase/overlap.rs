//! Determines whether two shapes at given positions overlap, how deeply, and along which normal.
//!
//! All comparisons are strict, so touching is not a contact. Every normal has unit length, and no arrangement of
//! finite shapes produces NaN (C01 to C06).

use crate::bodies::Bodies;
use crate::math::{self, ordered_bits};
use crate::narrow_phase::Manifold;
use crate::shape::{Shape, shapes};
use crate::solver::tolerances::{DEEP_SHARE, SAME_CENTER};
use glam::Vec2;

/// Side of the square over which concentric bodies are treated as spread out, as a share of the thinner one's
/// half-size.
const SPREAD: f32 = 0.25;
const TWO_TO_32: f32 = 4_294_967_296.0;
/// The golden angle in radians. Its consecutive multiples never line up.
const GOLDEN_ANGLE: f32 = 2.399_963_2;

/// Returns the overlap of two shapes, or `None`. Touching is not a contact.
///
/// `collide(a, b)` and `collide(b, a)` agree up to the sign of the normal. `ids` are the indices of the two bodies.
/// They vary the normal of two concentric circles, so that a heap spawned at one point does not separate in a single
/// direction (C04).
#[inline]
pub fn collide(
    shape_a: Shape,
    center_a: Vec2,
    shape_b: Shape,
    center_b: Vec2,
    ids: (u32, u32),
) -> Option<Manifold> {
    let offset = center_b - center_a;
    match (shape_a, shape_b) {
        (Shape::Circle { radius: a }, Shape::Circle { radius: b }) => {
            circle_circle(offset, a, b, ids)
        }
        (Shape::Box { half: a }, Shape::Box { half: b }) => box_box(offset, a + b),
        (Shape::Box { half }, Shape::Circle { radius }) => box_circle(offset, half, radius),
        (Shape::Circle { radius }, Shape::Box { half }) => {
            box_circle(-offset, half, radius).map(Manifold::flipped)
        }
    }
}

/// For two circles, the penetration is r1 + r2 - d along the line of centres (A2.16).
#[inline]
pub(crate) fn circle_circle(
    offset: Vec2,
    radius_a: f32,
    radius_b: f32,
    ids: (u32, u32),
) -> Option<Manifold> {
    let reach = radius_a + radius_b;
    let squared = offset.length_squared();
    if squared >= reach * reach {
        return None;
    }
    Some(circles_at_rest(offset, squared, reach, ids))
}

/// The manifold of two circles, overlapping or not, given the squared distance between their centres.
#[inline]
pub(crate) fn circles_at_rest(offset: Vec2, squared: f32, reach: f32, ids: (u32, u32)) -> Manifold {
    let distance = squared.sqrt();
    if distance <= SAME_CENTER * reach {
        return Manifold { normal: parting_normal(ids), separation: -reach };
    }
    Manifold { normal: offset / distance, separation: distance - reach }
}

/// The direction in which two concentric circles separate. It is +y for the first pair, and is
/// rotated by multiples of the golden angle depending on the two ids.
#[cold]
pub(crate) fn parting_normal((id_a, id_b): (u32, u32)) -> Vec2 {
    let (low, high) = if id_a < id_b { (id_a, id_b) } else { (id_b, id_a) };
    let turn = low.wrapping_mul(31).wrapping_add(high).wrapping_sub(1) % 1024;
    let normal = math::rotate(Vec2::Y, turn as f32 * GOLDEN_ANGLE);
    if id_a < id_b { normal } else { -normal }
}

/// For two boxes, the axis of least overlap. A tie goes to y, and concentric boxes separate in the positive
/// direction (A2.15).
#[inline]
pub(crate) fn box_box(offset: Vec2, reach: Vec2) -> Option<Manifold> {
    let separation = offset.abs() - reach;
    if separation.x >= 0.0 || separation.y >= 0.0 {
        return None;
    }
    Some(if separation.x > separation.y {
        Manifold { normal: Vec2::new(side(offset.x), 0.0), separation: separation.x }
    } else {
        Manifold { normal: Vec2::new(0.0, side(offset.y)), separation: separation.y }
    })
}

/// For a box and a circle (A2.14), the normal runs from the nearest point of the box to the circle's centre. A
/// centre inside the box or on its border leaves through the nearest side, with a penetration of r + distance to
/// that side (C02, C03).
#[inline]
fn box_circle(offset: Vec2, half: Vec2, radius: f32) -> Option<Manifold> {
    let outside = offset.abs() - half;
    if outside.x >= radius || outside.y >= radius {
        return None;
    }
    let away = Vec2::new(math::max(outside.x, 0.0), math::max(outside.y, 0.0));
    if away.length_squared() >= radius * radius {
        return None;
    }
    Some(box_circle_at_rest(offset, outside, half, radius))
}

/// The manifold of a box and a circle, overlapping or not. It starts from the nearest point of the
/// box or, for a centre inside it, leads through the nearest side.
#[inline]
pub(crate) fn box_circle_at_rest(offset: Vec2, outside: Vec2, half: Vec2, radius: f32) -> Manifold {
    if outside.x <= 0.0 && outside.y <= 0.0 {
        let exit = nearest_exit(offset, half);
        return Manifold { separation: exit.separation - radius, ..exit };
    }
    if outside.x <= 0.0 {
        return Manifold { normal: Vec2::new(0.0, side(offset.y)), separation: outside.y - radius };
    }
    if outside.y <= 0.0 {
        return Manifold { normal: Vec2::new(side(offset.x), 0.0), separation: outside.x - radius };
    }
    let difference = Vec2::new(outside.x * side(offset.x), outside.y * side(offset.y));
    let (normal, distance) = corner_normal(difference, difference.length_squared());
    Manifold { normal, separation: distance - radius }
}

/// Unit normal and distance from a box corner. If the square of the distance underflows, the normal points outward
/// along the longer axis.
#[inline]
pub(crate) fn corner_normal(difference: Vec2, squared: f32) -> (Vec2, f32) {
    if squared > f32::MIN_POSITIVE {
        let distance = squared.sqrt();
        return (difference / distance, distance);
    }
    let along_x = ordered_bits(difference.x.abs()) > ordered_bits(difference.y.abs());
    let normal = if along_x {
        Vec2::new(side(difference.x), 0.0)
    } else {
        Vec2::new(0.0, side(difference.y))
    };
    (normal, 0.0)
}

/// The nearest exit for a point inside a box or on its border, which is through the side with the smallest half -
/// |v|. A tie goes to y (C02). The separation may be 0.
#[inline]
pub fn nearest_exit(point: Vec2, half: Vec2) -> Manifold {
    let separation = point.abs() - half;
    if separation.x > separation.y {
        Manifold { normal: Vec2::new(side(point.x), 0.0), separation: separation.x }
    } else {
        Manifold { normal: Vec2::new(0.0, side(point.y)), separation: separation.y }
    }
}

/// Returns -1 for negative numbers, else +1.
#[inline]
pub(crate) fn side(value: f32) -> f32 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

/// The overlap of a pair at its current positions.
#[inline]
pub(crate) fn overlap(bodies: &Bodies, a: u32, b: u32) -> Option<Manifold> {
    let (index_a, index_b) = (a as usize, b as usize);
    collide(
        bodies.shape[index_a],
        bodies.center[index_a],
        bodies.shape[index_b],
        bodies.center[index_b],
        (a, b),
    )
}

/// Like [`overlap`], in a world that has only these [`shapes`].
#[inline]
pub(crate) fn overlap_of<const SHAPES: u8>(bodies: &Bodies, a: u32, b: u32) -> Option<Manifold> {
    let (index_a, index_b) = (a as usize, b as usize);
    let offset = bodies.center[index_b] - bodies.center[index_a];
    let (half_a, half_b) = (bodies.half[index_a], bodies.half[index_b]);
    match SHAPES {
        shapes::CIRCLES => circle_circle(offset, half_a.x, half_b.x, (a, b)),
        shapes::BOXES => box_box(offset, half_a + half_b),
        _ => overlap(bodies, a, b),
    }
}

/// The separation of a pair along a unit vector from a to b, which need not be their normal.
pub(crate) fn separation_along(bodies: &Bodies, (a, b): (u32, u32), normal: Vec2) -> f32 {
    let (a, b) = (a as usize, b as usize);
    let extent = |slot: usize| match bodies.shape[slot] {
        Shape::Circle { radius } => radius,
        Shape::Box { half } => half.dot(normal.abs()),
    };
    normal.dot(bodies.center[b] - bodies.center[a]) - extent(a) - extent(b)
}

/// The manifold of two bodies that overlap too deeply to tell their sides apart. It is along the line of centres, as
/// if the bodies of a heap at one point had been spread out evenly.
#[cold]
pub(crate) fn spread_manifold(bodies: &Bodies, (a, b): (u32, u32)) -> Manifold {
    let offset = bodies.center[b as usize] - bodies.center[a as usize];
    let thin = math::min(bodies.thickness(a as usize), bodies.thickness(b as usize));
    let normal = (offset + (spread(b) - spread(a)) * (SPREAD * thin)).normalize_or(Vec2::Y);
    Manifold { normal, separation: separation_along(bodies, (a, b), normal) }
}

/// The [`spread_manifold`] of two circles that overlap deeply, otherwise their usual manifold. A heap at one point
/// thus spreads in all directions.
#[inline]
pub(crate) fn spread_circles(bodies: &Bodies, pair: (u32, u32), manifold: Manifold) -> Manifold {
    let (a, b) = (pair.0 as usize, pair.1 as usize);
    let deep = DEEP_SHARE * math::min(bodies.half[a].x, bodies.half[b].x);
    if manifold.separation >= -deep {
        return manifold;
    }
    match (bodies.shape[a], bodies.shape[b]) {
        (Shape::Circle { .. }, Shape::Circle { .. }) => spread_manifold(bodies, pair),
        _ => manifold,
    }
}

/// Position of a body in the unit square, for a heap at one point, whose bodies separate as if they had been
/// spread out evenly (multiples of the inverses of the plastic number and of its square; Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences").
fn spread(slot: u32) -> Vec2 {
    const STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];
    let unit = |step: u32| slot.wrapping_mul(step) as f32 / TWO_TO_32;
    Vec2::new(unit(STEPS[0]), unit(STEPS[1]))
}

#[cfg(test)]
mod tests;
