//! The texts of the editor, in English. Every literal here is a sentence.

use crate::language::{fill, say};

/// Pieces are not changed while the text is no TOML.
pub const BROKEN: &str = "The text has an error: mend it first.";
/// The browser's storage is full or forbidden.
pub const NOT_KEPT: &str =
    "This browser cannot keep the draft: save it as a file before you leave.";
/// There is no text.
pub const EMPTY: &str = "Drag a piece into the picture to begin.";
/// The place of a piece is relative to that of a body.
pub const FOLLOWS: &str = "It moves with the body that it follows.";
/// A piece has no place.
pub const NO_PLACE: &str = "It has no place of its own: see its text.";
/// One piece is gone.
pub const DELETED: &str = "Deleted.";
/// Titles of the form, without a selection and with a spawn point.
pub const SCENE: &str = "The scene";
pub const HEROES: &str = "Heroes";

/// Labels of a button: a body has no path yet, or has one.
pub const ADD_PATH: &str = "Let it move on a path";
pub const ADD_POINT: &str = "Add a point to its path";

pub fn pieces(count: usize) -> String {
    fill("{count} pieces", &[("count", &count.to_string())])
}

/// This number of pieces is gone.
pub fn deleted(count: usize) -> String {
    if count == 1 {
        say(DELETED).to_owned()
    } else {
        fill("{pieces} deleted.", &[("pieces", &pieces(count))])
    }
}
