//! The editor's texts in English. Every literal in this file is shown to the user.

use crate::language::{fill, say};

/// Shown while the text is not valid TOML and pieces cannot be changed.
pub const BROKEN: &str = "The text has an error: mend it first.";
/// Shown when the browser's storage is full or blocked.
pub const NOT_KEPT: &str =
    "This browser cannot keep the draft: save it as a file before you leave.";
/// Shown when the text is empty.
pub const EMPTY: &str = "Drag a piece into the picture to begin.";
/// Shown when the piece's position is relative to a body.
pub const FOLLOWS: &str = "It moves with the body that it follows.";
/// Shown when the piece has no position.
pub const NO_PLACE: &str = "It has no place of its own: see its text.";
/// Announces that one piece was deleted.
pub const DELETED: &str = "Deleted.";
/// Form titles when nothing is selected and when a spawn point is selected.
pub const SCENE: &str = "The scene";
pub const HEROES: &str = "Heroes";

/// The kinds of pieces, which may also begin their names, as in `goal-2`.
pub const KINDS: [&str; 17] = [
    "ball",
    "block",
    "checkpoint",
    "emitter",
    "finish",
    "flag",
    "goal",
    "home",
    "launcher",
    "lava",
    "layout",
    "marble",
    "minion",
    "platform",
    "spawn",
    "wall",
    "zone",
];

/// Button labels for a body without a path and for one that has a path.
pub const ADD_PATH: &str = "Let it move on a path";
pub const ADD_POINT: &str = "Add a point to its path";

pub fn pieces(count: usize) -> String {
    fill("{count} pieces", &[("count", &count.to_string())])
}

/// Announces that several pieces were deleted.
pub fn deleted(count: usize) -> String {
    if count == 1 {
        say(DELETED).to_owned()
    } else {
        fill("{pieces} deleted.", &[("pieces", &pieces(count))])
    }
}
