//! Narrow phase: do two placed shapes overlap, how deep, and along which normal.
//!
//! Strict everywhere: touching is no contact. Every result is a fresh value with a unit normal; no
//! placement of finite shapes gives NaN (chapter defects C01 to C06).

use crate::math::{self, ordered_bits};
use crate::shape::Shape;
use glam::Vec2;

/// An overlap of a with b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Overlap along the normal in world units, positive.
    pub depth: f32,
}

impl Contact {
    fn flipped(self) -> Contact {
        Contact { normal: -self.normal, depth: self.depth }
    }
}

/// Circle centres nearer than this share of the radii count as one centre: below it the squared
/// distance loses its digits and the normal its length (C05).
const SAME_CENTER: f32 = 1e-6;

/// The golden angle in radians: consecutive multiples never line up.
const GOLDEN_ANGLE: f32 = 2.399_963_2;

/// The overlap of two shapes, or `None`; touching is no contact.
///
/// `collide(a, b)` and `collide(b, a)` agree up to the sign of the normal. `ids` are the two
/// bodies' indices; they vary the normal of two circles with one centre, so that a heap spawned at
/// one point does not leave in one direction (C04).
#[inline]
pub fn collide(
    shape_a: Shape,
    center_a: Vec2,
    shape_b: Shape,
    center_b: Vec2,
    ids: (u32, u32),
) -> Option<Contact> {
    let offset = center_b - center_a;
    match (shape_a, shape_b) {
        (Shape::Circle { radius: a }, Shape::Circle { radius: b }) => {
            circle_circle(offset, a, b, ids)
        }
        (Shape::Box { half: a }, Shape::Box { half: b }) => box_box(offset, a + b),
        (Shape::Box { half }, Shape::Circle { radius }) => box_circle(offset, half, radius),
        (Shape::Circle { radius }, Shape::Box { half }) => {
            box_circle(-offset, half, radius).map(Contact::flipped)
        }
    }
}

/// Row A2.16: depth r1 + r2 - d along the line of centres.
#[inline]
pub(crate) fn circle_circle(
    offset: Vec2,
    radius_a: f32,
    radius_b: f32,
    ids: (u32, u32),
) -> Option<Contact> {
    let reach = radius_a + radius_b;
    let squared = offset.length_squared();
    if squared >= reach * reach {
        return None;
    }
    let distance = squared.sqrt();
    if distance <= SAME_CENTER * reach {
        return Some(Contact { normal: parting_normal(ids), depth: reach });
    }
    Some(Contact { normal: offset / distance, depth: reach - distance })
}

/// The direction in which two circles with one centre part: +y for the first pair, then turning by
/// the golden angle with the two ids.
#[cold]
pub(crate) fn parting_normal((id_a, id_b): (u32, u32)) -> Vec2 {
    let (low, high) = if id_a < id_b { (id_a, id_b) } else { (id_b, id_a) };
    let turn = low.wrapping_mul(31).wrapping_add(high).wrapping_sub(1) % 1024;
    let normal = math::rotate(Vec2::Y, turn as f32 * GOLDEN_ANGLE);
    if id_a < id_b { normal } else { -normal }
}

/// Row A2.15: the axis of least overlap; a tie goes to y, equal centres part towards plus.
#[inline]
pub(crate) fn box_box(offset: Vec2, reach: Vec2) -> Option<Contact> {
    let depth = reach - offset.abs();
    if depth.x <= 0.0 || depth.y <= 0.0 {
        return None;
    }
    Some(if depth.x < depth.y {
        Contact { normal: Vec2::new(side(offset.x), 0.0), depth: depth.x }
    } else {
        Contact { normal: Vec2::new(0.0, side(offset.y)), depth: depth.y }
    })
}

/// Row A2.14: from the nearest point of the box to the circle's centre; a centre inside or on the
/// border leaves by the nearest side, depth r + distance to that side (C02, C03).
#[inline]
fn box_circle(offset: Vec2, half: Vec2, radius: f32) -> Option<Contact> {
    let outside = offset.abs() - half;
    if outside.x >= radius || outside.y >= radius {
        return None;
    }
    if outside.x <= 0.0 && outside.y <= 0.0 {
        let exit = nearest_exit(offset, half);
        return Some(Contact { normal: exit.normal, depth: radius + exit.depth });
    }
    let nearest =
        Vec2::new(math::clamp(offset.x, -half.x, half.x), math::clamp(offset.y, -half.y, half.y));
    let difference = offset - nearest;
    let squared = difference.length_squared();
    if squared >= radius * radius {
        return None;
    }
    // One axis alone is exact; the square root of its square may not be.
    let (normal, distance) = if outside.x <= 0.0 {
        (Vec2::new(0.0, side(difference.y)), difference.y.abs())
    } else if outside.y <= 0.0 {
        (Vec2::new(side(difference.x), 0.0), difference.x.abs())
    } else {
        corner_normal(difference, squared)
    };
    Some(Contact { normal, depth: radius - distance })
}

/// Unit normal and distance from a box corner; a distance whose square underflows points outward
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

/// How a point inside a box, or on its border, leaves by the nearest side: the smallest of
/// half - |v|, a tie goes to y (C02). The depth may be 0.
#[inline]
pub fn nearest_exit(point: Vec2, half: Vec2) -> Contact {
    let depth = half - point.abs();
    if depth.x < depth.y {
        Contact { normal: Vec2::new(side(point.x), 0.0), depth: depth.x }
    } else {
        Contact { normal: Vec2::new(0.0, side(point.y)), depth: depth.y }
    }
}

/// -1 for negative numbers, else +1.
#[inline]
pub(crate) fn side(value: f32) -> f32 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests;
