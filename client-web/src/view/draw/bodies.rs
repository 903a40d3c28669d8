//! Bodies: slabs first, then the shadows of all moving bodies, then those bodies with their faces.

use super::faces;
use super::moments;
use super::motion::{BodySprings, Pose};
use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::FrameBody;
use crate::view::palette::{self, INK, MINION, PAPER, Rgb};
use crate::view::style::Style;
use jostle_game::Kind;
use jostle_sim::{Shape, Vec2};

/// Distance by which shadows are shifted straight down, world units.
const SHADOW_DROP: f32 = 1.1;
/// Width of a shadow's soft edge, world units.
const SHADOW_SOFT: f32 = 1.5;
/// Maximum distance by which a body's drawing extends past its outline, world units.
const MARGIN: f32 = 8.0;
/// Adds all bodies in view. `posed` is scratch memory.
pub fn fill(stage: &mut DrawStage, motion: &mut BodySprings, posed: &mut Vec<(u32, Pose)>) {
    let bodies = &stage.frame.room.bodies;
    posed.clear();
    for (index, body) in bodies.iter().enumerate() {
        if !sees(stage, body) {
            continue;
        }
        posed.push((index as u32, motion.pose(body)));
    }
    // Slabs are drawn behind everything, and their shadows behind all slabs.
    let slabs = |(index, _): &&(u32, Pose)| is_slab(&bodies[*index as usize]);
    for (index, pose) in posed.iter().filter(slabs) {
        shadow(stage, &bodies[*index as usize], pose);
    }
    for (index, pose) in posed.iter().filter(slabs) {
        slab(stage, &bodies[*index as usize], pose);
        stains(stage, &bodies[*index as usize], pose);
    }
    posed.retain(|(index, _)| !is_slab(&bodies[*index as usize]));
    for (index, pose) in posed.iter() {
        shadow(stage, &bodies[*index as usize], pose);
    }
    if let Some(ghost) = stage.frame.ghost {
        self::ghost(stage, ghost);
    }
    // Heroes are drawn last, so that none of them is hidden in a heap.
    for heroes in [false, true] {
        let is_next =
            |(index, _): &&(u32, Pose)| (bodies[*index as usize].kind == Kind::Hero) == heroes;
        for (index, pose) in posed.iter().filter(is_next) {
            toy(stage, &bodies[*index as usize], pose);
        }
    }
}

/// A translucent hero without a shadow, since it collides with nothing.
fn ghost(stage: &mut DrawStage, body: &FrameBody) {
    let (center, half) = (body.center, body.shape.half_extent());
    if !stage.quads.sees(center, half) {
        return;
    }
    let (fill, edge) = skin(body);
    let round = corner(body, half);
    let quad = SolidVertex::new(SolidKind::Box, center, half, stage.shade(fill, 0.3));
    stage.quads.push(quad.rounded(round));
    let ring = SolidVertex::new(SolidKind::RingBox, center, half, stage.shade(edge, 0.7));
    stage.quads.push(SolidVertex { edge: [0, 0, 0, 50], ..ring }.rounded(round).soft(0.4));
    for side in [-0.36, 0.36] {
        let at = center + half * Vec2::new(side, 0.25);
        let eye = Vec2::splat(0.17 * half.x.min(half.y));
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, eye, stage.shade(PAPER[0], 0.6)));
    }
}

fn sees(stage: &DrawStage, body: &FrameBody) -> bool {
    let reach = body.shape.half_extent() + Vec2::splat(MARGIN);
    !body.hidden && stage.quads.sees(body.center, reach)
}

fn is_slab(body: &FrameBody) -> bool {
    matches!(body.kind, Kind::Wall | Kind::Platform)
}

fn slab(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    if body.hot {
        ring(stage, body, pose);
    }
    // Floor, ceiling and walls form a unit; only the floor has a lit edge.
    let floor = pose.half.x > pose.half.y && pose.center.y < 0.5 * stage.frame.world_size.y;
    let slate = stage.frame.style().slate;
    let (fill, edge, lit) = match body.kind {
        Kind::Wall => (slate[0], slate[2], if floor { 1.0 } else { 0.0 }),
        _ => (slate[1], slate[3], 1.0),
    };
    let fill = stage.shade(fill, 1.0);
    let edge = stage.shade(edge, lit);
    let quad = SolidVertex::new(SolidKind::Slab, pose.center, pose.half, fill);
    stage.quads.push(quad.rounded(corner(body, pose.half)).edged(edge));
}

