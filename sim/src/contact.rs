//! Narrow phase: do two placed shapes overlap, how deep, and along which normal.

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

/// The overlap of two shapes, or `None`; touching is no contact (strict everywhere).
///
/// `collide(a, b)` and `collide(b, a)` agree up to the sign of the normal. `ids` varies the normal
/// of two circles with one centre.
pub fn collide(
    shape_a: Shape,
    center_a: Vec2,
    shape_b: Shape,
    center_b: Vec2,
    ids: (u32, u32),
) -> Option<Contact> {
    let _ = (shape_a, center_a, shape_b, center_b, ids);
    todo!()
}
