//! The bounds view: thin outlines over everything, in the chapter's colours (A1.4, B3). A box is
//! four lines (A1.10), a circle 16 segments from angle 0 (A1.11), and an X of 0.5 by 0.5 units
//! marks each centre (A1.6).

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::FrameBody;
use crate::view::palette::PAPER;
use jostle_game::Kind;
use jostle_sim::{Shape, Vec2};

/// Number of segments in a drawn circle.
pub const SEGMENTS: usize = 16;
/// Half of the width and height of a centre mark, world units.
const MARK_HALF: f32 = 0.25;
/// Line width in pixels for a view 720 pixels high; it scales with the view.
const LINE_PIXELS: f32 = 1.5;

/// Opacity of the selected body's interior.
const CHOSEN_ALPHA: f32 = 0.4;

const NORMAL: [u8; 4] = [0, 255, 0, 255];
const MARBLE: [u8; 4] = [255, 255, 255, 255];
const SLAB: [u8; 4] = [255, 51, 51, 255];
const TOUCHING: [u8; 4] = [255, 0, 0, 255];

/// Adds the outlines of all visible bodies.
pub fn fill(stage: &mut DrawStage) {
    let ring = circle_corners();
    // While a body is selected, only the bodies that it touches are red (A1.4).
    let selecting = stage.frame.room.bodies.iter().any(|body| body.hidden);
    for body in &stage.frame.room.bodies {
        if !stage.quads.sees(body.center, body.shape.half_extent() + Vec2::ONE) {
            continue;
        }
        let color = color(body, selecting);
        match body.shape {
            Shape::Circle { radius } => {
                chosen(stage, body, SolidKind::Oval);
                let corners = ring.map(|corner| body.center + corner * radius);
                closed(stage, &corners, color);
            }
            Shape::Box { half } => {
                chosen(stage, body, SolidKind::Box);
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                    .map(|(x, y)| body.center + half * Vec2::new(x, y));
                closed(stage, &corners, color);
            }
        }
        for slope in [1.0, -1.0] {
            let arm = Vec2::new(MARK_HALF, MARK_HALF * slope);
            line(stage, body.center - arm, body.center + arm, color);
        }
    }
}

/// Fills the outline of the selected body, whose normal drawing is hidden.
fn chosen(stage: &mut DrawStage, body: &FrameBody, kind: SolidKind) {
    if body.hidden {
        let fill = rgba(PAPER[0], CHOSEN_ALPHA);
        stage.quads.push(SolidVertex::new(kind, body.center, body.shape.half_extent(), fill));
    }
}

fn color(body: &FrameBody, selecting: bool) -> [u8; 4] {
    match body.kind {
        _ if body.touching => TOUCHING,
        _ if selecting => NORMAL,
        Kind::Marble => MARBLE,
        Kind::Platform | Kind::Wall => SLAB,
        _ => NORMAL,
    }
}

/// Corners of the unit circle's polygon, starting at angle 0.
fn circle_corners() -> [Vec2; SEGMENTS] {
    let mut corners = [Vec2::ZERO; SEGMENTS];
    for (i, corner) in corners.iter_mut().enumerate() {
        *corner = Vec2::from_angle(i as f32 * std::f32::consts::TAU / SEGMENTS as f32);
    }
    corners
}

fn closed(stage: &mut DrawStage, corners: &[Vec2], color: [u8; 4]) {
    for (i, &corner) in corners.iter().enumerate() {
        line(stage, corner, corners[(i + 1) % corners.len()], color);
    }
}

fn line(stage: &mut DrawStage, from: Vec2, to: Vec2, color: [u8; 4]) {
    let tall = stage.frame.view.pixels[1] as f32 / 720.0;
    let width = 0.5 * LINE_PIXELS * tall.max(1.0) * stage.quads.unit_per_pixel;
    stage.line(from, to, width, color);
}
