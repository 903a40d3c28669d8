//! Rules in a scene file: one occasion, any number of effects.

use super::condition::Condition;
use super::known::{Known, POINTS_MAX, SECONDS, ticks};
use super::names::Names;
use super::say::Line;
use super::signal::{Each, SignalKind, SignalSpec};
use super::zone::ZoneSpec;
use crate::scene::recipes::Recipes;
use crate::scene::table::{Field, Range, Table};

/// Lives that one rule may give or take.
const LIFE_MAX: i32 = 1000;
/// Bodies that one rule may put back.
const RESET_MAX: usize = 8;
const OCCASIONS: [&str; 8] = ["enter", "leave", "on", "every", "touch", "burst", "lost", "breaks"];

/// A rule: effects, and the occasion that has them.
#[derive(Clone, Debug, PartialEq)]
pub struct RuleSpec {
    /// The occasion at which it takes effect.
    pub occasion: Occasion,
    /// Only while this holds.
    pub condition: Condition,
    /// Only if the body that it is about is of this team.
    pub team: Option<u8>,
    /// Whom points, lives and the end concern.
    pub to: To,
    /// Effects on scores, lives, bodies and signals.
    pub effects: Effects,
}

/// When a rule applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occasion {
    /// A body enters one of these zones, a bit each.
    Enter(u64),
    /// A body leaves one of them.
    Leave(u64),
    /// A condition comes to hold.
    On(Condition),
    /// Each time so many ticks of the round have passed.
    Every(u32),
    /// A body of the first group begins to touch one of the second.
    Touch(u8, u8),
    /// A dye pack bursts on a hero.
    Burst,
    /// A body of this group leaves the kill zone.
    Lost(u8),
    /// A body of this group breaks.
    Breaks(u8),
}

/// Whom an effect on sides concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum To {
    /// The side of the body that the rule is about; all sides if there is none.
    It,
    /// The side that caused it.
    By,
    /// All sides but that of the body.
    Others,
    /// Every side, one after another.
    All,
    /// The team with this number.
    Team(u8),
    /// The holder of the zone with this number.
    Holder(u8),
}

/// What a rule does, in this order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    /// Points for the side.
    pub score: i32,
    /// Lives for the side.
    pub life: i32,
    /// Claims the end of the round: `true` won, `false` lost.
    pub end: Option<bool>,
    /// The body returns to its start, at rest for so many ticks.
    pub back: Option<u32>,
    /// These bodies of the scene do so.
    pub reset: Vec<usize>,
    /// The body is gone.
    pub remove: bool,
    /// The keys of the body's player do nothing for so many ticks.
    pub stun: u32,
    /// The hero comes back here from now on.
    pub checkpoint: bool,
    /// What the hero touched hangs on it.
    pub carry: bool,
    /// What the hero carries is dropped.
    pub drop: bool,
    /// Particles of this recipe at the body.
    pub splash: Option<u8>,
    /// A line for the feed, once a tick.
    pub say: Option<Line>,
}

/// What rules are checked against.
pub(super) struct RuleSurroundings<'a> {
    pub has_round: bool,
    pub zones: &'a [ZoneSpec],
    pub signals: &'a [SignalSpec],
}

/// Reads one entry of `rules`, after everything else.
pub(super) fn rule(
    table: &Table,
    known: &Known,
    around: &RuleSurroundings,
    recipes: &mut Recipes,
) -> RuleSpec {
    let names = known.names;
    let occasion = occasion(table, known);
    let team = table.get("team");
    let rule = RuleSpec {
        occasion,
        condition: names.any_condition(&table.get("while")),
        team: team.is_given().then(|| team.index_in(&names.teams).unwrap_or(0) as u8),
        to: to(&table.get("to"), names, around),
        effects: effects(table, known, recipes),
    };
    check(table, &rule, around);
    rule
}

