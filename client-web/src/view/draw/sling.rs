//! The sling: its post and band, the way that the ball will take, and the shots that are left.

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::palette::{self, PAPER, WOOD};
use jostle_sim::Vec2;

/// Height of the post below the ball's start, and of the fork above it, world units.
const POST: f32 = 18.0;
const FORK: Vec2 = Vec2::new(4.0, 4.0);
/// Half the width of the wood, and of the band.
const WOOD_HALF: f32 = 1.1;
const BAND_HALF: f32 = 0.45;
/// Radius of a dot at the start of the way; the last one has a third of it.
const DOT: f32 = 0.9;

/// Adds the sling, if there is one.
pub fn fill(stage: &mut DrawStage) {
    let Some(sling) = stage.frame.sling else { return };
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
        let fill = rgba(PAPER[0], 0.85);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, Vec2::splat(1.2), fill));
    }
    let count = sling.path.len().max(1) as f32;
    for (number, &at) in sling.path.iter().enumerate() {
        let faded = 1.0 - number as f32 / count;
        let radius = Vec2::splat(DOT * (0.33 + 0.67 * faded));
        let fill = rgba(PAPER[0], 0.25 + 0.6 * faded);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, radius, fill));
    }
}
