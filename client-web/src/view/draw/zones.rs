//! Zones of a game: a tint on the stage with a bright edge, brighter while they are on. A zone that is held
//! has the colour of its holder.

use super::stage::Stage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::palette::{self, PAPER};
use jostle_sim::Shape;

/// Width of the edge, pixels.
const EDGE_PIXELS: f32 = 2.0;

/// Adds all zones in view.
pub fn fill(stage: &mut Stage) {
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
        let ring = SolidVertex::new(ring, zone.center, half, rgba(color, edge));
        stage.quads.push(ring.soft(width).edged([255; 4]));
        if zone.on {
            stage.shine(zone.center, color, 0.2 * half.min_element());
        }
    }
}
