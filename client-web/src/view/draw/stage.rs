//! The inputs and outputs shared by the drawing functions of one frame.

use super::light::LightField;
use super::quads::Quads;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::Frame;
use crate::view::palette::{self, INK, Rgb};
use jostle_sim::Vec2;

/// The frame that is drawn, and the lists that it is drawn into.
pub(super) struct DrawStage<'a> {
    pub quads: &'a mut Quads,
    /// Light that glowing things throw.
    pub light: &'a mut LightField,
    /// The frame that is drawn.
    pub frame: &'a Frame<'a>,
}

impl DrawStage<'_> {
    /// A body's colour; the bounds view steps all of them back behind its lines.
    pub fn shade(&self, color: Rgb, alpha: f32) -> [u8; 4] {
        let back = if self.frame.bounds { 0.22 } else { 0.0 };
        rgba(palette::mix(color, INK[1], back), alpha)
    }

    /// A straight line with round ends, of half this width.
    pub fn line(&mut self, from: Vec2, to: Vec2, half_width: f32, color: [u8; 4]) {
        let span = to - from;
        let length = span.length();
        let half = Vec2::new(0.5 * length + half_width, half_width);
        let quad = SolidVertex::new(SolidKind::Box, (from + to) * 0.5, half, color);
        self.quads.push(quad.rounded(half_width).turned(span / length.max(1e-6)));
    }

    /// Throws light on what is near.
    pub fn shine(&mut self, point: Vec2, color: Rgb, strength: f32) {
        self.light.add(point, color.map(|c| f32::from(c) / 255.0), strength);
    }
}
