//! A field in a form, and its value in the text.

use crate::editor::field_words::FieldWords;
use jostle_game::scene::FieldForm;

/// A field in a form.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The field's path in the file.
    pub path: String,
    pub words: FieldWords,
    /// The values that the field accepts.
    pub form: FieldForm,
    /// The values given in the text, one for each control; `None` if the field is not set.
    pub values: Option<Vec<String>>,
    /// The values that apply if the field is not set.
    pub default: Vec<String>,
    /// The names of the values to choose from, if these differ from the values. Of a choice with names, one is always
    /// chosen; of numbers, the names are those from 0.
    pub names: Vec<String>,
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
