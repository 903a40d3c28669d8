//! Zones of a game: a tint on the stage with a bright edge, brighter while they are on. A zone that is held
//! has the colour of its holder.

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::FrameZone;
use crate::view::palette::{self, PAPER, Rgb};
use jostle_sim::{Shape, Vec2};

/// Width of the edge, pixels.
const EDGE_PIXELS: f32 = 2.0;

/// Adds how far a zone is taken: it fills from the floor up, or from the middle.
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

/// Adds all zones in view.
pub fn fill(stage: &mut DrawStage) {
    for zone in stage.frame.zones {
        let half = zone.shape.half_extent();
        if !stage.quads.sees(zone.center, half) {
            continue;
        }
        let color = zone.color.map_or(PAPER[1], palette::player);
        let (inside, edge) = if zone.on { (0.2, 0.8) } else { (0.09, 0.4) };
        let (fill, ring) = match zone.shape {
            Shape::Box { .. } => (SolidKind::Box, SolidKind::RingBox),
            Shape::Circle { .. } => (SolidKind::Oval, SolidKind::RingOval),
        };
        let width = EDGE_PIXELS * stage.quads.unit_per_pixel;
        stage.quads.push(SolidVertex::new(fill, zone.center, half, rgba(color, inside)));
        if let Some((taker, share)) = zone.taken {
            fill_up(stage, zone, palette::player(taker), share);
        }
        let ring = SolidVertex::new(ring, zone.center, half, rgba(color, edge));
        stage.quads.push(ring.soft(width).edged([255; 4]));
        if zone.on {
            stage.shine(zone.center, color, 0.2 * half.min_element());
        }
    }
}
