//! Pointer gestures in the picture: selecting, moving, resizing and dropping pieces. A gesture remembers the text from
//! when it began, and every move derives the new text from that.

use super::document::{SceneDocument, path_of};
use super::drag::{DragTarget, EditGesture, EditPointer};
use super::edit::{self, Splice, apply};
use super::number::{DECIMALS_MAX, decimals_of};
use super::palette::{self, Make};
use super::snap::{Extents, Guides};
use super::state::Editor;
use super::text::{Extent, List, Piece, PieceId, Place, ScenePieces, vector};
use super::{field, number};
use jostle_sim::{Shape, Vec2};

/// Maximum time between the two presses of a double press, milliseconds.
const DOUBLE_MS: f64 = 400.0;
/// Fraction of the pointer's reach within which the pointer counts as stationary.
const STILL: f32 = 0.25;
/// Distance between handles and the edge of a piece, CSS pixels.
const GRIP_CSS: f32 = 8.0;
/// Edges with less than this half length have no handle, CSS pixels.
const EDGE_CSS: f32 = 24.0;

impl Editor {
    pub(super) fn down(&mut self, hand: EditPointer, now_ms: f64) {
        if let Some(gesture) = &mut self.gesture {
            gesture.free = gesture.id != hand.id;
            return;
        }
        let is_again = |(then_ms, at): &(f64, Vec2)| {
            now_ms - then_ms <= DOUBLE_MS && (*at - hand.at).length() <= hand.reach
        };
        let is_double = self.tap.take().as_ref().is_some_and(is_again);
        let leg = self.doc.leg_at(hand.at, hand.reach);
        let grip = match (self.grip_at(&hand), leg) {
            (Some(DragTarget::Point(index)), _) if is_double => return self.remove_point(index),
            (Some(grip), _) => grip,
            (None, Some((id, leg))) if is_double && self.selection == [id] => {
                self.add_point((id, leg), self.doc.on_unit(hand.at));
                DragTarget::Point(leg + 1)
            }
            _ => match self.doc.piece_at(hand.at, hand.reach).or(leg.map(|(id, _)| id)) {
                Some(id) => {
                    self.pick(id, hand.adds);
                    DragTarget::Move
                }
                None => {
                    if !hand.adds {
                        self.select(Vec::new());
                    }
                    DragTarget::Box
                }
            },
        };
        self.begin(grip, hand.id, hand.at);
    }

    fn begin(&mut self, grip: DragTarget, id: i32, from: Vec2) {
        self.gesture = Some(EditGesture {
            id,
            grip,
            from,
            at: from,
            base: self.text().to_owned(),
            sheet: self.doc.sheet.clone(),
            selection: self.selection.clone(),
            moving: false,
            free: false,
        });
    }

    pub(super) fn take(&mut self, make: Make, id: i32) {
        self.cancel();
        self.begin(DragTarget::New(make), id, Vec2::ZERO);
    }

    /// The piece of the palette that a pointer holds, if the pointer has not been over the picture since.
    pub fn pressed_piece(&self, pointer: i32) -> Option<Make> {
        let gesture = self.gesture.as_ref().filter(|gesture| gesture.id == pointer)?;
        match gesture.grip {
            DragTarget::New(make) if !gesture.moving => Some(make),
            _ => None,
        }
    }

    fn pick(&mut self, id: PieceId, adds: bool) {
        let mut ids = self.selection.clone();
        match (ids.iter().position(|known| *known == id), adds) {
            (Some(at), true) => _ = ids.remove(at),
            (None, true) => ids.push(id),
            (Some(_), false) => return,
            (None, false) => ids = vec![id],
        }
        self.select(ids);
    }

