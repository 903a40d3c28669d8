//! The growing list of solid quads, which leaves out what the view does not show.

use super::vertex::SolidVertex;
use jostle_sim::Vec2;

/// Solid quads drawn at a time; further ones are left out.
const QUADS_MAX: usize = 262_144;

/// Quads of a frame, in drawing order.
#[derive(Default)]
pub struct Quads {
    /// Four vertices a quad.
    pub vertices: Vec<SolidVertex>,
    center: Vec2,
    half: Vec2,
    /// World units a pixel.
    pub unit_per_pixel: f32,
}

impl Quads {
    /// Empties the list for a view.
    pub fn begin(&mut self, center: Vec2, half: Vec2, unit_per_pixel: f32) {
        self.vertices.clear();
        self.center = center;
        self.half = half;
        self.unit_per_pixel = unit_per_pixel;
    }

    /// Whether a box around a point can be seen.
    pub fn sees(&self, center: Vec2, half: Vec2) -> bool {
        let away = (center - self.center).abs();
        away.x < self.half.x + half.x && away.y < self.half.y + half.y
    }

    /// Adds a quad unless it is out of view.
    pub fn push(&mut self, quad: SolidVertex) {
        let center = Vec2::from(quad.center);
        let reach = Vec2::from(quad.half) + Vec2::splat(quad.rounding[1]);
        let upright = quad.axis == [1.0, 0.0];
        let reach = if upright { reach } else { Vec2::splat(reach.length()) };
        if self.sees(center, reach) && self.vertices.len() < QUADS_MAX * 4 {
            self.vertices.extend_from_slice(&[quad; 4]);
        }
    }
}
