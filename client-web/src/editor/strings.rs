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

/// The box for rounds in the form.
pub const ROUNDS: &str = "Play in rounds";
pub const ABOUT_ROUNDS: &str =
    "A round has a start, an end and winners. Without rounds, people just play.";
pub const TEAMS: &str = "Teams";
pub const ABOUT_TEAMS: &str =
    "Players are spread over the teams, which win together. Without teams, everyone plays alone.";

/// The parts of rules, as sentences. Each occasion and each effect is a choice and the clause that contains it.
pub const RULE: &str = "Rule";
pub const OCCASIONS: [(&str, &str); 8] = [
    ("enters", "When {who} {verb} {what},"),
    ("leaves", "When {who} {verb} {what},"),
    ("touches", "When {who} {verb} {what},"),
    ("is hit by dye", "When a hero {verb},"),
    ("falls out of the world", "When {who} {verb},"),
    ("breaks", "When {who} {verb},"),
    ("is switched on", "When {what} {verb},"),
    ("time has passed", "Whenever {verb} ({n} seconds),"),
];
pub const EFFECTS: [(&str, &str); 13] = [
    ("gets points", "{to} {verb}: {n}"),
    ("gets lives", "{to} {verb}: {n}"),
    ("wins the round", "{to} {verb}"),
    ("loses the round", "{to} {verb}"),
    ("goes back to its start", "it {verb} and waits {n} seconds"),
    ("disappears", "it {verb}"),
    ("cannot move", "it {verb} for {n} seconds"),
    ("comes back here from now on", "it {verb}"),
    ("carries what it touched", "it {verb}"),
    ("drops what it carries", "it {verb}"),
    ("sends out particles", "it {verb}: {name}"),
    ("is put back at its start", "{name} {verb}"),
    ("everyone reads", "{verb}: {name}"),
];
/// Follows the occasion of a rule for one team.
pub const ONLY_TEAM: &str = "only for {verb},";
pub const AND: &str = "and";
pub const ALSO: &str = "and\u{2026}";
pub const LEAVE_OUT: &str = "(leave this out)";
pub const ITS_PLAYER: &str = "its player";
pub const ITS_TEAM: &str = "its team";
pub const CAUSER: &str = "whoever touched it last";
pub const OTHERS: &str = "everyone else";
pub const ALL: &str = "everyone";
/// Bodies of the groups that are named after the kinds: hero, minion, dumb, platform, pack, block.
pub const GROUPS: [&str; 6] =
    ["a hero", "a minion", "a marble", "a platform", "a dye pack", "a block"];
/// Bodies of the group of blocks where all or some of them are round.
pub const BALL: &str = "a ball";
pub const BLOCK_OR_BALL: &str = "a block or ball";
/// The text of a new line of a rule.
pub const WELL_DONE: &str = "Well done!";

/// A rule with more than a sentence can say.
pub fn rule_at(line: usize) -> String {
    fill("A rule in the text, line {line}", &[("line", &line.to_string())])
}

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
