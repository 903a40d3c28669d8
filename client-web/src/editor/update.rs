//! The one place where the editor changes: [`Editor::update`].

use super::edit::{self, apply};
use super::field;
use super::hand::Hand;
use super::history::History;
use super::number::DECIMALS_MAX;
use super::palette::{self, Make};
use super::state::Editor;
use super::strings;
use super::text::{PieceId, Sheet};
use jostle_sim::Vec2;
use jostle_sim::short_sort::sort_few;

/// Nudges with a shorter pause between them are one step of the history, milliseconds.
const NUDGE_MS: f64 = 700.0;
/// Steps of a nudge with Shift.
const NUDGE_FAR: f32 = 10.0;
/// Distance of a copy from its original on each axis, units.
const COPY_UNITS: f32 = 4.0;

/// Anything that is done to the editor.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// The text was changed by typing.
    Typed(String),
    /// A hand went down.
    Down(Hand),
    Moved(Hand),
    Up(Hand),
    /// It was taken away.
    Cancelled,
    /// A piece of the palette was taken by a hand.
    Taken(Make, i32),
    /// One is to be added here.
    Placed(Make, Vec2),
    /// The selection is to move.
    Nudged {
        way: Vec2,
        /// By ten units instead of one.
        far: bool,
    },
    /// The selection is copied.
    Duplicated,
    /// The selected body gets a path, or its path a point.
    PathExtended,
    /// The selection is removed.
    Deleted,
    /// The last step is taken back.
    Undone,
    /// It is done again.
    Redone,
    /// The next piece is selected.
    Next {
        /// The one before instead.
        back: bool,
    },
    /// Nothing is selected any more.
    Deselected,
    SelectedAll,
    /// A field gets this value, as TOML, or goes.
    FieldSet(String, Option<String>),
}

impl Editor {
    /// Handles what was done at a time.
    pub fn update(&mut self, now_ms: f64, deed: Deed) {
        if !matches!(deed, Deed::Nudged { .. }) {
            self.nudges = None;
        }
        // What is done by other means ends what a hand began.
        let held = self.is_held();
        if !matches!(deed, Deed::Down(_) | Deed::Moved(_) | Deed::Up(_)) {
            self.cancel();
        }
        match deed {
            Deed::Typed(text) => self.type_text(text, now_ms),
            Deed::Down(hand) => self.down(hand, now_ms),
            Deed::Moved(hand) => self.moved(hand),
            Deed::Up(hand) => self.up(hand, now_ms),
            Deed::Taken(make, id) => self.take(make, id),
            Deed::Placed(make, at) => {
                let at = self.on_unit(at);
                let added = palette::added(&self.text, make, at);
                self.adopt(added.map(|(text, id)| (text, vec![id])));
            }
            Deed::Nudged { way, far } => self.nudge(way, far, now_ms),
            Deed::Duplicated => self.duplicate(),
            Deed::PathExtended => self.extend_path(),
            Deed::Deleted => self.delete(),
            Deed::Undone => self.step(History::undo),
            Deed::Redone => self.step(History::redo),
            Deed::Next { back } => self.select_next(back),
            Deed::Cancelled => {}
            Deed::Deselected if held => {}
            Deed::Deselected => self.select(Vec::new()),
            Deed::SelectedAll => {
                let all = self.sheet.pieces.iter().filter(|piece| piece.place.is_some());
                self.select(all.map(|piece| piece.id).collect());
            }
            Deed::FieldSet(path, value) => {
                let splice = match value {
                    Some(value) => field::set(&self.text, &path, &value),
                    None => field::unset(&self.text, &path),
                };
                self.change(splice.into_iter().collect());
            }
        }
    }

    fn nudge(&mut self, way: Vec2, far: bool, now_ms: f64) {
        if !self.is_toml {
            return self.wait();
        }
        let by = way * self.unit() * if far { NUDGE_FAR } else { 1.0 };
        let decimals = DECIMALS_MAX;
        let moved = self.selected().flat_map(|piece| edit::moved(&self.text, piece, by, decimals));
        let text = apply(&self.text, moved.collect());
        if text == self.text {
            return;
        }
        let first = self.nudges.take().filter(|(_, last_ms)| now_ms - last_ms <= NUDGE_MS);
        let first = match first {
            Some((first, _)) => {
                self.history.note_again(&first, &text);
                self.text = text;
                self.reread();
                first
            }
            None => {
                let first = self.text.clone();
                self.commit(text);
                first
            }
        };
        // Back where they began, nudges are no step.
        self.nudges = (first != self.text).then_some((first, now_ms));
        self.select(self.selection.clone());
    }

    fn delete(&mut self) {
        if !self.is_toml {
            return self.wait();
        }
        let gone = self.selection.len();
        let splices = edit::removed(&self.text, self.selected());
        self.selection.clear();
        self.change(splices);
        self.said = strings::deleted(gone);
    }

    fn duplicate(&mut self) {
        if !self.is_toml {
            return self.wait();
        }
        let mut ids = self.selection.clone();
        sort_few(&mut ids, |one, other| one < other);
        ids.retain(|id| self.sheet.piece(*id).is_some_and(|piece| !piece.scattered));
        let splices = ids.iter().filter_map(|id| edit::copied(&self.text, self.sheet.piece(*id)?));
        let mut text = apply(&self.text, splices.collect());
        let before = |id: &PieceId| {
            ids.iter().filter(|other| other.list == id.list && other.index < id.index).count()
        };
        let copies: Vec<PieceId> =
            ids.iter().map(|id| PieceId { index: id.index + before(id) + 1, ..*id }).collect();
        for id in &copies {
            let Some(sheet) = Sheet::read(&text) else { return };
            let Some(piece) = sheet.piece(*id) else { return };
            let name = piece.name.as_ref().map(|name| {
                let base = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '-');
                palette::free_name(&text, if base.is_empty() { "copy" } else { base })
            });
            let by = Vec2::new(COPY_UNITS, COPY_UNITS) * self.unit();
            let mut splices = edit::moved(&text, piece, by, DECIMALS_MAX);
            let named = name.and_then(|name| {
                field::set(&text, &format!("{}.name", id.path()), &format!("\"{name}\""))
            });
            splices.extend(named);
            text = apply(&text, splices);
        }
        self.adopt(Some((text, copies)));
    }
}
