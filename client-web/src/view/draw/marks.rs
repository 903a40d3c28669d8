//! Marks on the wall, and the lamps that shine on them.

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::palette::{EMBER, PAPER};
use jostle_sim::Vec2;

/// Places of the dots of one to six, in halves of a mark's size, as on dice.
const DICE: [&[(f32, f32)]; 6] = [
    &[(0.0, 0.0)],
    &[(-0.6, 0.6), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.0, 0.0), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.6, 0.6), (-0.6, -0.6), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.6, 0.6), (0.0, 0.0), (-0.6, -0.6), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.6, 0.6), (-0.6, 0.0), (0.6, 0.0), (-0.6, -0.6), (0.6, -0.6)],
];
/// Radius of a dot, in halves of a mark's size.
const DOT: f32 = 0.24;

/// Adds all lamps and marks in view.
pub fn fill(stage: &mut DrawStage) {
    for lamp in stage.frame.lamps {
        let half = Vec2::splat(lamp.reach);
        stage.quads.push(SolidVertex::new(SolidKind::Glow, lamp.center, half, rgba(EMBER[0], 0.3)));
        stage.shine(lamp.center, EMBER[0], 0.6 * lamp.reach);
    }
    for mark in stage.frame.marks {
        let half = 0.5 * mark.size;
        let fill = rgba(PAPER[0], 0.9 * mark.light);
        for &(x, y) in DICE[usize::from(mark.dots.clamp(1, 6)) - 1] {
            let at = mark.center + Vec2::new(x, y) * half;
            let radius = Vec2::splat(DOT * half);
            stage.quads.push(SolidVertex::new(SolidKind::Oval, at, radius, fill));
        }
    }
}
