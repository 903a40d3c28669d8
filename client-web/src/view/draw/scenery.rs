//! Parts of a scene that are not bodies: zones, with a tint on the stage and a bright edge; marks on the wall, with the
//! lamps that shine on them; and the sling.

use super::signs;
use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::FrameZone;
use crate::view::palette::{self, EMBER, PAPER, Rgb, WOOD};
use jostle_sim::{Shape, Vec2};

/// Least width of the edge, pixels and world units.
const EDGE_PIXELS: f32 = 2.0;
const EDGE: f32 = 0.7;

/// Shows the progress of capturing a zone: a box fills from the floor up, a circle from its centre.
fn fill_up(stage: &mut DrawStage, zone: &FrameZone, color: Rgb, share: f32) {
    let half = zone.shape.half_extent();
    let (kind, center, half) = match zone.shape {
        Shape::Box { .. } => {
            let part = Vec2::new(half.x, half.y * share);
            (SolidKind::Box, zone.center - Vec2::new(0.0, half.y - part.y), part)
        }
        Shape::Circle { .. } => (SolidKind::Oval, zone.center, half * share),
    };
    stage.quads.push(SolidVertex::new(kind, center, half, rgba(color, 0.3)));
}

/// Adds all visible zones.
pub fn zones(stage: &mut DrawStage) {
    let look = stage.frame.style();
    for zone in &stage.frame.room.zones {
        let half = zone.shape.half_extent();
        if !stage.quads.sees(zone.center, half + Vec2::splat(signs::REACH)) {
            continue;
        }
        let color = zone.color.map_or(PAPER[1], palette::player);
        let (inside, edge) = if zone.on { (0.34, 1.0) } else { (0.2, 0.8) };
        // Pale colours would be lost on light ground.
        let rim = palette::mix(color, look.pen, 0.4 * look.cover);
        let (fill, ring) = match zone.shape {
            Shape::Box { .. } => (SolidKind::Box, SolidKind::RingBox),
            Shape::Circle { .. } => (SolidKind::Oval, SolidKind::RingOval),
        };
        let width = (EDGE_PIXELS * stage.quads.unit_per_pixel).max(EDGE);
        stage
            .quads
            .push(SolidVertex::new(fill, zone.center, half, rgba(rim, inside)).rounded(EDGE));
        if let Some((taker, share)) = zone.taken {
            fill_up(stage, zone, palette::player(taker), share);
        }
        let ring = SolidVertex::new(ring, zone.center, half, rgba(rim, edge));
        stage.quads.push(ring.rounded(EDGE).soft(width).edged([255; 4]));
        signs::fill(stage, zone, color);
        if zone.on {
            stage.shine(zone.center, color, 0.2 * half.min_element());
        }
    }
}

/// Dot positions for one to six dots, as on dice, in half mark sizes.
const DICE: [&[(f32, f32)]; 6] = [
    &[(0.0, 0.0)],
    &[(-0.6, 0.6), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.0, 0.0), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.6, 0.6), (-0.6, -0.6), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.6, 0.6), (0.0, 0.0), (-0.6, -0.6), (0.6, -0.6)],
    &[(-0.6, 0.6), (0.6, 0.6), (-0.6, 0.0), (0.6, 0.0), (-0.6, -0.6), (0.6, -0.6)],
];
/// Radius of a dot, in half mark sizes.
const MARK_DOT: f32 = 0.24;

/// Adds all visible lamps and marks.
pub fn marks(stage: &mut DrawStage) {
    for lamp in &stage.frame.room.lamps {
        let half = Vec2::splat(lamp.reach);
        stage.quads.push(SolidVertex::new(SolidKind::Glow, lamp.center, half, rgba(EMBER[0], 0.3)));
        stage.shine(lamp.center, EMBER[0], 0.6 * lamp.reach);
    }
    for mark in &stage.frame.room.marks {
        let half = 0.5 * mark.size;
        let fill = rgba(PAPER[0], 0.9 * mark.light);
        for &(x, y) in DICE[usize::from(mark.dots.clamp(1, 6)) - 1] {
            let at = mark.center + Vec2::new(x, y) * half;
            let radius = Vec2::splat(MARK_DOT * half);
            stage.quads.push(SolidVertex::new(SolidKind::Oval, at, radius, fill));
        }
    }
}

/// Height of the post below the ball's start; [`FORK`] is the extent of the fork above it, world units.
const POST: f32 = 18.0;
const FORK: Vec2 = Vec2::new(4.0, 4.0);
/// Half the width of the wood and of the band, world units.
const WOOD_HALF: f32 = 1.1;
const BAND_HALF: f32 = 0.45;
/// Radius of the path's first dot; that of the last dot is a third of this.
const DOT: f32 = 0.9;

/// Adds the sling, if the scene has one.
pub fn sling(stage: &mut DrawStage) {
    let Some(sling) = &stage.frame.room.sling else { return };
    let (start, wood) = (sling.start, stage.shade(WOOD[0], 1.0));
    let neck = start - Vec2::new(0.0, FORK.y);
    let tips = [-1.0, 1.0].map(|side| start + FORK * Vec2::new(side, 0.6));
    stage.line(start - Vec2::new(0.0, POST), neck, WOOD_HALF, wood);
    tips.iter().for_each(|&tip| stage.line(neck, tip, WOOD_HALF, wood));
    if let Some(ball) = sling.ball {
        let band = stage.shade(palette::mix(WOOD[1], PAPER[1], 0.3), 1.0);
        tips.iter().for_each(|&tip| stage.line(tip, ball, BAND_HALF, band));
    }
    for number in 0..sling.shots {
        let at = start + Vec2::new(3.5 * f32::from(number) - 7.0, -POST - 4.0);
        let fill = rgba(stage.frame.style().pen, 0.85);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, Vec2::splat(1.2), fill));
    }
    let count = sling.path.len().max(1) as f32;
    for (number, &at) in sling.path.iter().enumerate() {
        let faded = 1.0 - number as f32 / count;
        let radius = Vec2::splat(DOT * (0.33 + 0.67 * faded));
        let fill = rgba(stage.frame.style().pen, 0.25 + 0.6 * faded);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, radius, fill));
    }
}
