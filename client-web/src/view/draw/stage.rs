//! The inputs and outputs shared by the drawing functions of one frame, and the growing list of solid quads, which
//! omits those outside the view.

use super::light::LightField;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::Frame;
use crate::view::palette::{self, INK, Rgb};
use jostle_sim::Vec2;

/// Maximum number of solid quads per frame; further ones are omitted.
const QUADS_MAX: usize = 262_144;

/// The frame being drawn, and the lists into which it is drawn.
pub(super) struct DrawStage<'a> {
    pub quads: &'a mut Quads,
    /// The light emitted by glowing objects.
    pub light: &'a mut LightField,
    /// The frame being drawn.
    pub frame: &'a Frame<'a>,
}

impl DrawStage<'_> {
    /// A body's colour; with outlines shown, bodies are darkened behind the lines.
    pub fn shade(&self, color: Rgb, alpha: f32) -> [u8; 4] {
        let back = if self.frame.bounds { 0.22 } else { 0.0 };
        rgba(palette::mix(color, INK[1], back), alpha)
    }

    /// A straight line with round ends and this half width.
    pub fn line(&mut self, from: Vec2, to: Vec2, half_width: f32, color: [u8; 4]) {
        let span = to - from;
        let length = span.length();
        let half = Vec2::new(0.5 * length + half_width, half_width);
        let quad = SolidVertex::new(SolidKind::Box, (from + to) * 0.5, half, color);
        self.quads.push(quad.rounded(half_width).turned(span / length.max(1e-6)));
    }

    /// Casts light on nearby surfaces.
    pub fn shine(&mut self, point: Vec2, color: Rgb, strength: f32) {
        self.light.add(point, color.map(|c| f32::from(c) / 255.0), strength);
    }
}

/// The quads of a frame, in drawing order.
#[derive(Default)]
pub struct Quads {
    /// Four vertices per quad.
    pub vertices: Vec<SolidVertex>,
    center: Vec2,
    half: Vec2,
    /// World units per pixel.
    pub unit_per_pixel: f32,
}

impl Quads {
    /// Empties the list for a new view.
    pub fn begin(&mut self, center: Vec2, half: Vec2, unit_per_pixel: f32) {
        self.vertices.clear();
        self.center = center;
        self.half = half;
        self.unit_per_pixel = unit_per_pixel;
    }

    /// Whether a box around a point is visible.
    pub fn sees(&self, center: Vec2, half: Vec2) -> bool {
        let away = (center - self.center).abs();
        away.x < self.half.x + half.x && away.y < self.half.y + half.y
    }

    /// Adds a quad unless it is outside the view.
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
