//! The editor's drawing above and below the scene.

use super::document::{SceneDocument, path_of};
use super::drag::DragTarget;
use super::gesture::grips;
use super::snap::Extents;
use super::state::Editor;
use super::text::{List, Piece, vector};
use crate::view::frame::{Sketch, Stroke, Tone};
use jostle_sim::{Shape, Vec2};

/// Minimum distance between grid lines, CSS pixels.
const GRID_CSS: f32 = 9.0;
/// Half the size assumed for a hero whose size is unknown, world units.
const HERO_HALF: Vec2 = Vec2::new(8.0, 11.0);

/// Draws the editor's overlay. `pixel` is the width of a CSS pixel in world units.
pub fn draw(editor: &Editor, pixel: f32, sketch: &mut Sketch) {
    let doc = &editor.doc;
    sketch.pixel = pixel;
    sketch.grid = grid(doc.unit(), pixel);
    sketch.strokes.clear();
    for piece in &doc.sheet.pieces {
        draw_piece(doc, piece, &mut sketch.strokes);
    }
    let is_alone = editor.selection.len() == 1;
    for piece in editor.selected() {
        mark(doc, piece, is_alone, pixel, &mut sketch.strokes);
    }
    let world = doc.world();
    for (axis, at) in editor.guides.iter().enumerate() {
        let Some(at) = *at else { continue };
        let mut ends = [Vec2::splat(at); 2];
        ends[0][1 - axis] = 0.0;
        ends[1][1 - axis] = world[1 - axis];
        sketch.strokes.push(Stroke::Line(ends, Tone::Guide));
    }
    if let Some([low, high]) = editor.gesture.as_ref().and_then(|gesture| gesture.frame()) {
        let size = high - low;
        let (shape, center) = (Shape::rect(size.x, size.y), (low + high) * 0.5);
        sketch.strokes.push(Stroke::Outline { shape, center, tone: Tone::Chosen });
    }
}

/// Draws the parts of a piece that the game does not show.
fn draw_piece(doc: &SceneDocument, piece: &Piece, strokes: &mut Vec<Stroke>) {
    let Some(center) = piece.center() else { return };
    match piece.id.list {
        List::Spawns => {
            let half = doc.shape(piece).map_or(HERO_HALF, |shape| shape.half_extent());
            strokes.push(Stroke::Spawn(center, half));
        }
        List::Emitters => strokes.push(Stroke::Flame(center)),
        List::Launchers => strokes.push(Stroke::Target(center)),
        List::Zones | List::Layouts => {
            if let Some(shape) = doc.shape(piece) {
                strokes.push(Stroke::Outline { shape, center, tone: Tone::Quiet });
            }
        }
        List::Bodies => {
            let points = path_of(piece);
            let legs = points.windows(2);
            let ends = |leg: &[_; 2]| [vector(&leg[0]), vector(&leg[1])];
            for leg in legs.filter_map(|leg| leg.first_chunk()) {
                strokes.push(Stroke::Line(ends(leg), Tone::Quiet));
            }
            // The picture shows the last valid scene; an invalid text may contain bodies that are missing there or
            // positioned elsewhere.
            if let Some(shape) = doc.shape(piece).filter(|shape| !doc.is_shown(piece, *shape)) {
                strokes.push(Stroke::Outline { shape, center, tone: Tone::Quiet });
            }
        }
    }
}

fn mark(doc: &SceneDocument, piece: &Piece, is_alone: bool, pixel: f32, strokes: &mut Vec<Stroke>) {
    let Some(Extents { low, high }) = doc.extents(piece) else { return };
    let (center, least) = ((low + high) * 0.5, 2.0 * pixel * SIGN_CSS);
    let is_sign = matches!(piece.id.list, List::Emitters | List::Launchers);
    let shape = match doc.shape(piece) {
        Some(shape) => shape,
        None if is_sign => Shape::circle(0.5 * least),
        None => Shape::rect(least, least),
    };
    strokes.push(Stroke::Outline { shape, center, tone: Tone::Chosen });
    if !is_alone {
        return;
    }
    for leg in path_of(piece).windows(2) {
        strokes.push(Stroke::Line([vector(&leg[0]), vector(&leg[1])], Tone::Chosen));
    }
    for (grip, at) in grips(doc, piece, pixel) {
        strokes.push(Stroke::Handle { at, round: matches!(grip, DragTarget::Point(_)) });
    }
}

/// Half the width of a sign plus a margin, CSS pixels.
const SIGN_CSS: f32 = 13.0;

/// The spacing of the finest grid (1, 5, 10, 50 and so on times the unit) whose lines are far enough apart.
fn grid(unit: f32, pixel: f32) -> f32 {
    let mut step = unit;
    for factor in [5.0, 2.0].into_iter().cycle().take(24) {
        if step >= GRID_CSS * pixel {
            return step;
        }
        step *= factor;
    }
    0.0
}
