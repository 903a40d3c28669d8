//! Launchers in a scene file: they make dye packs or marbles by themselves.

use super::kind::Kind;
use super::limits::SPEED_MAX;
use super::rules::{Names, SECONDS, ticks};
use super::spec::{Launcher, Placed};
use super::springs::location;
use super::table::{Range, Table};
use glam::Vec2;

/// Launchers of a scene.
pub const LAUNCHERS_MAX: usize = 64;
/// Bodies of one launcher at a time.
const LAUNCHED_MAX: u32 = 256;
/// Times from one to the next, seconds.
const INTERVAL: Range = Range::from(1.0 / 60.0, 3600.0);
const VELOCITY: Range = Range::from(-SPEED_MAX, SPEED_MAX);
/// What launchers make, with its words in scene files.
const MAKES: [(&str, Kind); 2] = [("pack", Kind::Pack), ("dumb", Kind::Marble)];

/// Returns whether launchers of the file make bodies of this kind.
pub(super) fn make(root: &Table, kind: Kind) -> bool {
    let field = root.get("launchers");
    let entries = if field.is_given() { field.items() } else { Vec::new() };
    entries.iter().any(|entry| {
        let makes = entry.inner("what");
        let word = makes.word().unwrap_or(MAKES[0].0);
        MAKES.contains(&(word, kind))
    })
}

/// Reads one entry of `launchers`.
pub(super) fn launcher(table: &Table, bodies: &[Placed], names: &Names) -> Launcher {
    let every = table.need("every", "seconds from one to the next");
    let every = every.number(1.0, INTERVAL);
    let velocity = table.get("velocity");
    Launcher {
        makes: table.get("what").choice(&MAKES).unwrap_or(Kind::Pack),
        location: location(table, bodies),
        velocity: velocity.is_given().then(|| velocity.vector(Vec2::ZERO, VELOCITY)),
        start: ticks(table.get("start").number(0.0, SECONDS)),
        every: ticks(every).max(1),
        limit: table.get("limit").whole(8, 1..=LAUNCHED_MAX),
        condition: names.any_condition(&table.get("while")),
    }
}
