//! The text of a scene, which is the source of truth, and everything found in it.

use super::field::{self, Spot};
use super::history::History;
use super::number::rounded;
use super::palette::is_bare;
use super::snap::{Extents, unit_of};
use super::strings;
use super::text::{Extent, List, Piece, PieceId, Place, Point, ScenePieces, vector};
use crate::language::{fill, say};
use jostle_game::Scene;
use jostle_game::scene::{SceneError, is_name, line_at};
use jostle_sim::{Shape, Vec2};
use std::ops::Range;
use std::sync::Arc;

/// The file name of a scene without a title.
pub const FILE: &str = "my-scene.toml";

/// A leg of a piece's path, given by the piece and the index of the leg's first point.
pub type Leg = (PieceId, usize);

/// The text of a scene, and its edit history.
pub struct SceneDocument {
    text: String,
    /// The name of the file to which the text would be saved.
    pub file: String,
    /// The pieces in the text, or in its last version that was valid TOML.
    pub sheet: ScenePieces,
    /// Whether the text is valid TOML.
    pub is_toml: bool,
    /// The most recent version of the text that was a valid scene; `None` if the text is empty.
    pub scene: Option<Arc<Scene>>,
    /// Why the text is not a valid scene.
    pub error: Option<SceneError>,
    /// Why a server refused to open a room with this text.
    pub refusal: Option<SceneError>,
    /// Whether the text has changed since it was last checked.
    unchecked: bool,
    history: History,
    /// Incremented with every change to the text.
    pub revision: u32,
}

