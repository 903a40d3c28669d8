//! The state of the editor: a scene's text, the selection, and the current gesture.

use super::document::{FILE, SceneDocument};
use super::drag::{DragTarget, EditGesture, EditPointer};
use super::edit::{Splice, apply};
use super::history::History;
use super::snap::{Extents, Guides, Snapping};
use super::strings;
use super::text::{Piece, PieceId, ScenePieces};
use crate::language::say;
use jostle_sim::Vec2;
use std::ops::Range;

/// An editor for one text.
pub struct Editor {
    pub doc: SceneDocument,
    /// A number that distinguishes this editor from those that were open before.
    pub number: u32,
    pub selection: Vec<PieceId>,
    pub(super) gesture: Option<EditGesture>,
    /// The lines to which the dragged piece is currently aligned.
    pub guides: Guides,
    /// The announcement for screen readers.
    pub said: String,
    /// The text before a series of nudges, and the time of the last nudge.
    pub(super) nudges: Option<(String, f64)>,
    /// Time and position of a press without a move.
    pub(super) tap: Option<(f64, Vec2)>,
}

impl Editor {
    /// Creates an editor for a text. `file` is the file's name, if it has one.
    pub fn open(text: String, file: Option<&str>) -> Editor {
        Editor {
            doc: SceneDocument::open(text, file.unwrap_or(FILE)),
            number: 0,
            selection: Vec::new(),
            gesture: None,
            guides: Guides::default(),
            said: String::new(),
            nudges: None,
            tap: None,
        }
    }

    pub fn text(&self) -> &str {
        self.doc.text()
    }

    /// The version of the text, which no other text has: the numbers of this editor and of its revision.
    pub fn version(&self) -> (u32, u32) {
        (self.number, self.doc.revision)
    }

    /// Whether undo and redo are possible, in this order.
    pub fn can(&self) -> [bool; 2] {
        self.doc.can()
    }

    /// Whether a gesture is in progress.
    pub fn is_held(&self) -> bool {
        self.gesture.is_some()
    }

    /// Whether a gesture that holds neither a piece nor a handle is in progress.
    pub fn holds_nothing(&self) -> bool {
        self.gesture.as_ref().is_some_and(|gesture| gesture.grip == DragTarget::Box)
    }

    /// Replaces the text as one history step.
    pub fn replace(&mut self, text: String, file: Option<&str>) {
        self.cancel();
        self.nudges = None;
        self.doc.rename(file.unwrap_or(FILE));
        self.selection.clear();
        self.doc.commit(text);
    }

    /// Replaces the text as one history step.
    pub(super) fn commit(&mut self, text: String) {
        self.doc.commit(text);
        self.prune();
    }

    /// Deselects pieces that no longer exist.
    pub(super) fn prune(&mut self) {
        let sheet = &self.doc.sheet;
        self.selection.retain(|id| sheet.piece(*id).is_some());
    }

    pub(super) fn change(&mut self, splices: Vec<Splice>) {
        self.commit(apply(self.text(), splices));
    }

    /// Commits a text with new pieces and selects them.
    pub(super) fn adopt(&mut self, made: Option<(String, Vec<PieceId>)>) {
        let Some((text, ids)) = made else { return self.wait() };
        self.commit(text);
        self.select(ids);
    }

    pub(super) fn wait(&mut self) {
        self.said = say(strings::BROKEN).to_owned();
    }

    /// Shows a text during a gesture.
    pub(super) fn show(&mut self, text: String) {
        self.doc.show(text);
        self.prune();
    }

    pub(super) fn step(&mut self, step: fn(&mut History, &mut String) -> Option<Range<usize>>) {
        let Some(changed) = self.doc.step(step) else { return };
        let touched = |piece: &&Piece| {
            piece.bytes.start < changed.end.max(changed.start + 1)
                && changed.start < piece.bytes.end
        };
        let touched = self.doc.sheet.pieces.iter().filter(touched).map(|piece| piece.id);
        self.selection = touched.collect();
    }

    pub fn selected(&self) -> impl Iterator<Item = &Piece> {
        self.selection.iter().filter_map(|id| self.doc.sheet.piece(*id))
    }

    pub(super) fn select(&mut self, ids: Vec<PieceId>) {
        self.selection = ids;
        self.said = match &self.selection[..] {
            [] => String::new(),
            [id] => {
                self.doc.sheet.piece(*id).map(|piece| self.doc.name_of(piece)).unwrap_or_default()
            }
            many => strings::pieces(many.len()),
        };
    }

    pub(super) fn select_next(&mut self, back: bool) {
        let ids: Vec<PieceId> = self.doc.sheet.pieces.iter().map(|piece| piece.id).collect();
        if ids.is_empty() {
            return;
        }
        let last = self.selection.last().and_then(|id| ids.iter().position(|known| known == id));
        let next = match (last, back) {
            (None, false) => 0,
            (None, true) => ids.len() - 1,
            (Some(at), false) => (at + 1) % ids.len(),
            (Some(at), true) => (at + ids.len() - 1) % ids.len(),
        };
        self.select(vec![ids[next]]);
    }

    /// Snapping to everything except the selection.
    pub(super) fn snapping(&self, sheet: &ScenePieces, hand: &EditPointer) -> Snapping {
        if hand.free {
            return Snapping::off();
        }
        let others = sheet.pieces.iter().filter(|piece| !self.selection.contains(&piece.id));
        let mut others: Vec<Extents> = others.filter_map(|piece| self.doc.extents(piece)).collect();
        others.push(Extents { low: Vec2::ZERO, high: self.doc.world() });
        Snapping { unit: self.doc.unit(), reach: hand.reach * 0.5, others }
    }
}