    /// The handle of the selected piece that is within reach.
    fn grip_at(&self, hand: &EditPointer) -> Option<DragTarget> {
        let [id] = self.selection[..] else { return None };
        let piece = self.doc.sheet.piece(id).filter(|piece| piece.place.is_some())?;
        let away = |at: Vec2| (at - hand.at).abs().max_element();
        // The inner part of a small piece is reserved for moving it.
        let extents = self.doc.extents(piece)?;
        let deep = (hand.at - extents.center()).abs().cmplt((extents.high - extents.low) * 0.3);
        let is_on_path = |grip: &DragTarget| matches!(grip, DragTarget::Point(_));
        let near = grips(&self.doc, piece, hand.step).into_iter();
        let near = near.filter(|(_, at)| away(*at) <= hand.reach);
        let near = near.filter(|(grip, _)| !deep.all() || is_on_path(grip));
        near.min_by(|a, b| away(a.1).total_cmp(&away(b.1))).map(|(grip, _)| grip)
    }

    pub(super) fn moved(&mut self, mut hand: EditPointer) {
        let Some(mut gesture) = self.gesture.take_if(|gesture| gesture.id == hand.id) else {
            return;
        };
        gesture.at = hand.at;
        gesture.moving |= match gesture.grip {
            DragTarget::New(_) => hand.inside,
            _ => (hand.at - gesture.from).length() > STILL * hand.reach,
        };
        hand.free |= gesture.free;
        if gesture.moving {
            self.drag(&gesture, &hand);
        }
        self.gesture = Some(gesture);
    }

    fn drag(&mut self, gesture: &EditGesture, hand: &EditPointer) {
        self.guides = Guides::default();
        let splices = match gesture.grip {
            DragTarget::Box => return self.select_within(gesture),
            DragTarget::New(make) => return self.carry(gesture, make, hand),
            // Pieces cannot be moved until the text is valid TOML again.
            _ if !self.doc.is_toml => return,
            DragTarget::Move => self.move_selection(gesture, hand),
            DragTarget::Size(way) => self.size_selected(gesture, way, hand),
            DragTarget::Point(index) => self.move_point(gesture, index, hand),
        };
        self.show(apply(&gesture.base, splices));
    }

    fn select_within(&mut self, gesture: &EditGesture) {
        let Some([low, high]) = gesture.frame() else { return };
        let mut ids = gesture.selection.clone();
        for piece in &self.doc.sheet.pieces {
            let inside =
                piece.center().is_some_and(|at| at.cmpge(low).all() && at.cmple(high).all());
            if inside && !ids.contains(&piece.id) {
                ids.push(piece.id);
            }
        }
        if ids != self.selection {
            self.select(ids);
        }
    }

    /// While the pointer is over the picture, the new piece follows it.
    fn carry(&mut self, gesture: &EditGesture, make: Make, hand: &EditPointer) {
        self.selection.clear();
        if !hand.inside {
            return self.show(gesture.base.clone());
        }
        let Some((text, id)) = palette::added(&gesture.base, make, hand.at) else { return };
        // Snapping needs the size of the new piece.
        let Some(sheet) = ScenePieces::read(&text) else { return };
        self.selection = vec![id];
        let snapping = self.snapping(&sheet, hand);
        let way = sheet.piece(id).and_then(|piece| {
            let extents = self.doc.extents(piece)?;
            Some(snapping.moved(extents, anchor(piece)?, Vec2::ZERO))
        });
        let (way, guides) = way.unwrap_or_default();
        self.guides = guides;
        if let Some((text, id)) = palette::added(&gesture.base, make, hand.at + way) {
            self.show(text);
            self.selection = vec![id];
        }
    }

