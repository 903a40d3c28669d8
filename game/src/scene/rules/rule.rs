//! Rules in a scene file. Each has one occasion, any number of effects, and possibly a line that it says.

use super::condition::Condition;
use super::names::{Names, POINTS_MAX, RuleNames, SENTENCE_CHARS_MAX};
use super::signal::{Each, SignalKind, SignalSpec};
use super::zone::ZoneSpec;
use crate::scene::field::{INTERVAL, SECONDS};
use crate::scene::recipes::Recipes;
use crate::scene::table::{Field, Table};

/// Maximum number of lives that one rule may give or take.
const LIFE_MAX: i32 = 1000;
/// Maximum number of bodies that one rule may reset.
const RESET_MAX: usize = 8;
/// Placeholders for players whom a line names.
const WORDS: [(&str, Whose); 2] = [("{it}", Whose::It), ("{by}", Whose::By)];
const OCCASIONS: [&str; 8] = ["enter", "leave", "on", "every", "touch", "burst", "lost", "breaks"];

/// A rule: an occasion and its effects.
#[derive(Clone, Debug, PartialEq)]
pub struct RuleSpec {
    /// The occasion at which it takes effect.
    pub occasion: Trigger,
    /// Whom `score`, `life` and `end` affect: the side of the body that the rule is about, or all sides if it is about
    /// no one; the side that caused it; all except the body's side; all; that team; or the zone's holder.
    pub to: To,
    /// The rule applies only if the body belongs to this team. Default: any.
    pub team: Option<u8>,
    /// The rule applies only while this holds. A lap in it counts only if it was completed by the player whom the rule
    /// is about, or by that player's side. Default: always.
    #[doc(alias = "while")]
    pub condition: Condition,
    /// Effects on scores, lives, bodies and signals.
    pub effects: Effects,
}

/// When a rule applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// A body enters it. About: the body. By: the side whose hero or pack touched it last; for a hero, its own side.
    Enter(u64),
    /// A body leaves it. About and by: as for `enter`.
    Leave(u64),
    /// It begins to hold. About: no player, or for a lap each player who completed it, even if others did so in the
    /// same tick or in the one before. By: the same.
    On(Condition),
    /// Each time this much of the round has passed. About and by: no one.
    Every(u32),
    /// A body of the first group begins to touch one of the second. About: the first body. By: its side.
    Touch(u8, u8),
    /// A dye pack bursts on a hero, unless the connection of the hero's player is closed or silent. About: the hero.
    /// By: the pack's owner.
    Burst,
    /// A body of the group [breaks](#bodies) and disappears. About: the body. By: the player who broke it.
    Breaks(u8),
    /// A body of the group leaves the kill zone. About: the body. By: the player who touched it last.
    Lost(u8),
}

/// The sides affected by an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum To {
    /// The side of the body that the rule is about, or all sides if the rule is not about a body.
    It,
    /// The side that caused the occasion.
    By,
    /// All sides except the body's.
    Others,
    /// Every side, one after another.
    All,
    /// The team with this index.
    Team(u8),
    /// The holder of the zone with this index.
    Holder(u8),
}

/// Effects of a rule, in the order in which they are applied. Times are in ticks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    /// Points for the sides in `to`.
    pub score: i32,
    /// Lives for the sides in `to`.
    pub life: i32,
    /// Ends the round for the sides in `to`.
    pub end: Option<bool>,
    /// Recipe of 40 particles emitted at the body.
    pub splash: Option<u8>,
    /// For this long, the keys of the hero's player do nothing. The hero drops what it carries.
    pub stun: u32,
    /// From now on, the hero comes back here.
    pub checkpoint: bool,
    /// The hero drops the body it carries.
    pub drop: bool,
    /// From now on, the hero carries the body that it touched.
    pub carry: bool,
    /// The body returns to its start, or a hero to its checkpoint. It rests there for this long, and then sets off as
    /// it did at the start.
    pub back: Option<u32>,
    /// The body is removed.
    pub remove: bool,
    /// A line in the feed, at most once per tick. It may begin and end with `{it}`, the player whose body it is about
    /// or who last touched that body, or `{by}`, the player who caused it. If there is no such player, nothing is said.
    pub say: Option<Line>,
    /// These bodies return to their starts, and rest there for as long as `back` says. Default: none.
    pub reset: Vec<usize>,
}

/// A line for the feed: a player's name, a text, and another player's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// The player named first.
    pub first: Option<Whose>,
    /// The text between the names.
    pub text: String,
    /// The player named last.
    pub last: Option<Whose>,
}

/// A player named in a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whose {
    /// `{it}`: the player whose hero the line is about, or who last touched the body that it is about.
    It,
    /// `{by}`: the player who caused it.
    By,
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
    known: &RuleNames,
    around: &RuleSurroundings,
    recipes: &mut Recipes,
) -> RuleSpec {
    let names = known.names;
    let occasion = occasion(table, known);
    let team = table.get("team");
    team.describe("a team");
    let rule = RuleSpec {
        occasion,
        team: team.given(|team| team.index_in(&names.teams).unwrap_or(0) as u8),
        condition: names.any_condition(&table.get("while")),
        to: to(&table.get("to"), names, around),
        effects: effects(table, known, recipes),
    };
    check(table, &rule, around);
    rule
}

