//! Obstacles of a held network.

use glam::DVec2;

/// The side of an immovable obstacle: a stiff damper holds a node that would pass it.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub node: u32,
    /// Unit vector towards the node.
    pub normal: DVec2,
    /// Least velocity along it, units/s.
    pub speed_min: f64,
    pub is_active: bool,
    /// Impulse per unit of speed below the least.
    pub stiffness: f64,
}

impl Plane {
    /// Impulse along the normal on a node with this velocity.
    pub fn impulse(&self, velocity: DVec2) -> f64 {
        let short = self.speed_min - self.normal.dot(velocity);
        if self.is_active { self.stiffness * short } else { 0.0 }
    }
}