fn shadow(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let kind = if is_round(body) { SolidKind::ShadowOval } else { SolidKind::ShadowBox };
    let alpha = if body.kind == Kind::Pack { 0.3 } else { 0.55 };
    let alpha = alpha * (1.0 - 0.5 * stage.frame.style().cover);
    // Small objects lie flat on the ground and cast short shadows.
    let scale = (pose.half.x.min(pose.half.y) / 3.0).min(1.0);
    let below = pose.center - Vec2::new(0.0, SHADOW_DROP * scale);
    let quad = SolidVertex::new(kind, below, pose.half, rgba(INK[0], alpha));
    stage.quads.push(quad.rounded(corner(body, pose.half)).soft(SHADOW_SOFT * scale));
}

fn toy(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    if body.hot {
        ring(stage, body, pose);
    } else if let Some(color) = body.ring {
        colored_ring(stage, body, pose, palette::player(color));
    }
    match body.kind {
        Kind::Pack => pack(stage, body, pose),
        Kind::Block => {
            block(stage, body, pose);
            cracks(stage, body, pose);
        }
        _ => {
            let (fill, edge) = skin(body);
            matte(stage, body, pose, fill, edge);
            stains(stage, body, pose);
            faces::fill(stage, body, pose);
        }
    }
    if stage.frame.room.crown == Some(body.id) {
        moments::crown(stage, pose.center, pose.half);
    }
}

/// The stains on a body, each a blot with two drops beside it.
fn stains(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let extent = body.shape.half_extent();
    let own = stage.frame.room.stains.iter().filter(|stain| stain.body == body.id);
    for stain in own {
        let fill = stage.shade(palette::player(stain.color), 0.9 * stain.left);
        let scale = pose.half / extent;
        let blots = [(0.0, 0.0, 1.0), (-0.7, 0.5, 0.42), (0.75, -0.35, 0.34)];
        for (x, y, size) in blots {
            let half = stain.half * size;
            let at = stain.at * extent + Vec2::new(x, y) * stain.half;
            let at = at.clamp(half - extent, extent - half) * scale;
            let quad = SolidVertex::new(SolidKind::Oval, pose.center + at, half * scale, fill);
            stage.quads.push(quad);
        }
    }
}

/// The fill and lit-edge colours of a body with a face.
fn skin(body: &FrameBody) -> (Rgb, Rgb) {
    const WHITE: Rgb = [255, 255, 255];
    match body.kind {
        Kind::Minion => (MINION[0], MINION[1]),
        Kind::Marble => {
            let pale = palette::mix(PAPER[1], PAPER[0], 0.45 * tone(body));
            (palette::mix(pale, INK[2], 0.10), WHITE)
        }
        _ => {
            let color = body.color.map_or(palette::NOBODY, palette::player);
            (palette::mix(color, INK[1], 0.04), palette::mix(color, WHITE, 0.55))
        }
    }
}

fn matte(stage: &mut DrawStage, body: &FrameBody, pose: &Pose, fill: Rgb, edge: Rgb) {
    let kind = if is_round(body) { SolidKind::MatteOval } else { SolidKind::MatteBox };
    let quad = SolidVertex::new(kind, pose.center, pose.half, stage.shade(fill, 1.0));
    stage.quads.push(quad.rounded(corner(body, pose.half)).edged(stage.shade(edge, 1.0)));
}

fn block(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let Style { wood, toys, .. } = stage.frame.style();
    let fill = palette::mix(wood[0], wood[1], 0.35 + 0.5 * tone(body));
    if is_round(body) {
        let paint = toys[body.id.index as usize % toys.len()];
        let edge = palette::mix(paint, PAPER[0], 0.6);
        matte(stage, body, pose, paint, edge);
        let at = pose.center + pose.half * Vec2::new(-0.28, 0.34);
        let shine = stage.shade(PAPER[0], 0.22);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, at, pose.half * 0.17, shine));
        if body.ring.is_some() && stage.frame.room.sling.is_some() {
            pot(stage, pose, edge);
        }
        return;
    }
    let quad = SolidVertex::new(SolidKind::Crate, pose.center, pose.half, stage.shade(fill, 1.0));
    stage.quads.push(quad.rounded(corner(body, pose.half)).edged(stage.shade(wood[2], 1.0)));
}