    fn move_selection(&mut self, gesture: &EditGesture, hand: &EditPointer) -> Vec<Splice> {
        let pieces: Vec<&Piece> =
            self.selection.iter().filter_map(|id| gesture.sheet.piece(*id)).collect();
        let rects: Vec<Extents> =
            pieces.iter().filter_map(|piece| self.doc.extents(piece)).collect();
        let (Some(first), Some(anchor)) =
            (rects.first(), pieces.iter().find_map(|piece| anchor(piece)))
        else {
            return Vec::new();
        };
        let around = rects.iter().fold(*first, |all, one| Extents {
            low: all.low.min(one.low),
            high: all.high.max(one.high),
        });
        let snapping = self.snapping(&gesture.sheet, hand);
        let (by, guides) = snapping.moved(around, anchor, hand.at - gesture.from);
        let decimals = decimals(hand);
        let moved = pieces.iter().flat_map(|piece| edit::moved(&gesture.base, piece, by, decimals));
        let splices = moved.collect();
        self.guides = guides;
        splices
    }

    fn move_point(
        &mut self,
        gesture: &EditGesture,
        index: usize,
        hand: &EditPointer,
    ) -> Vec<Splice> {
        let piece = self.selection.first().and_then(|id| gesture.sheet.piece(*id));
        let Some(Place::Path(points)) = piece.and_then(|piece| piece.place.as_ref()) else {
            return Vec::new();
        };
        let Some(point) = points.get(index) else { return Vec::new() };
        let snapping = self.snapping(&gesture.sheet, hand);
        let goal = vector(point) + hand.at - gesture.from;
        let (x, upright) = snapping.line(0, goal.x);
        let (y, level) = snapping.line(1, goal.y);
        let splices = edit::set_point(&gesture.base, point, Vec2::new(x, y), decimals(hand));
        self.guides = [upright, level];
        splices
    }

    /// Moves an edge or corner, while the opposite one stays in place.
    fn size_selected(
        &mut self,
        gesture: &EditGesture,
        way: Vec2,
        hand: &EditPointer,
    ) -> Vec<Splice> {
        let piece = self.selection.first().and_then(|id| gesture.sheet.piece(*id));
        let Some(piece) = piece else { return Vec::new() };
        let Some(Extents { mut low, mut high }) = self.doc.extents(piece) else {
            return Vec::new();
        };
        let snapping = self.snapping(&gesture.sheet, hand);
        let by = hand.at - gesture.from;
        let least = self.doc.unit().min(hand.step.max(1e-3));
        if let Some(Shape::Circle { .. }) = self.doc.shape(piece) {
            return self.size_circle(gesture, piece, way, hand);
        }
        for axis in 0..2 {
            let side = way[axis];
            if side == 0.0 {
                continue;
            }
            let edge = if side > 0.0 { &mut high } else { &mut low };
            let (at, guide) = snapping.line(axis, edge[axis] + by[axis]);
            edge[axis] = at;
            self.guides[axis] = guide;
        }
        // An edge cannot be moved past the opposite one.
        let size = (high - low).max(Vec2::splat(least));
        let low = Vec2::select(way.cmplt(Vec2::ZERO), high - size, low);
        let decimals = decimals(hand);
        if let Some(Place::Area([from, to])) = &piece.place {
            let mut splices = edit::set_point(&gesture.base, from, low, decimals);
            splices.extend(edit::set_point(&gesture.base, to, low + size, decimals));
            return splices;
        }
        let mut splices = match &piece.extent {
            Extent::Unsaid => {
                let text = [size.x, size.y].map(|side| number::rounded(side, decimals));
                let field_path = format!("{}.size", piece.id.path());
                let value = format!("[{}, {}]", text[0], text[1]);
                field::set(&gesture.base, &field_path, &value).into_iter().collect()
            }
            _ => edit::sized(&gesture.base, piece, size, decimals),
        };
        if let Some(Place::Center(center)) = &piece.place {
            splices.extend(edit::set_point(&gesture.base, center, low + size * 0.5, decimals));
        }
        splices
    }

