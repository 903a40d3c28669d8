//! [`Editor::update`], the only function that changes the editor.

use super::document::{Leg, path_of};
use super::drag::EditPointer;
use super::edit::{self, Splice, apply, item_bytes};
use super::field::{self, Spot};
use super::form;
use super::history::History;
use super::number::{DECIMALS_MAX, rounded};
use super::palette::{self, Make};
use super::references::{extend_rules, forget, free_name};
use super::state::Editor;
use super::strings;
use super::text::{List, Piece, PieceId, Place, ScenePieces, vector};
use jostle_sim::Vec2;
use jostle_sim::short_sort::sort_few;

/// Maximum pause between nudges that form one history step, milliseconds.
const NUDGE_MS: f64 = 700.0;
/// Distance of a nudge while Shift is held, steps.
const NUDGE_FAR: f32 = 10.0;
/// Half the length of a new path, in the world's snapping units.
const PATH_REACH: f32 = 30.0;
/// The period of a new path, seconds.
const PATH_PERIOD: &str = "4";

/// Offset between a copy and its original on each axis, units.
const COPY_UNITS: f32 = 4.0;

/// An event that the editor handles.
#[derive(Clone, Debug, PartialEq)]
pub enum EditorEvent {
    /// The text was changed by typing.
    Typed(String),
    /// A pointer was pressed.
    Down(EditPointer),
    Moved(EditPointer),
    Up(EditPointer),
    /// The gesture was cancelled.
    Cancelled,
    /// A pointer took a piece from the palette.
    Taken(Make, i32),
    /// A piece was added at this point.
    Placed(Make, Vec2),
    /// The selection was moved by a step.
    Nudged {
        way: Vec2,
        /// Whether it moves by ten units instead of one.
        far: bool,
    },
    /// The selection was duplicated.
    Duplicated,
    /// The selected body got a path, or its path got another point.
    PathExtended,
    /// The selection was deleted.
    Deleted,
    /// The last step was undone.
    Undone,
    /// The last undone step was redone.
    Redone,
    /// The next piece was selected.
    Next {
        /// Whether the previous piece was selected instead.
        back: bool,
    },
    /// The selection was cleared.
    Deselected,
    SelectedAll,
    /// The form changed the text to this one.
    Rewritten(String),
}

impl Editor {
    /// Handles an event at the given time.
    pub fn update(&mut self, now_ms: f64, deed: EditorEvent) {
        if !matches!(deed, EditorEvent::Nudged { .. }) {
            self.nudges = None;
        }
        // Anything but a pointer event cancels the current gesture.
        let held = self.is_held();
        if !matches!(deed, EditorEvent::Down(_) | EditorEvent::Moved(_) | EditorEvent::Up(_)) {
            self.cancel();
        }
        match deed {
            EditorEvent::Typed(text) => {
                self.doc.type_text(text, now_ms);
                self.prune();
            }
            EditorEvent::Down(hand) => self.down(hand, now_ms),
            EditorEvent::Moved(hand) => self.moved(hand),
            EditorEvent::Up(hand) => self.up(hand, now_ms),
            EditorEvent::Taken(make, id) => self.take(make, id),
            EditorEvent::Placed(make, at) => {
                let at = self.doc.on_unit(at);
                let added = palette::added(self.text(), make, at);
                self.adopt(added.map(|(text, id)| (text, vec![id])));
            }
            EditorEvent::Nudged { way, far } => self.nudge(way, far, now_ms),
            EditorEvent::Duplicated => self.duplicate(),
            EditorEvent::PathExtended => self.extend_path(),
            EditorEvent::Deleted => self.delete(),
            EditorEvent::Undone => self.step(History::undo),
            EditorEvent::Redone => self.step(History::redo),
            EditorEvent::Next { back } => self.select_next(back),
            EditorEvent::Cancelled => {}
            EditorEvent::Deselected if held => {}
            EditorEvent::Deselected => self.select(Vec::new()),
            EditorEvent::SelectedAll => {
                let all = self.doc.sheet.pieces.iter().filter(|piece| piece.place.is_some());
                self.select(all.map(|piece| piece.id).collect());
            }
            EditorEvent::Rewritten(text) => self.commit(text),
        }
    }

    fn nudge(&mut self, way: Vec2, far: bool, now_ms: f64) {
        if !self.doc.is_toml {
            return self.wait();
        }
        let by = way * self.doc.unit() * if far { NUDGE_FAR } else { 1.0 };
        let decimals = DECIMALS_MAX;
        let moved = self.selected().flat_map(|piece| edit::moved(self.text(), piece, by, decimals));
        let text = apply(self.text(), moved.collect());
        if text == self.text() {
            return;
        }
        let first = self.nudges.take().filter(|(_, last_ms)| now_ms - last_ms <= NUDGE_MS);
        let first = match first {
            Some((first, _)) => {
                self.doc.commit_again(&first, text);
                self.prune();
                first
            }
            None => {
                let first = self.text().to_owned();
                self.commit(text);
                first
            }
        };
        // Nudges that end where they started are not recorded as a step.
        self.nudges = (first != self.text()).then_some((first, now_ms));
        self.select(self.selection.clone());
    }

    fn delete(&mut self) {
        if !self.doc.is_toml {
            return self.wait();
        }
        let gone = self.selection.len();
        let splices = edit::removed(self.text(), self.selected());
        let names = self.selected().filter(|piece| !piece.scattered);
        let names: Vec<String> = names.filter_map(|piece| piece.name.clone()).collect();
        self.selection.clear();
        let text = apply(self.text(), splices);
        self.commit(names.iter().fold(text, |text, name| forget(text, name)));
        self.said = strings::deleted(gone);
    }

