//! The narrow phase determines whether and how two shapes touch, overlap or are apart.

pub(crate) mod overlap;
pub(crate) mod separation;

use glam::Vec2;

/// Contact between two shapes, current or predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manifold {
    /// Unit vector from a to b.
    pub normal: Vec2,
    /// Distance along the normal, world units; negative if the shapes overlap.
    pub separation: f32,
}

impl Manifold {
    /// Returns the manifold of the same two shapes in reverse order.
    pub(crate) fn flipped(self) -> Manifold {
        Manifold { normal: -self.normal, ..self }
    }
}
