//! What a zone is: a goal has a net, a gate two poles, and a zone that follows a body is a flag.

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::{FrameZone, ZoneSign};
use crate::view::palette::{PAPER, Rgb};
use jostle_sim::Vec2;

/// Distance between the cords of a net, world units, and half their width.
const MESH: f32 = 5.0;
const CORD: f32 = 0.22;
/// Half the width of goal posts, poles of gates and flagpoles, world units.
const POST: f32 = 0.9;
/// How far a sign extends past its zone, world units.
pub const REACH: f32 = 16.0;
/// Height of a flag above its centre, and half the size of its cloth, world units.
const FLAGPOLE: f32 = 15.0;
const CLOTH: Vec2 = Vec2::new(4.5, 3.0);

/// Draws a zone's sign over its fill.
pub fn fill(stage: &mut DrawStage, zone: &FrameZone, color: Rgb) {
    match zone.sign {
        ZoneSign::Area => {}
        ZoneSign::Goal => goal(stage, zone, color),
        ZoneSign::Gate => gate(stage, zone, color),
        ZoneSign::Flag => flag(stage, zone.center, color),
    }
}

/// The long axis of a zone's box, 0 or 1, and half its length along each axis.
fn axis(zone: &FrameZone) -> (usize, Vec2) {
    let half = zone.shape.half_extent();
    (usize::from(half.y > half.x), half)
}

/// A net, and a bar along its mouth, which is the side towards the middle of the world.
fn goal(stage: &mut DrawStage, zone: &FrameZone, color: Rgb) {
    let (long, half) = axis(zone);
    let cord = rgba(stage.frame.style().pen, 0.4);
    for along in 0..2 {
        for number in 1..(2.0 * half[along] / MESH) as i32 {
            let mut ends = [zone.center - half, zone.center + half];
            let at = ends[0][along] + number as f32 * MESH;
            ends.iter_mut().for_each(|end| end[along] = at);
            stage.line(ends[0], ends[1], CORD, cord);
        }
    }
    let short = 1 - long;
    let inward = (0.5 * stage.frame.world_size - zone.center)[short].signum();
    let mut ends = [zone.center - half, zone.center + half];
    ends.iter_mut().for_each(|end| end[short] = zone.center[short] + inward * half[short]);
    stage.line(ends[0], ends[1], POST, rgba(color, 1.0));
}

/// Poles with knobs at both ends of a gate.
fn gate(stage: &mut DrawStage, zone: &FrameZone, color: Rgb) {
    let (long, half) = axis(zone);
    let mut out = Vec2::ZERO;
    out[long] = half[long] - POST;
    let mut side = Vec2::ZERO;
    side[1 - long] = 1.6 * half[1 - long];
    for end in [zone.center - out, zone.center + out] {
        stage.line(end - side, end + side, POST, rgba(color, 1.0));
        for knob in [end - side, end + side] {
            let ball = SolidVertex::new(
                SolidKind::MatteOval,
                knob,
                Vec2::splat(1.8 * POST),
                rgba(color, 1.0),
            );
            stage.quads.push(ball.edged(rgba(PAPER[0], 1.0)));
        }
    }
}

fn flag(stage: &mut DrawStage, foot: Vec2, color: Rgb) {
    let top = foot + Vec2::new(0.0, FLAGPOLE);
    stage.line(foot, top, 0.6 * POST, rgba(stage.frame.style().pen, 1.0));
    let center = top + CLOTH * Vec2::new(1.0, -1.0);
    let cloth = SolidVertex::new(SolidKind::MatteBox, center, CLOTH, rgba(color, 1.0));
    stage.quads.push(cloth.rounded(0.6).edged(rgba(PAPER[0], 1.0)));
}
