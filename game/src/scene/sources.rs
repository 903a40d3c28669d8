//! Emitters and launchers in a scene file, which make particles, dye packs and marbles by themselves.

use super::field::{INTERVAL, POSITION, SECONDS, VELOCITY};
use super::kind::Kind;
use super::limits::TICKS_MAX;
use super::recipes::Recipes;
use super::rules::{Condition, Names};
use super::table::Table;
use glam::Vec2;
use jostle_sim::{EmitterDef, Source};

/// Maximum number of launchers in a scene.
pub const LAUNCHERS_MAX: usize = 64;
/// Greatest `limit` that a launcher may have.
const LAUNCHED_MAX: u32 = 256;
/// The kinds that launchers can make, with their names in scene files.
const MAKES: [(&str, Kind); 2] = [("pack", Kind::Pack), ("dumb", Kind::Marble)];

/// A position in a scene file: that of an emitter or launcher, or an end of a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Location {
    /// A fixed point, world units.
    Point(Vec2),
    /// The centre of this entry of [`Scene::bodies`](crate::Scene::bodies).
    Body(usize),
}

/// An emitter that starts by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledEmitter {
    /// Recipe of its particles.
    pub recipe: u8,
    /// Number of particles per run; at least 5 are emitted every tick until none are left. Label: Particles each time.
    pub count: u16,
    /// Where it is: at a fixed point or on a body.
    pub location: Location,
    /// Tick of the first run. Label: First tick, for experts.
    pub start: u32,
    /// Ticks between the starts of consecutive runs. Default: one run only. Label: Ticks between.
    pub every: Option<u32>,
    /// It runs only while this holds. Default: always.
    #[doc(alias = "while")]
    pub condition: Condition,
}

impl ScheduledEmitter {
    /// Returns whether it starts in this tick, counted from 0.
    pub fn starts_at(&self, tick: u32) -> bool {
        match self.every {
            Some(every) => tick >= self.start && (tick - self.start).is_multiple_of(every),
            None => tick == self.start,
        }
    }

    /// Returns the emitter to start.
    pub fn emitter(&self, source: Source, seed: u32) -> EmitterDef {
        EmitterDef { recipe: self.recipe, count: self.count, seed, source }
    }
}

/// A launcher, which makes a body at regular intervals. Times are in ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Launcher {
    /// Where it is: at a fixed point or on a body.
    pub location: Location,
    /// Time between bodies. Label: Seconds between.
    pub every: u32,
    /// Time of the first body, counted from the start of the round. Label: Seconds until the first, for experts.
    pub start: u32,
    /// The kind of body that it makes. Label: What it throws.
    #[doc(alias = "what")]
    pub makes: Kind,
    /// Velocity of a marble, or direction in which a pack sets off. Default: to the nearest hero; `[0, 0]` for a
    /// marble. Label: Velocity.
    pub velocity: Option<Vec2>,
    /// It waits while there are this many ownerless bodies of its kind. Label: At most at once.
    pub limit: u32,
    /// It runs only while this holds. Default: always.
    #[doc(alias = "while")]
    pub condition: Condition,
}

impl Launcher {
    /// Returns whether it is due in this tick, counted from 0.
    pub fn is_due(&self, tick: u32) -> bool {
        tick >= self.start && (tick - self.start).is_multiple_of(self.every)
    }
}

/// Returns whether any launcher in the file makes bodies of this kind.
pub(super) fn make(root: &Table, kind: Kind) -> bool {
    let field = root.get("launchers");
    let entries = if field.is_given() { field.items() } else { Vec::new() };
    entries.iter().any(|entry| {
        let makes = entry.inner("what");
        let word = makes.word().unwrap_or(MAKES[0].0);
        MAKES.contains(&(word, kind))
    })
}

/// Reads `position` or `follow`; one of them is required.
fn location(table: &Table, names: &Names) -> Location {
    // Where it is. Default: this or `follow`. Label: Position.
    let position = table.get("position");
    // It stays at the centre of this body, even while the body moves. Default: this or `position`.
    let follow = table.get("follow");
    table.not_both("position", "follow");
    if !position.is_given() && !follow.is_given() {
        position.refuse("[x, y], or follow = \"name\"");
    }
    match follow.given(|follow| names.body(follow).unwrap_or(0)) {
        Some(body) => Location::Body(body),
        None => Location::Point(position.vector(Vec2::ZERO, POSITION)),
    }
}

/// Reads one entry of `emitters`.
pub(super) fn emitter(table: &Table, names: &Names, recipes: &mut Recipes) -> ScheduledEmitter {
    let recipe = table.need("recipe", "the name of a recipe");
    let location = location(table, names);
    ScheduledEmitter {
        recipe: recipes.index(&recipe, "fire"),
        count: table.need("count", "particles each time").whole(1, 1..=10_000) as u16,
        location,
        start: table.get("start").whole(0, 0..=TICKS_MAX),
        every: table.get("every").given(|every| every.whole(1, 1..=TICKS_MAX)),
        condition: names.any_condition(&table.get("while")),
    }
}

/// Reads one entry of `launchers`.
pub(super) fn launcher(table: &Table, names: &Names) -> Launcher {
    let every = table.need("every", "seconds from one to the next").ticks(1.0, INTERVAL).max(1);
    Launcher {
        makes: table.get("what").choice_or_first(&MAKES),
        location: location(table, names),
        every,
        start: table.get("start").ticks(0.0, SECONDS),
        velocity: table.get("velocity").given(|field| field.vector(Vec2::ZERO, VELOCITY)),
        limit: table.get("limit").whole(8, 1..=LAUNCHED_MAX),
        condition: names.any_condition(&table.get("while")),
    }
}
