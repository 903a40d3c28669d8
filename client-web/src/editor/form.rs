//! The form for a piece or the scene, with the fields whose allowed values the scene parser knows, the round, and the
//! rules as sentences.

pub mod round;
pub mod row;
pub mod rules;
pub mod sentence;

use super::edit::apply;
use super::field;
use super::field_words;
use super::number::rounded;
use super::state::Editor;
use super::strings;
use super::tables;
use super::templates::EMPTY;
use super::text::List;
use crate::language::say;
use crate::view::palette;
use jostle_game::Scene;
use jostle_game::scene::{FieldForm, FieldInfo};
use row::{Row, value};

/// The fields of a form.
#[derive(Default)]
pub struct Form {
    /// Those of the selected piece, or of the scene if no piece is selected.
    pub fields: Vec<Row>,
    pub round: Vec<Row>,
}

impl Form {
    pub fn of(editor: &Editor) -> Form {
        let prefix = prefix(editor);
        let (mut form, mut of_round) = (Form::default(), Vec::new());
        for field in Scene::fields(editor.text()) {
            if let Some(name) = field.path.strip_prefix("round.") {
                of_round.push(row(editor, name, &field));
            } else if let Some(name) = field.path.strip_prefix(&prefix)
                && (!prefix.is_empty() || !name.contains(['.', '[']) || name.starts_with("limits."))
            {
                // The scene's own fields are those outside lists and tables, plus its limits.
                form.fields.push(row(editor, name, &field));
            }
        }
        // Nothing can be chosen from an empty list.
        form.fields.retain(|row| row.form != FieldForm::Choice { names: Vec::new() });
        if editor.doc.is_toml {
            form.round = round::rows(editor.text(), of_round);
        }
        form
    }
}

/// The common path prefix of the form's fields.
fn prefix(editor: &Editor) -> String {
    match editor.selection[..] {
        [id] if id.list == List::Spawns => "hero.".to_owned(),
        [id] => format!("{}.", id.path()),
        _ => String::new(),
    }
}

fn row(editor: &Editor, name: &str, field: &FieldInfo) -> Row {
    let text = editor.text();
    let said = field.given.as_ref().map(|at| &text[at.clone()]);
    let values = match (&field.form, said) {
        (_, None) => None,
        (FieldForm::Vector { .. }, Some(said)) => {
            let inner = said.strip_prefix('[').and_then(|said| said.strip_suffix(']'));
            let parts = inner.unwrap_or(said).split(',');
            Some(parts.map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect())
        }
        (FieldForm::Text { .. } | FieldForm::Choice { .. }, Some(said)) => {
            let value = toml::de::DeValue::parse(said).ok();
            let word = value.and_then(|value| Some(value.get_ref().as_str()?.to_owned()));
            Some(vec![word.unwrap_or_default()])
        }
        (_, Some(said)) => Some(vec![said.to_owned()]),
    };
    let names = match (name, &field.form) {
        ("color", FieldForm::Whole { .. }) => {
            palette::NAMES.map(|name| say(name).to_owned()).into()
        }
        _ => Vec::new(),
    };
    let (path, form) = (field.path.clone(), field.form.clone());
    let default = default(editor, name, field);
    Row { words: field_words::of(&path, name), path, form, values, default, names }
}

/// The values that apply if the field is not set, one for each control.
fn default(editor: &Editor, name: &str, field: &FieldInfo) -> Vec<String> {
    let vector = |parts: [f32; 2]| parts.map(|part| rounded(part, 4)).to_vec();
    if name == "size" {
        let shape = editor.selected().next().map(|piece| editor.doc.shape(piece));
        let size = shape.map_or(Some(editor.doc.world()), |shape| Some(shape?.half_extent() * 2.0));
        return size.map(|size| vector(size.to_array())).unwrap_or_default();
    }
    match &field.form {
        _ if !field.has_default => Vec::new(),
        FieldForm::Number { default, .. } => vec![rounded(*default, 4)],
        FieldForm::Whole { default, .. } => vec![default.to_string()],
        FieldForm::Vector { default, .. } => vector(*default),
        _ => Vec::new(),
    }
}

/// The text after the controls of a field have changed; `None` if nothing changes.
pub fn changed(editor: &Editor, path: &str, values: &[String]) -> Option<String> {
    let text = if editor.text().trim().is_empty() { EMPTY } else { editor.text() };
    let first = values.first()?;
    match path {
        "round" => return round::switch(text, first == "true"),
        "teams" => return round::set_teams(text, first.trim().parse().unwrap_or(0)),
        _ => {}
    }
    let Form { fields, round } = Form::of(editor);
    let Some(row) = fields.iter().chain(&round).find(|row| row.path == path) else {
        return rules::changed(text, path, first);
    };
    let splice = match value(&row.form, values, &row.default) {
        Some(value) => field::set(text, path, &value),
        None => field::unset(text, path),
    };
    Some(apply(text, vec![splice?]))
}

/// The text without the rule that has this index, or with one more rule if `index` is empty: about the selected zone, if
/// there is one.
pub fn with_rules(editor: &Editor, index: &str) -> Option<String> {
    if let Ok(index) = index.parse() {
        return tables::removed(editor.text(), "rules", Some(index));
    }
    let text = if editor.text().trim().is_empty() { EMPTY } else { editor.text() };
    let zone = editor.selected().find(|piece| piece.id.list == List::Zones);
    rules::added(text, zone.and_then(|zone| zone.name.as_deref()))
}

/// The title of the form.
pub fn title(editor: &Editor) -> String {
    let (doc, selection) = (&editor.doc, &editor.selection);
    match selection[..] {
        [] => say(strings::SCENE).to_owned(),
        [id] if id.list == List::Spawns => say(strings::HEROES).to_owned(),
        [id] => doc.sheet.piece(id).map(|piece| doc.short_name(piece)).unwrap_or_default(),
        _ => strings::pieces(selection.len()),
    }
}

/// A note about the text or the selected piece, or empty.
pub fn note(editor: &Editor) -> &'static str {
    match editor.selection[..] {
        [] if editor.text().is_empty() => strings::EMPTY,
        _ if !editor.doc.is_toml => strings::BROKEN,
        [id] => editor.doc.sheet.piece(id).and_then(|piece| piece.stuck).unwrap_or_default(),
        _ => "",
    }
}