fn occasion(table: &Table, known: &RuleNames) -> Trigger {
    let RuleNames { names, groups, .. } = known;
    let fields = OCCASIONS.map(|name| table.get(name));
    let given: Vec<&Field> = fields.iter().filter(|field| field.is_given()).collect();
    match given[..] {
        [] => fields[0].refuse(format!("one of {}", OCCASIONS.join(", "))),
        [_] => {}
        [_, second, ..] => second.refuse("one occasion a rule"),
    }
    let [enter, leave, on, every, touches, bursts, lost, breaks] = &fields;
    let group = |field: &Field| groups.given(field).unwrap_or(0);
    let touch = |field: &Field| {
        let allowed = || "two groups, [\"a\", \"b\"]".to_owned();
        let [first, second] = field.array([0; 2], allowed, |field, _| group(field));
        Trigger::Touch(first, second)
    };
    let burst = |field: &Field| {
        true_only(field, "true");
        Trigger::Burst
    };
    let given = leave.given(|field| Trigger::Leave(names.zones(field)));
    given
        .or_else(|| on.given(|field| Trigger::On(names.any_condition(field))))
        .or_else(|| every.given(|field| Trigger::Every(field.ticks(1.0, INTERVAL).max(1))))
        .or_else(|| touches.given(touch))
        .or_else(|| bursts.given(burst))
        .or_else(|| lost.given(|field| Trigger::Lost(group(field))))
        .or_else(|| breaks.given(|field| Trigger::Breaks(group(field))))
        .unwrap_or_else(|| Trigger::Enter(names.zones(enter)))
}

/// Refuses `false`, which means nothing.
fn true_only(field: &Field, allowed: &str) {
    field.describe(allowed);
    if !field.truth(true) {
        field.refuse(allowed);
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
    field.describe(
        "`\"it\"`, `\"by\"`, `\"others\"`, `\"all\"`, a team, or a zone that can be held",
    );
    field.choice_or_first(&choices)
}

fn effects(table: &Table, known: &RuleNames, recipes: &mut Recipes) -> Effects {
    let [back, splash] = ["back", "splash"].map(|name| table.get(name));
    Effects {
        score: table.get("score").signed(0, POINTS_MAX),
        life: table.get("life").signed(0, LIFE_MAX),
        end: table.get("end").choice(&[("win", true), ("lose", false)]),
        back: back.given(|back| {
            if back.is_number() {
                return back.ticks(0.0, SECONDS);
            }
            true_only(back, "true, or seconds");
            0
        }),
        reset: reset(&table.get("reset"), known.names),
        remove: table.get("remove").truth(false),
        stun: table.get("stun").ticks(0.0, SECONDS),
        checkpoint: table.get("checkpoint").truth(false),
        carry: table.get("carry").truth(false),
        drop: table.get("drop").truth(false),
        splash: splash.given(|splash| recipes.index(splash, "spark")),
        say: table.get("say").given(Line::read),
    }
}

/// Checks that a rule has an effect, and that each effect has something to act on.
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
        Trigger::Every(_) => false,
        Trigger::On(condition) => around.signals.iter().enumerate().any(|(index, signal)| {
            let of_somebody = matches!(&signal.kind, SignalKind::Order(o) if o.each != Each::All);
            of_somebody && condition.on.signals >> index & 1 == 1
        }),
        _ => true,
    }
}

/// The bodies that a rule resets.
fn reset(field: &Field, names: &Names) -> Vec<usize> {
    let items = field.some_items(1..=RESET_MAX, "1 to 8 names of bodies");
    items.iter().filter_map(|item| names.body(item)).collect()
}

impl Line {
    /// Reads `say`.
    fn read(field: &Field) -> Line {
        let text = field.text(SENTENCE_CHARS_MAX);
        let line = Line::of(&text);
        if line.text.trim().is_empty() || line.text.contains(['{', '}']) {
            field.refuse("a text that may begin and end with {it} or {by}");
        }
        line
    }

    fn of(text: &str) -> Line {
        let first = WORDS.iter().find_map(|(word, whose)| Some((text.strip_prefix(word)?, *whose)));
        let (text, first) = first.map_or((text, None), |(rest, whose)| (rest, Some(whose)));
        let last = WORDS.iter().find_map(|(word, whose)| Some((text.strip_suffix(word)?, *whose)));
        let (text, last) = last.map_or((text, None), |(rest, whose)| (rest, Some(whose)));
        Line { first, text: text.to_owned(), last }
    }

    /// Returns whether the line names a player.
    fn has_names(&self) -> bool {
        self.first.is_some() || self.last.is_some()
    }
}
