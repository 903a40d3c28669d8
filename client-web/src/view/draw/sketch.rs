//! The editor's overlay: a grid below the scene; outlines, handles and signs above it.

use super::stage::DrawStage;
use super::vertex::{SolidKind, SolidVertex, rgba};
use crate::view::frame::{Sketch, Stroke, Tone};
use crate::view::palette::{self, EMBER, INK, PAPER, SLATE};
use jostle_sim::{Shape, Vec2};

/// Maximum number of grid lines on each axis; a finer grid is not drawn.
const LINES_MAX: f32 = 400.0;
/// Every fifth line is brighter.
const BRIGHT_EVERY: i32 = 5;
/// Half the width of a handle, CSS pixels.
const HANDLE_CSS: f32 = 5.0;
/// Half the width of a sign, CSS pixels.
const SIGN_CSS: f32 = 11.0;

pub fn fill_under(stage: &mut DrawStage) {
    let Some(sketch) = stage.frame.sketch else { return };
    let size = stage.frame.world_size;
    for axis in 0..2 {
        let (length, across) = (size[axis], size[1 - axis]);
        if sketch.grid <= 0.0 || length > LINES_MAX * sketch.grid {
            continue;
        }
        for number in 0..=(length / sketch.grid) as i32 {
            let at = number as f32 * sketch.grid;
            let mut ends = [Vec2::ZERO; 2];
            ends[0][axis] = at;
            ends[1][axis] = at;
            ends[1][1 - axis] = across;
            let alpha = if number % BRIGHT_EVERY == 0 { 0.30 } else { 0.12 };
            stage.line(ends[0], ends[1], 0.5 * sketch.pixel, rgba(SLATE[3], alpha));
        }
    }
}

pub fn fill_over(stage: &mut DrawStage) {
    let Some(sketch) = stage.frame.sketch else { return };
    for stroke in &sketch.strokes {
        match *stroke {
            Stroke::Outline { shape, center, tone } => outline(stage, sketch, shape, center, tone),
            Stroke::Line([from, to], tone) => {
                let width = if tone == Tone::Chosen { 1.0 } else { 0.6 };
                stage.line(from, to, width * sketch.pixel, color(tone));
            }
            Stroke::Handle { at, round } => handle(stage, sketch, at, round),
            Stroke::Flame(at) => flame(stage, sketch, at),
            Stroke::Target(at) => target(stage, sketch, at),
            Stroke::Spawn(at, half) => spawn(stage, sketch, at, half),
        }
    }
}

fn color(tone: Tone) -> [u8; 4] {
    match tone {
        Tone::Quiet => rgba(PAPER[1], 0.55),
        Tone::Chosen => rgba(PAPER[0], 0.95),
        Tone::Guide => rgba(palette::player(6), 0.9),
    }
}

fn outline(stage: &mut DrawStage, sketch: &Sketch, shape: Shape, center: Vec2, tone: Tone) {
    let (fill, ring) = match shape {
        Shape::Box { .. } => (SolidKind::Box, SolidKind::RingBox),
        Shape::Circle { .. } => (SolidKind::Oval, SolidKind::RingOval),
    };
    let half = shape.half_extent();
    if tone == Tone::Chosen {
        stage.quads.push(SolidVertex::new(fill, center, half, rgba(PAPER[0], 0.08)));
    }
    let width = if tone == Tone::Quiet { 1.2 } else { 2.0 } * sketch.pixel;
    let around = half + Vec2::splat(0.5 * width);
    let ring = SolidVertex::new(ring, center, around, color(tone));
    stage.quads.push(ring.soft(width).edged([255; 4]));
}

fn handle(stage: &mut DrawStage, sketch: &Sketch, at: Vec2, round: bool) {
    let kind = if round { SolidKind::Oval } else { SolidKind::Box };
    let (outer, inner) = (HANDLE_CSS * sketch.pixel, (HANDLE_CSS - 1.5) * sketch.pixel);
    let corner = if round { 0.0 } else { 2.0 * sketch.pixel };
    let quad =
        |half: f32, fill| SolidVertex::new(kind, at, Vec2::splat(half), fill).rounded(corner);
    stage.quads.push(quad(outer, rgba(INK[0], 0.9)));
    stage.quads.push(quad(inner, rgba(PAPER[0], 1.0)));
}

/// A dark disc that makes a sign visible on any background.
fn plate(stage: &mut DrawStage, sketch: &Sketch, at: Vec2) {
    let half = Vec2::splat(SIGN_CSS * sketch.pixel);
    stage.quads.push(SolidVertex::new(SolidKind::Oval, at, half, rgba(INK[1], 0.85)));
    let width = 1.5 * sketch.pixel;
    let ring = SolidVertex::new(SolidKind::RingOval, at, half, color(Tone::Quiet));
    stage.quads.push(ring.soft(width).edged([255; 4]));
}

fn flame(stage: &mut DrawStage, sketch: &Sketch, at: Vec2) {
    plate(stage, sketch, at);
    let pixel = sketch.pixel;
    for (up, half, fill) in [(-1.0, 5.0, EMBER[2]), (-2.0, 3.4, EMBER[1]), (-3.0, 1.8, EMBER[0])] {
        let center = at + Vec2::new(0.0, up * pixel);
        let quad = SolidVertex::new(
            SolidKind::Drop,
            center,
            Vec2::new(half * 1.5, half) * pixel,
            rgba(fill, 1.0),
        );
        stage.quads.push(quad.turned(Vec2::new(0.0, -1.0)));
    }
}

fn target(stage: &mut DrawStage, sketch: &Sketch, at: Vec2) {
    plate(stage, sketch, at);
    let (pixel, fill) = (sketch.pixel, rgba(palette::player(6), 1.0));
    for way in [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y] {
        stage.line(at + way * (3.0 * pixel), at + way * (7.0 * pixel), 0.9 * pixel, fill);
    }
    let half = Vec2::splat(1.8 * pixel);
    stage.quads.push(SolidVertex::new(SolidKind::Oval, at, half, fill));
}

/// A spawn point, drawn as a translucent hero.
fn spawn(stage: &mut DrawStage, sketch: &Sketch, at: Vec2, half: Vec2) {
    let least = half.min_element();
    let own = palette::player(1);
    let body = SolidVertex::new(SolidKind::Box, at, half, rgba(own, 0.22));
    stage.quads.push(body.rounded(0.4 * least));
    let ring = SolidVertex::new(SolidKind::RingBox, at, half, rgba(own, 0.85));
    let width = 1.5 * sketch.pixel;
    stage.quads.push(ring.rounded(0.4 * least).soft(width).edged([255; 4]));
    for side in [-0.4, 0.4] {
        let eye = at + Vec2::new(side * half.x, 0.25 * half.y);
        let size = Vec2::new(0.17, 0.24) * least;
        stage.quads.push(SolidVertex::new(SolidKind::Oval, eye, size, rgba(PAPER[0], 0.9)));
    }
}