fn occasion(table: &Table, known: &Known) -> Occasion {
    let Known { names, groups, .. } = known;
    let fields = OCCASIONS.map(|name| table.get(name));
    let given: Vec<&Field> = fields.iter().filter(|field| field.is_given()).collect();
    match given[..] {
        [] => fields[0].refuse(format!("one of {}", OCCASIONS.join(", "))),
        [_] => {}
        [_, second, ..] => second.refuse("one occasion a rule"),
    }
    let [enter, leave, on, every, touch, burst, lost, breaks] = &fields;
    let group = |field: &Field| groups.given(field).unwrap_or(0);
    if leave.is_given() {
        Occasion::Leave(names.zones(leave))
    } else if on.is_given() {
        Occasion::On(names.any_condition(on))
    } else if every.is_given() {
        Occasion::Every(ticks(every.number(1.0, Range::from(1.0 / 60.0, 3600.0))).max(1))
    } else if touch.is_given() {
        let allowed = || "two groups, [\"a\", \"b\"]".to_owned();
        let [first, second] = touch.array([0; 2], allowed, |field, _| group(field));
        Occasion::Touch(first, second)
    } else if burst.is_given() {
        if !burst.truth(true) {
            burst.refuse("true");
        }
        Occasion::Burst
    } else if lost.is_given() {
        Occasion::Lost(group(lost))
    } else if breaks.is_given() {
        Occasion::Breaks(group(breaks))
    } else {
        Occasion::Enter(names.zones(enter))
    }
}

fn to(field: &Field, names: &Names, around: &RuleSurroundings) -> To {
    let words = [("it", To::It), ("by", To::By), ("others", To::Others), ("all", To::All)];
    let teams = names.teams.iter().enumerate();
    let teams = teams.map(|(index, name)| (name.as_str(), To::Team(index as u8)));
    let zones = names.zones.iter().enumerate();
    let held =
        zones.filter(|(index, _)| around.zones.get(*index).is_some_and(|z| z.take.is_some()));
    let held = held.map(|(index, name)| (name.as_str(), To::Holder(index as u8)));
    let choices: Vec<(&str, To)> = words.into_iter().chain(teams).chain(held).collect();
    field.choice(&choices).unwrap_or(To::It)
}

fn effects(table: &Table, known: &Known, recipes: &mut Recipes) -> Effects {
    let [back, splash] = ["back", "splash"].map(|name| table.get(name));
    let at_once = [("win", true), ("lose", false)];
    Effects {
        score: table.get("score").signed(0, POINTS_MAX),
        life: table.get("life").signed(0, LIFE_MAX),
        end: table.get("end").choice(&at_once),
        back: back.is_given().then(|| match back.is_number() {
            true => ticks(back.number(0.0, SECONDS)),
            false => {
                if !back.truth(true) {
                    back.refuse("true, or seconds");
                }
                0
            }
        }),
        reset: reset(&table.get("reset"), known.names),
        remove: table.get("remove").truth(false),
        stun: ticks(table.get("stun").number(0.0, SECONDS)),
        checkpoint: table.get("checkpoint").truth(false),
        carry: table.get("carry").truth(false),
        drop: table.get("drop").truth(false),
        splash: splash.is_given().then(|| recipes.index(&splash, "spark")),
        say: Line::read(&table.get("say")),
    }
}

/// A rule does something, and each effect has somebody to act on.
fn check(table: &Table, rule: &RuleSpec, around: &RuleSurroundings) {
    let effects = &rule.effects;
    if *effects == Effects::default() {
        let names =
            "score, life, end, back, reset, remove, stun, checkpoint, carry, drop, splash, say";
        table.get("score").refuse(format!("an effect: one of {names}"));
    }
    if effects.end.is_some() && !around.has_round {
        table.get("end").refuse("an end only in a scene with [round]");
    }
    if has_body(rule, around) {
        return;
    }
    let about_a_body = ["back", "remove", "stun", "checkpoint", "carry", "drop", "splash", "team"];
    for name in about_a_body {
        let field = table.get(name);
        let is_of_reset = name == "back" && !effects.reset.is_empty();
        if field.is_given() && !is_of_reset {
            field.refuse("nothing: this occasion is about no body");
        }
    }
    if effects.say.as_ref().is_some_and(Line::has_names) {
        table.get("say").refuse("a text without names: this occasion is about no body");
    }
}

/// Whether the occasion is about a body.
fn has_body(rule: &RuleSpec, around: &RuleSurroundings) -> bool {
    match rule.occasion {
        Occasion::Every(_) => false,
        Occasion::On(condition) => around.signals.iter().enumerate().any(|(index, signal)| {
            let of_somebody = matches!(&signal.kind, SignalKind::Order(o) if o.each != Each::All);
            of_somebody && condition.on.signals >> index & 1 == 1
        }),
        _ => true,
    }
}

/// The bodies that a rule puts back.
fn reset(field: &Field, names: &Names) -> Vec<usize> {
    let items = field.some_items(1..=RESET_MAX, "1 to 8 names of bodies");
    items.iter().filter_map(|item| names.body(item)).collect()
}