    fn size_circle(
        &mut self,
        gesture: &EditGesture,
        piece: &Piece,
        way: Vec2,
        hand: &EditPointer,
    ) -> Vec<Splice> {
        let Some(Extents { low, high }) = self.doc.extents(piece) else { return Vec::new() };
        let center = (low + high) * 0.5;
        let edge = center + (high - low) * 0.5 * way + hand.at - gesture.from;
        let away = (edge - center).abs();
        let radius = if way.x == 0.0 {
            away.y
        } else if way.y == 0.0 {
            away.x
        } else {
            away.max_element()
        };
        let snapping = self.snapping(&gesture.sheet, hand);
        let radius = snapping.on_unit(radius * 2.0) * 0.5;
        let radius = radius.max(0.5 * self.doc.unit().min(hand.step.max(1e-3)));
        let decimals = decimals(hand);
        if let Extent::Radius(old) = &piece.extent {
            return edit::set_number(&gesture.base, old, radius, decimals).into_iter().collect();
        }
        let path = format!("{}.radius", piece.id.path());
        let value = number::rounded(radius, decimals);
        field::set(&gesture.base, &path, &value).into_iter().collect()
    }

    pub(super) fn up(&mut self, hand: EditPointer, now_ms: f64) {
        match &mut self.gesture {
            Some(gesture) if gesture.id != hand.id => return gesture.free = false,
            None => return,
            Some(_) => {}
        }
        let Some(gesture) = self.gesture.take() else { return };
        self.guides = Guides::default();
        self.tap = (!gesture.moving).then_some((now_ms, hand.at));
        match gesture.grip {
            DragTarget::Move if !gesture.moving && !hand.adds => {
                // Pressing one of several selected pieces without moving selects only that piece.
                if let Some(id) = self.doc.piece_at(hand.at, hand.reach) {
                    self.select(vec![id]);
                }
            }
            _ => {
                self.doc.note(&gesture.base);
                if gesture.moving && gesture.grip != DragTarget::Box {
                    self.select(self.selection.clone());
                }
            }
        }
    }

    /// Cancels a gesture and restores the state from before it.
    pub(super) fn cancel(&mut self) {
        let Some(gesture) = self.gesture.take() else { return };
        self.guides = Guides::default();
        self.show(gesture.base);
        self.selection = gesture.selection;
    }
}

/// The number of decimals for values set with the pointer.
fn decimals(hand: &EditPointer) -> u32 {
    if hand.free { decimals_of(hand.step) } else { DECIMALS_MAX - 1 }
}

/// The point of a piece that snaps to the unit.
fn anchor(piece: &Piece) -> Option<Vec2> {
    match piece.place.as_ref()? {
        Place::Center(point) => Some(vector(point)),
        Place::Area([low, _]) => Some(vector(low)),
        Place::Path(points) => points.first().map(vector),
    }
}

/// The handles of a piece and their positions. `pixel` is the width of a CSS pixel in world units.
pub(super) fn grips(doc: &SceneDocument, piece: &Piece, pixel: f32) -> Vec<(DragTarget, Vec2)> {
    let points = path_of(piece).iter().enumerate();
    let mut grips: Vec<_> =
        points.map(|(at, point)| (DragTarget::Point(at), vector(point))).collect();
    let is_point = matches!(piece.id.list, List::Spawns | List::Emitters | List::Launchers);
    if piece.stuck.is_some() || is_point {
        return grips;
    }
    let Some(extents) = doc.extents(piece) else { return grips };
    let half = (extents.high - extents.low) * 0.5;
    let away = half + Vec2::splat(GRIP_CSS * pixel);
    for (x, y) in [(-1, -1), (1, -1), (-1, 1), (1, 1), (0, -1), (0, 1), (-1, 0), (1, 0)] {
        // A handle in the middle of a short edge would overlap those at the ends.
        let along = if x == 0 { half.x } else { half.y };
        if (x == 0 || y == 0) && along < EDGE_CSS * pixel {
            continue;
        }
        let way = Vec2::new(x as f32, y as f32);
        grips.push((DragTarget::Size(way), extents.center() + away * way));
    }
    grips
}