    fn duplicate(&mut self) {
        if !self.doc.is_toml {
            return self.wait();
        }
        let mut ids = self.selection.clone();
        sort_few(&mut ids, |one, other| one < other);
        ids.retain(|id| self.doc.sheet.piece(*id).is_some_and(|piece| !piece.scattered));
        let splices =
            ids.iter().filter_map(|id| edit::copied(self.text(), self.doc.sheet.piece(*id)?));
        let mut text = apply(self.text(), splices.collect());
        let before = |id: &PieceId| {
            ids.iter().filter(|other| other.list == id.list && other.index < id.index).count()
        };
        let copies: Vec<PieceId> =
            ids.iter().map(|id| PieceId { index: id.index + before(id) + 1, ..*id }).collect();
        for id in &copies {
            let Some(sheet) = ScenePieces::read(&text) else { return };
            let Some(piece) = sheet.piece(*id) else { return };
            let name = piece.name.as_ref().map(|name| {
                let base = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '-');
                free_name(&text, if base.is_empty() { "copy" } else { base })
            });
            let by = Vec2::new(COPY_UNITS, COPY_UNITS) * self.doc.unit();
            let mut splices = edit::moved(&text, piece, by, DECIMALS_MAX);
            let names = piece.name.clone().zip(name);
            let named = names.as_ref().and_then(|(_, name)| {
                field::set(&text, &format!("{}.name", id.path()), &format!("\"{name}\""))
            });
            splices.extend(named);
            text = apply(&text, splices);
            if let Some((old, name)) = names {
                text = extend_rules(text, &old, &name);
            }
        }
        self.adopt(Some((text, copies)));
    }

    /// Sets a field of the form to the values of its controls.
    pub fn set_field(&mut self, now_ms: f64, path: &str, values: &[String]) {
        let text = form::changed(self, path, values);
        text.into_iter().for_each(|text| self.update(now_ms, EditorEvent::Rewritten(text)));
    }

    /// The selected body, if it is the only selected piece and may have a path.
    fn path_body(&self) -> Option<&Piece> {
        let [id] = self.selection[..] else { return None };
        let piece =
            self.doc.sheet.piece(id).filter(|piece| piece.stuck.is_none() && self.doc.is_toml)?;
        let has_place = matches!(piece.place, Some(Place::Center(_) | Place::Path(_)));
        (id.list == List::Bodies && has_place).then_some(piece)
    }

    /// The label of the button that creates a path or adds a point to it.
    pub fn path_offer(&self) -> Option<&'static str> {
        let piece = self.path_body()?;
        Some(if path_of(piece).is_empty() { strings::ADD_PATH } else { strings::ADD_POINT })
    }

    /// Gives the selected body a path, or adds a point in the middle of the longest leg.
    pub(super) fn extend_path(&mut self) {
        let Some(piece) = self.path_body() else { return };
        let points: Vec<Vec2> = path_of(piece).iter().map(vector).collect();
        let length = |leg: usize| (points[leg + 1] - points[leg]).length();
        let legs = 0..points.len().saturating_sub(1);
        match legs.max_by(|a, b| length(*a).total_cmp(&length(*b))) {
            Some(leg) => {
                let middle = self.doc.on_unit((points[leg] + points[leg + 1]) * 0.5);
                self.add_point((piece.id, leg), middle);
            }
            None => {
                if let Some(text) = with_path(self.text(), piece, PATH_REACH * self.doc.unit()) {
                    self.commit(text);
                }
            }
        }
    }

    /// Adds a point within a leg.
    pub(super) fn add_point(&mut self, (id, leg): Leg, at: Vec2) {
        let point = format!("{}.path[{leg}]", id.path());
        let Some(Spot::There { value, .. }) = field::find(self.text(), &point) else { return };
        let [x, y] = at.to_array().map(|part| rounded(part, DECIMALS_MAX - 1));
        self.change(vec![Splice::insert(value.end, format!(", [{x}, {y}]"))]);
    }

    /// Removes a point from the selected body's path. At least two points remain.
    pub(super) fn remove_point(&mut self, index: usize) {
        let piece = self.path_body().filter(|piece| path_of(piece).len() > 2);
        let Some(piece) = piece else { return };
        let point = format!("{}.path[{index}]", piece.id.path());
        let Some(Spot::There { value, .. }) = field::find(self.text(), &point) else { return };
        self.change(vec![Splice::remove(item_bytes(self.text(), &value))]);
    }
}

/// The text in which a body moves back and forth around its old position. Fields that the path determines are removed.
fn with_path(text: &str, piece: &Piece, reach: f32) -> Option<String> {
    let Some(Place::Center([x, y])) = &piece.place else { return None };
    let id = piece.id.path();
    let Spot::There { value, .. } = field::find(text, &format!("{id}.position"))? else {
        return None;
    };
    let key = text[..value.start].rfind("position")?;
    let [low, high] = [-reach, reach].map(|by| rounded(x.value + by, DECIMALS_MAX - 1));
    let y = &text[y.at.clone()];
    let splices = vec![
        Splice { at: key..key + "position".len(), with: "path".to_owned() },
        Splice { at: value, with: format!("[[{low}, {y}], [{high}, {y}]]") },
    ];
    let mut text = apply(text, splices);
    for decided in ["velocity", "motion"] {
        if let Some(splice) = field::unset(&text, &format!("{id}.{decided}")) {
            text = apply(&text, vec![splice]);
        }
    }
    let period = field::set(&text, &format!("{id}.period"), PATH_PERIOD)?;
    Some(apply(&text, vec![period]))
}
