//! Creates scenes from maps made with the Tiled editor, in its JSON format (`.tmj`).
//!
//! [`map`] is the format, limited to the parts that a scene needs. [`objects`] turns each of a map's objects into a
//! list entry in the scene file. The result is checked like any scene, and an error in one of its fields names the
//! object from which the field came.

mod map;
mod objects;

use jostle_game::Scene;
use jostle_game::scene::SceneError;
use map::{Map, Origin, Wrong};
use objects::Written;
use std::fmt;

/// An error from [`import`]: `FILE: PLACE: FIELD: found ...; allowed: ...`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportError {
    file: String,
    /// The layer and the object; empty for the map itself.
    place: String,
    field: String,
    found: String,
    allowed: String,
}

impl fmt::Display for ImportError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ImportError { file, place, field, found, allowed } = self;
        let place = if place.is_empty() { String::new() } else { format!("{place}: ") };
        write!(out, "{file}: {place}{field}: found {found}; allowed: {allowed}")
    }
}

/// Turns a map into the text of a scene file that [`Scene::parse`] accepts. `file` appears in errors, and `name`
/// becomes the scene's name.
pub fn import(file: &str, name: &str, bytes: &[u8]) -> Result<String, ImportError> {
    let wrong = |found: String, allowed: &str| at(file, *Origin::Map.wrong("file", found, allowed));
    // Some programs put a byte order mark at the start of a text.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if let Some(found) = other_format(bytes) {
        return Err(wrong(found.to_owned(), "a map saved as JSON (File > Save As > *.tmj)"));
    }
    let map: Map = serde_json::from_slice(bytes)
        .map_err(|error| wrong(error.to_string(), "a map of Tiled in its JSON format"))?;
    let written = objects::write(&map).map_err(|wrong| at(file, *wrong))?;
    let text = toml::to_string(&written.scene)
        .map_err(|error| wrong(error.to_string(), "values that TOML has"))?;
    let text = format!("# Made from a map of Tiled by `jostle scene import`.\n\n{text}");
    match Scene::parse(&format!("{name}.toml"), &text) {
        Ok(_) => Ok(text),
        Err(error) => Err(at(file, blame(error, &written))),
    }
}

/// The format in which Tiled saved or exported a file, if it is not plain JSON.
fn other_format(bytes: &[u8]) -> Option<&'static str> {
    match bytes.trim_ascii_start() {
        [b'<', ..] => Some("XML, as in .tmx files"),
        [b'(', ..] => Some("a script, as in .js files"),
        [b'r', b'e', ..] => Some("a script, as in .lua files"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("text in UTF-16"),
        [0x1f, 0x8b, ..] => Some("a compressed file"),
        _ => None,
    }
}

fn at(file: &str, wrong: Wrong) -> ImportError {
    ImportError {
        file: file.to_owned(),
        place: wrong.origin.place(),
        field: wrong.field,
        found: wrong.found,
        allowed: wrong.allowed,
    }
}

/// Finds the object from which one of the scene's fields came.
fn blame(error: SceneError, written: &Written) -> Wrong {
    let object = || {
        let (list, rest) = error.field.split_once('[')?;
        let (index, rest) = rest.split_once(']')?;
        let origin = written.origins.get(list)?.get(index.parse::<usize>().ok()?)?;
        let field = rest.strip_prefix('.').unwrap_or("class");
        Some((origin.clone(), field.to_owned()))
    };
    let (origin, field) = object().unwrap_or_else(|| (Origin::Map, error.field.clone()));
    Wrong { origin, field, found: error.found.clone(), allowed: error.allowed.clone() }
}

#[cfg(test)]
mod tests;