impl SceneDocument {
    /// Opens a text from a file with this name.
    pub fn open(text: String, file: &str) -> SceneDocument {
        let mut document = SceneDocument {
            text: String::new(),
            file: file.to_owned(),
            sheet: ScenePieces::default(),
            is_toml: false,
            scene: None,
            error: None,
            refusal: None,
            unchecked: true,
            history: History::default(),
            revision: 0,
        };
        document.set(text);
        document.check();
        document
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether undo and redo are possible, in this order.
    pub fn can(&self) -> [bool; 2] {
        self.history.can()
    }

    /// The error to show: one in the text, or one that a server reported.
    pub fn problem(&self) -> Option<&SceneError> {
        let error = self.error.as_ref().or(self.refusal.as_ref());
        error.filter(|_| !self.text.is_empty())
    }

    /// Checks the text if it has changed; returns whether it had.
    pub fn check(&mut self) -> bool {
        if !std::mem::take(&mut self.unchecked) {
            return false;
        }
        match Scene::parse(&self.file, &self.text) {
            Ok(scene) => (self.scene, self.error) = (Some(Arc::new(scene)), None),
            Err(error) => self.error = Some(error),
        }
        if is_bare(&self.text) {
            self.scene = None;
        }
        true
    }

    /// Renames the file if the name is valid for a scene.
    pub fn rename(&mut self, file: &str) {
        if is_name(file.trim_end_matches(".toml")) {
            self.file = format!("{}.toml", file.trim_end_matches(".toml"));
            self.unchecked = true;
        }
    }

    /// The bytes to which the error refers: the field's value if it is on the error's line, otherwise the rest of that
    /// line.
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

    /// The bytes of an existing field, starting at its name.
    fn field_bytes(&self, path: &str) -> Option<Range<usize>> {
        let Spot::There { value, whole } = field::find(&self.text, path)? else { return None };
        let blanks = self.text[whole.start..].len() - self.text[whole.start..].trim_start().len();
        Some((whole.start + blanks).min(value.start)..value.end)
    }

    /// Replaces the text without adding a history step.
    fn set(&mut self, text: String) {
        self.text = text;
        match ScenePieces::read(&self.text) {
            Some(sheet) => (self.sheet, self.is_toml) = (sheet, true),
            None => self.is_toml = false,
        }
        self.refusal = None;
        self.unchecked = true;
        self.revision += 1;
    }

    /// Replaces the text as one history step.
    pub fn commit(&mut self, text: String) {
        if text != self.text {
            self.history.note(&self.text, &text);
            self.set(text);
        }
    }

    /// Replaces the text as part of the history step that began with `first`.
    pub fn commit_again(&mut self, first: &str, text: String) {
        self.history.note_again(first, &text);
        self.set(text);
    }

    /// Replaces the text with one that was typed.
    pub fn type_text(&mut self, text: String, now_ms: f64) {
        if text != self.text {
            self.history.note_typed(&self.text, &text, now_ms);
            self.set(text);
        }
    }

    /// Shows a text during a gesture.
    pub fn show(&mut self, text: String) {
        if text != self.text {
            self.set(text);
        }
    }

    /// Records in the history a gesture that began with the text `base`.
    pub fn note(&mut self, base: &str) {
        self.history.note(base, &self.text);
    }

    /// Undoes or redoes one step and returns the bytes that changed.
    pub fn step(
        &mut self,
        step: fn(&mut History, &mut String) -> Option<Range<usize>>,
    ) -> Option<Range<usize>> {
        let mut text = std::mem::take(&mut self.text);
        let changed = step(&mut self.history, &mut text);
        match changed {
            Some(_) => self.set(text),
            None => self.text = text,
        }
        changed
    }

    /// The name and position of a piece.
    pub fn name_of(&self, piece: &Piece) -> String {
        let place = piece
            .center()
            .map(|at| fill(" at {x}, {y}", &[("x", &short(at.x)), ("y", &short(at.y))]));
        let stuck = piece.stuck.map(|why| format!(". {}", say(why)));
        let name = self.short_name(piece);
        format!("{name}{}{}", place.unwrap_or_default(), stuck.unwrap_or_default())
    }

    /// The short name of a piece, which consists of its kind and its name or number.
    pub fn short_name(&self, piece: &Piece) -> String {
        let is_ball = piece.kind == "block" && matches!(piece.extent, Extent::Radius(_));
        let kind = match &*piece.kind {
            "dumb" => "marble",
            "block" if is_ball => "ball",
            kind => kind,
        };
        let number = (piece.id.index + 1).to_string();
        let name = piece.name.as_deref().unwrap_or(&number);
        // A name such as `goal-2`, which the palette gives, says what the piece is.
        let (kind, name) = match name.rsplit_once('-') {
            Some((kind, number)) if strings::KINDS.contains(&kind) => (kind, number),
            _ => (kind, name),
        };
        format!("{} {name}", say(kind))
    }

    /// The world's snapping unit.
    pub fn unit(&self) -> f32 {
        unit_of(self.world())
    }

    /// The width and height of the world.
    pub fn world(&self) -> Vec2 {
        let known = self.scene.as_ref().map(|scene| scene.size);
        self.sheet.world.or(known).unwrap_or(Vec2::new(320.0, 180.0))
    }

    pub fn on_unit(&self, at: Vec2) -> Vec2 {
        let unit = self.unit();
        (at / unit).round() * unit
    }

    /// The shape of a piece, from its text or from the last valid scene.
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

    /// The bounding rectangle of a piece.
    pub fn extents(&self, piece: &Piece) -> Option<Extents> {
        let half = self.shape(piece).map_or(Vec2::ZERO, |shape| shape.half_extent());
        Some(Extents::around(piece.center()?, half))
    }

    /// The smallest piece at this point.
    pub fn piece_at(&self, at: Vec2, reach: f32) -> Option<PieceId> {
        let hits = self.sheet.pieces.iter().filter_map(|piece| {
            let extents = self.extents(piece)?;
            let half = ((extents.high - extents.low) * 0.5).max(Vec2::splat(0.6 * reach));
            let away = (at - extents.center()).abs();
            let inside = away.x <= half.x && away.y <= half.y;
            inside.then_some((half.x * half.y, piece.id))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, id)| id)
    }

    /// The path leg at this point.
    pub fn leg_at(&self, at: Vec2, reach: f32) -> Option<Leg> {
        let legs = self.sheet.pieces.iter().flat_map(|piece| {
            let ends = path_of(piece).windows(2).enumerate();
            ends.map(|(leg, ends)| {
                let [from, to] = [vector(&ends[0]), vector(&ends[1])];
                let way = to - from;
                let share = (at - from).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
                let away = (at - from - way * share.clamp(0.0, 1.0)).length();
                (away, (piece.id, leg))
            })
        });
        let near = legs.filter(|(away, _)| *away <= 0.5 * reach);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, leg)| leg)
    }

    /// Whether the last valid scene, which the picture shows, has this body as the text describes it.
    pub fn is_shown(&self, piece: &Piece, shape: Shape) -> bool {
        let body = self.scene.as_ref().and_then(|scene| scene.bodies.get(piece.id.index));
        let same = body.is_some_and(|body| {
            body.kind.name() == piece.kind
                && body.def.shape == shape
                && (body.path.is_some() || Some(body.def.position) == piece.center())
        });
        self.error.is_none() || same
    }
}

/// The offset within a line at which a field is set.
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

/// A line without its comment and trailing whitespace.
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

/// The points of a piece's path.
pub fn path_of(piece: &Piece) -> &[Point] {
    match &piece.place {
        Some(Place::Path(points)) => points,
        _ => &[],
    }
}
