//! The state of the editor: a text, what is found in it, and what is selected.

use super::edit::{Splice, apply};
use super::field::{self, Spot};
use super::hand::{EditGesture, Grip, Hand};
use super::history::History;
use super::number::{DECIMALS_MAX, decimals_of, rounded};
use super::snap::{Extents, Guides, Snapping, unit_of};
use super::strings;
use super::text::{List, Piece, PieceId, Place, Point, Sheet};
use crate::language::{fill, say};
use jostle_game::Scene;
use jostle_game::scene::{SceneError, is_name, line_at};
use jostle_sim::{Shape, Vec2};
use std::ops::Range;
use std::sync::Arc;

/// File name of a scene without a title.
const FILE: &str = "my-scene.toml";

/// The editor of one text.
pub struct Editor {
    pub(super) text: String,
    /// Name of the file that the text would be saved in.
    pub file: String,
    /// The pieces of the text, or of the last that was TOML.
    pub sheet: Sheet,
    /// The text is TOML.
    pub is_toml: bool,
    /// The last text that was a scene.
    pub scene: Option<Arc<Scene>>,
    /// Why the text is no scene, if it is none.
    pub error: Option<SceneError>,
    /// Why a server opened no room with this text.
    pub refusal: Option<SceneError>,
    /// The text changed since it was checked.
    unchecked: bool,
    pub(super) history: History,
    pub selection: Vec<PieceId>,
    pub(super) gesture: Option<EditGesture>,
    /// Lines along which something is aligned now.
    pub guides: Guides,
    /// The words for a screen reader.
    pub said: String,
    /// Counts changes of the text.
    pub revision: u32,
    /// Text and time of the first and the last of some nudges.
    pub(super) nudges: Option<(String, f64)>,
    /// Time and place of a press that moved nothing.
    pub(super) tap: Option<(f64, Vec2)>,
}

