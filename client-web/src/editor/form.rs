//! The form for a piece or the scene, with the fields whose allowed values the scene parser knows.

use super::number::rounded;
use super::state::Editor;
use super::strings;
use super::text::List;
use crate::language::say;
use jostle_game::Scene;
use jostle_game::scene::{FieldForm, FieldInfo};

/// A field in a form.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The field's path in the file.
    pub path: String,
    pub name: String,
    /// The values that the field accepts.
    pub form: FieldForm,
    /// The values given in the text, one for each control; `None` if the field is not set.
    pub values: Option<Vec<String>>,
    /// The values that apply if the field is not set.
    pub default: Vec<String>,
}

/// The fields of the selected piece, or of the scene if no piece is selected.
pub fn rows(editor: &Editor) -> Vec<Row> {
    let prefix = prefix(editor);
    let fields = Scene::fields(editor.text());
    fields.into_iter().filter_map(|field| row(editor.text(), &prefix, field)).collect()
}

/// The common path prefix of the form's fields.
fn prefix(editor: &Editor) -> String {
    match editor.selection[..] {
        [id] if id.list == List::Spawns => "hero.".to_owned(),
        [id] => format!("{}.", id.path()),
        _ => String::new(),
    }
}

fn row(text: &str, prefix: &str, field: FieldInfo) -> Option<Row> {
    let name = field.path.strip_prefix(prefix)?;
    // The scene's own fields are those outside lists and tables, plus its limits.
    if prefix.is_empty() && name.contains(['.', '[']) && !name.starts_with("limits.") {
        return None;
    }
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
    let default = match &field.form {
        FieldForm::Number { default, .. } => vec![rounded(*default, 4)],
        FieldForm::Whole { default, .. } => vec![default.to_string()],
        FieldForm::Vector { default, .. } => default.iter().map(|part| rounded(*part, 4)).collect(),
        _ => Vec::new(),
    };
    Some(Row { name: name.to_owned(), path: field.path, form: field.form, values, default })
}

/// The TOML value for the contents of a field's controls; `None` if they are empty, so that the default applies. Range
/// checks are left to the scene parser.
pub fn value(form: &FieldForm, values: &[String], default: &[String]) -> Option<String> {
    if values.iter().all(|value| value.trim().is_empty()) {
        return None;
    }
    let first = values.first()?;
    Some(match form {
        FieldForm::Vector { .. } => {
            let part = |at: usize| {
                let given = values.get(at).filter(|value| !value.trim().is_empty());
                given.or(default.get(at)).map_or("0", |value| value.trim())
            };
            format!("[{}, {}]", part(0), part(1))
        }
        FieldForm::Text { .. } | FieldForm::Choice { .. } => quoted(first),
        _ => first.trim().to_owned(),
    })
}

/// Quotes a string for TOML.
pub fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' | '\\' => out.extend(['\\', letter]),
            _ if letter.is_control() => out.push(' '),
            _ => out.push(letter),
        }
    }
    out.push('"');
    out
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