/// The dark mouth and the rim that make a target of the sling a pot.
fn pot(stage: &mut DrawStage, pose: &Pose, edge: Rgb) {
    for (at, size, color) in [(0.82, (0.62, 0.2), edge), (0.88, (0.44, 0.1), INK[0])] {
        let center = pose.center + pose.half * Vec2::new(0.0, at);
        let half = pose.half * Vec2::new(size.0, size.1);
        stage.quads.push(SolidVertex::new(SolidKind::Oval, center, half, stage.shade(color, 1.0)));
    }
}

/// Lines across a body that was cracked by a hit.
fn cracks(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    if !body.cracked {
        return;
    }
    const LINES: [[(f32, f32); 4]; 2] = [
        [(-0.7, 0.6), (-0.2, 0.25), (-0.35, -0.1), (0.15, -0.7)],
        [(-0.35, -0.1), (0.2, 0.1), (0.35, 0.45), (0.65, 0.7)],
    ];
    let ink = stage.shade(INK[0], 0.75);
    let width = 0.05 * pose.half.x.min(pose.half.y);
    for line in LINES {
        let corners = line.map(|(x, y)| pose.center + pose.half * Vec2::new(x, y));
        corners.windows(2).for_each(|ends| stage.line(ends[0], ends[1], width, ink));
    }
}

/// A body-specific number in 0..=1, so that bodies in a group vary in shade.
fn tone(body: &FrameBody) -> f32 {
    (body.id.index.wrapping_mul(2_654_435_761) >> 24) as f32 / 255.0
}

/// A drop that points in its direction of flight, with a wake and a small glow.
fn pack(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    let color = body.color.map_or(palette::NOBODY, palette::player);
    let radius = pose.half.x.min(pose.half.y);
    let speed = body.velocity.length();
    let forward = if speed > 1.0 { body.velocity / speed } else { Vec2::new(0.0, -1.0) };

    let glow = SolidVertex::new(
        SolidKind::Glow,
        pose.center,
        Vec2::splat(radius * 4.5),
        stage.shade(color, 0.30),
    );
    stage.quads.push(glow);
    stage.shine(body.center, color, 2.5);

    let tail = (speed * 0.22).min(radius * 7.0);
    let wake = SolidVertex::new(
        SolidKind::Trail,
        pose.center - forward * (0.5 * tail),
        Vec2::new(0.5 * tail, radius * 0.75),
        stage.shade(color, 0.55),
    );
    stage.quads.push(wake.turned(forward).edged([0, 0, 0, 0]));

    let tip = radius * (1.5 + (speed / 30.0).min(1.0) * 0.9);
    let white = palette::mix(color, [255, 255, 255], 0.7);
    let drop = SolidVertex::new(
        SolidKind::Drop,
        pose.center,
        Vec2::new(tip, radius),
        stage.shade(color, 1.0),
    );
    stage.quads.push(drop.turned(forward).edged(stage.shade(white, 1.0)));
    let shine = pose.center + Vec2::new(-0.3, 0.35) * radius;
    let fill = stage.shade(white, 0.8);
    stage.quads.push(SolidVertex::new(SolidKind::Oval, shine, Vec2::splat(radius * 0.22), fill));
}

/// A soft outline around bodies that can be dragged.
fn ring(stage: &mut DrawStage, body: &FrameBody, pose: &Pose) {
    colored_ring(stage, body, pose, stage.frame.style().pen);
}

fn colored_ring(stage: &mut DrawStage, body: &FrameBody, pose: &Pose, color: Rgb) {
    let kind = if is_round(body) { SolidKind::RingOval } else { SolidKind::RingBox };
    let grown = pose.half + Vec2::splat(0.9);
    let quad = SolidVertex::new(kind, pose.center, grown, rgba(color, 0.75));
    let width = SolidVertex { edge: [0, 0, 0, 70], ..quad };
    stage.quads.push(width.rounded(corner(body, pose.half) + 0.9).soft(0.8));
}

fn is_round(body: &FrameBody) -> bool {
    matches!(body.shape, Shape::Circle { .. })
}

/// The corner radius of a body with this half extent.
fn corner(body: &FrameBody, half: Vec2) -> f32 {
    let least = half.x.min(half.y);
    match body.kind {
        Kind::Wall => 0.0,
        Kind::Platform => least.min(0.9),
        Kind::Hero => 0.52 * least,
        Kind::Block => 0.16 * least,
        _ => 0.6 * least,
    }
}