impl Editor {
    /// An editor of a text. `file` is its name, if it has one.
    pub fn open(text: String, file: Option<&str>) -> Editor {
        let mut editor = Editor {
            text,
            file: file.unwrap_or(FILE).to_owned(),
            sheet: Sheet::default(),
            is_toml: false,
            scene: None,
            error: None,
            refusal: None,
            unchecked: true,
            history: History::default(),
            selection: Vec::new(),
            gesture: None,
            guides: Guides::default(),
            said: String::new(),
            revision: 0,
            nudges: None,
            tap: None,
        };
        editor.reread();
        editor.check();
        editor
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether something can be undone, and done again.
    pub fn can(&self) -> [bool; 2] {
        self.history.can()
    }

    /// Whether a hand holds something.
    pub fn is_held(&self) -> bool {
        self.gesture.is_some()
    }

    /// Whether a hand is there, and holds no piece and no handle.
    pub fn holds_nothing(&self) -> bool {
        self.gesture.as_ref().is_some_and(|gesture| gesture.grip == Grip::Box)
    }

    // The text.

    /// The error that is shown: of the text, or of a server about it.
    pub fn problem(&self) -> Option<&SceneError> {
        let error = self.error.as_ref().or(self.refusal.as_ref());
        error.filter(|_| !self.text.is_empty())
    }

    /// Checks the text if it changed; whether it did.
    pub fn check(&mut self) -> bool {
        if !std::mem::take(&mut self.unchecked) {
            return false;
        }
        match Scene::parse(&self.file, &self.text) {
            Ok(scene) => (self.scene, self.error) = (Some(Arc::new(scene)), None),
            Err(error) => self.error = Some(error),
        }
        true
    }

    /// Puts another text in the place of this one, as one step.
    pub fn replace(&mut self, text: String, file: Option<&str>) {
        self.cancel();
        self.nudges = None;
        self.rename(file.unwrap_or(FILE));
        self.selection.clear();
        self.commit(text);
    }

    /// Gives the file another name, if it is one that a scene may have.
    pub fn rename(&mut self, file: &str) {
        if is_name(file.trim_end_matches(".toml")) {
            self.file = format!("{}.toml", file.trim_end_matches(".toml"));
            self.unchecked = true;
        }
    }

    /// The bytes that the error is about: the value of its field on its line, or what else is on that line.
    pub fn error_bytes(&self) -> Option<Range<usize>> {
        let error = self.problem()?;
        if let Some(at) = self
            .field_bytes(&error.field)
            .filter(|at| line_at(self.text.as_bytes(), at.start) == error.line)
        {
            return Some(at);
        }
        let mut lines = self.text.split_inclusive('\n').scan(0, |at, line| {
            let start = *at;
            *at += line.len();
            Some((start, line))
        });
        let (start, line) =
            lines.nth(error.line.saturating_sub(1)).unwrap_or((self.text.len(), ""));
        let field = error.field.rsplit('.').next().unwrap_or_default();
        let field = field.split('[').next().unwrap_or_default();
        let from = key_in(line, field).unwrap_or(line.len() - line.trim_start().len());
        let rest = uncommented(&line[from..]);
        Some(start + from..start + from + rest.len())
    }

    /// The bytes of a field that is there, from its name on.
    fn field_bytes(&self, path: &str) -> Option<Range<usize>> {
        let Spot::There { value, whole } = field::find(&self.text, path)? else { return None };
        let blanks = self.text[whole.start..].len() - self.text[whole.start..].trim_start().len();
        Some((whole.start + blanks).min(value.start)..value.end)
    }

    pub(super) fn reread(&mut self) {
        match Sheet::read(&self.text) {
            Some(sheet) => (self.sheet, self.is_toml) = (sheet, true),
            None => self.is_toml = false,
        }
        let sheet = &self.sheet;
        self.selection.retain(|id| sheet.piece(*id).is_some());
        self.refusal = None;
        self.unchecked = true;
        self.revision += 1;
    }

    pub(super) fn commit(&mut self, text: String) {
        if text != self.text {
            self.history.note(&self.text, &text);
            self.text = text;
            self.reread();
        }
    }

    pub(super) fn change(&mut self, splices: Vec<Splice>) {
        self.commit(apply(&self.text, splices));
    }

    /// Takes a text with new pieces, which are selected.
    pub(super) fn adopt(&mut self, made: Option<(String, Vec<PieceId>)>) {
        let Some((text, ids)) = made else { return self.wait() };
        self.commit(text);
        self.select(ids);
    }

    pub(super) fn wait(&mut self) {
        self.said = say(strings::BROKEN).to_owned();
    }

    /// Shows a text in the middle of a gesture.
    pub(super) fn show(&mut self, text: String) {
        if text != self.text {
            self.text = text;
            self.reread();
        }
    }

    /// Ends a gesture that began with `base`.
    pub(super) fn note(&mut self, base: &str) {
        self.history.note(base, &self.text);
    }

    pub(super) fn type_text(&mut self, text: String, now_ms: f64) {
        if text != self.text {
            self.history.note_typed(&self.text, &text, now_ms);
            self.text = text;
            self.reread();
        }
    }

    pub(super) fn step(&mut self, step: fn(&mut History, &mut String) -> Option<Range<usize>>) {
        let Some(changed) = step(&mut self.history, &mut self.text) else { return };
        self.reread();
        let touched = |piece: &&Piece| {
            piece.bytes.start < changed.end.max(changed.start + 1)
                && changed.start < piece.bytes.end
        };
        let touched = self.sheet.pieces.iter().filter(touched).map(|piece| piece.id);
        self.selection = touched.collect();
    }

    // The selection.

    pub fn selected(&self) -> impl Iterator<Item = &Piece> {
        self.selection.iter().filter_map(|id| self.sheet.piece(*id))
    }

    pub(super) fn select(&mut self, ids: Vec<PieceId>) {
        self.selection = ids;
        self.said = match &self.selection[..] {
            [] => String::new(),
            [id] => self.sheet.piece(*id).map(|piece| self.name_of(piece)).unwrap_or_default(),
            many => strings::pieces(many.len()),
        };
    }

    pub(super) fn select_next(&mut self, back: bool) {
        let ids: Vec<PieceId> = self.sheet.pieces.iter().map(|piece| piece.id).collect();
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

    /// The name of a piece, and where it is.
    pub fn name_of(&self, piece: &Piece) -> String {
        let place = piece
            .center()
            .map(|at| fill(" at {x}, {y}", &[("x", &short(at.x)), ("y", &short(at.y))]));
        let stuck = piece.stuck.map(|why| format!(". {}", say(why)));
        let name = self.short_name(piece);
        format!("{name}{}{}", place.unwrap_or_default(), stuck.unwrap_or_default())
    }

    /// The name of a piece: its kind, and its name or number.
    pub fn short_name(&self, piece: &Piece) -> String {
        let kind = if piece.kind == "dumb" { say("marble") } else { say(&piece.kind) };
        match &piece.name {
            Some(name) => format!("{kind} {name}"),
            None => format!("{kind} {}", piece.id.index + 1),
        }
    }

    // Geometry.

    /// The smallest step of the world.
    pub fn unit(&self) -> f32 {
        unit_of(self.world())
    }

    /// Width and height of the world.
    pub fn world(&self) -> Vec2 {
        let known = self.scene.as_ref().map(|scene| scene.size);
        self.sheet.world.or(known).unwrap_or(Vec2::new(320.0, 180.0))
    }

    pub(super) fn on_unit(&self, at: Vec2) -> Vec2 {
        let unit = self.unit();
        (at / unit).round() * unit
    }

    /// The shape of a piece: that of its text, or of the last scene.
    pub fn shape(&self, piece: &Piece) -> Option<Shape> {
        if piece.shape().is_some() {
            return piece.shape();
        }
        let scene = self.scene.as_ref()?;
        match piece.id.list {
            List::Bodies => {
                let body = scene.bodies.get(piece.id.index)?;
                (body.kind.name() == piece.kind).then_some(body.def.shape)
            }
            List::Spawns => scene.hero.as_ref().map(|hero| hero.body.shape),
            _ => None,
        }
    }

    /// The rectangle around a piece.
    pub fn extents(&self, piece: &Piece) -> Option<Extents> {
        let half = self.shape(piece).map_or(Vec2::ZERO, |shape| shape.half_extent());
        Some(Extents::around(piece.center()?, half))
    }

    /// Snapping to everything but the selection.
    pub(super) fn snapping(&self, sheet: &Sheet, hand: &Hand) -> Snapping {
        if hand.free {
            return Snapping::off();
        }
        let others = sheet.pieces.iter().filter(|piece| !self.selection.contains(&piece.id));
        let mut others: Vec<Extents> = others.filter_map(|piece| self.extents(piece)).collect();
        others.push(Extents { low: Vec2::ZERO, high: self.world() });
        Snapping { unit: self.unit(), reach: hand.reach * 0.5, others }
    }

    /// Digits after the point for a number that a hand decides.
    pub(super) fn decimals(&self, hand: &Hand) -> u32 {
        if hand.free { decimals_of(hand.step) } else { DECIMALS_MAX - 1 }
    }
}

/// Where a line sets a field.
fn key_in(line: &str, field: &str) -> Option<usize> {
    let is_key = |(at, _): &(usize, &str)| {
        let before = line[..*at].trim_end();
        let after = line[at + field.len()..].trim_start();
        (before.is_empty() || before.ends_with(['{', ',', '.'])) && after.starts_with('=')
    };
    if field.is_empty() {
        return None;
    }
    line.match_indices(field).find(is_key).map(|(at, _)| at)
}

/// A line without what a comment says, and without blanks at its end.
fn uncommented(line: &str) -> &str {
    let mut quote = None;
    for (at, letter) in line.char_indices() {
        match (quote, letter) {
            (None, '#') => return line[..at].trim_end(),
            (None, '"' | '\'') => quote = Some(letter),
            (Some(open), _) if open == letter => quote = None,
            _ => {}
        }
    }
    line.trim_end()
}

fn short(value: f32) -> String {
    rounded(value, 2)
}

/// The points that a piece's path goes through.
pub fn path_of(piece: &Piece) -> &[Point] {
    match &piece.place {
        Some(Place::Path(points)) => points,
        _ => &[],
    }
}
