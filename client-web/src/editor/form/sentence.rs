//! Rules as sentences whose blanks are filled by choosing. Rules with more than a sentence can say stay as text.

use super::row::Row;
use crate::editor::field_words::FieldWords;
use crate::editor::strings::{self, EFFECTS, OCCASIONS};
use crate::language::{fill, pieces, say};
use jostle_game::scene::{FieldForm, line_at, presets};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// The fields of rules' occasions, in the order of [`OCCASIONS`].
pub const OCCASION_KEYS: [&str; 8] =
    ["enter", "leave", "touch", "burst", "lost", "breaks", "on", "every"];
/// The names of rules' effects, in the order of [`EFFECTS`].
pub const EFFECT_KEYS: [&str; 13] = [
    "score",
    "life",
    "win",
    "lose",
    "back",
    "remove",
    "stun",
    "checkpoint",
    "carry",
    "drop",
    "splash",
    "reset",
    "say",
];
/// The effects that end the round, of which a rule has one.
const ENDS: Range<usize> = 2..4;
/// The effects on the body that a rule is about.
pub const OF_BODY: Range<usize> = 4..11;
/// Longest sentence of a scene, characters.
const SAY_CHARS_MAX: usize = 80;
/// Greatest number of points and of lives, and the longest time, seconds.
const POINTS_MAX: i64 = 1_000_000;
const LIVES_MAX: i64 = 1000;
const SECONDS_MAX: f32 = 3600.0;
/// The choice that stands for several groups.
pub const SEVERAL: &str = "*";

/// A part of a sentence.
#[derive(Debug, PartialEq)]
pub enum Part {
    Words(String),
    Blank(Row),
}

/// A rule.
#[derive(Debug, PartialEq)]
pub struct Sentence {
    /// The first byte of its table, and the number of that line.
    pub at: usize,
    pub line: usize,
    /// Empty if the rule is beyond sentences.
    pub parts: Vec<Part>,
}

/// The rules of a text; none if it is not valid TOML.
pub fn sentences(text: &str) -> Vec<Sentence> {
    let Ok(root) = DeTable::parse(text) else { return Vec::new() };
    let root = root.get_ref();
    let names = Names::read(root);
    let rules = root.get("rules").and_then(|rules| rules.get_ref().as_array());
    let rules = rules.into_iter().flatten().enumerate().map(|(index, rule)| {
        let at = rule.span().start;
        let table = rule.get_ref().as_table();
        let parts = table.and_then(|table| {
            let path = format!("rules[{index}]");
            let mut writer =
                Writer { names: &names, table, text, path, key: "", parts: Vec::new() };
            writer.write()?;
            Some(writer.parts)
        });
        Sentence { at, line: line_at(text.as_bytes(), at), parts: parts.unwrap_or_default() }
    });
    rules.collect()
}

/// The names in a scene that rules use.
pub struct Names {
    pub groups: Vec<String>,
    pub zones: Vec<String>,
    /// Zones and signals, whose levels come on.
    pub levels: Vec<String>,
    pub bodies: Vec<String>,
    teams: Vec<String>,
    /// The zones that sides can hold.
    held: Vec<String>,
    /// For each zone, the groups that it counts.
    who: Vec<Vec<String>>,
    recipes: Vec<String>,
    /// Words for a body in the group of blocks, which are balls in most games.
    block: &'static str,
    has_round: bool,
}

impl Names {
    /// A body of a group, in words.
    fn label(&self, group: &str) -> String {
        let known = ["hero", "minion", "dumb", "platform", "pack", "block"];
        match known.iter().position(|known| *known == group) {
            Some(5) => say(self.block).to_owned(),
            Some(at) => say(strings::GROUPS[at]).to_owned(),
            None => group.to_owned(),
        }
    }

    pub fn read(root: &DeTable) -> Names {
        let tables = |list: &str| {
            let entries = root.get(list).and_then(|list| list.get_ref().as_array());
            let entries = entries.into_iter().flatten();
            entries.filter_map(|entry| entry.get_ref().as_table()).collect::<Vec<_>>()
        };
        let named = |list: &str| tables(list).into_iter().filter_map(|table| word(table, "name"));
        let zones: Vec<String> = named("zones").collect();
        let held = tables("zones").into_iter().filter(|zone| zone.contains_key("take"));
        let own = root.get("recipes").and_then(|recipes| recipes.get_ref().as_table());
        let own = own.into_iter().flat_map(|own| own.keys()).map(|name| name.get_ref().to_string());
        let blocks = tables("bodies").into_iter().filter(|body| {
            let is_block = |key| word(body, key).is_none_or(|word| word == "block");
            is_block("kind") && is_block("group")
        });
        let (balls, blocks): (Vec<_>, Vec<_>) =
            blocks.partition(|body| body.contains_key("radius"));
        let block = match (balls.is_empty(), blocks.is_empty()) {
            (false, true) => strings::BALL,
            (false, false) => strings::BLOCK_OR_BALL,
            (true, _) => strings::GROUPS[5],
        };
        Names {
            block,
            groups: words(root, "groups"),
            levels: zones.iter().cloned().chain(named("signals")).collect(),
            bodies: named("bodies").collect(),
            teams: named("teams").collect(),
            held: held.filter_map(|zone| word(zone, "name")).collect(),
            who: tables("zones").into_iter().map(|zone| words(zone, "who")).collect(),
            recipes: presets().into_iter().map(|preset| preset.name).chain(own).collect(),
            has_round: root.contains_key("round"),
            zones,
        }
    }

    /// Whether a rule may have this occasion.
    fn allow(&self, occasion: &str) -> bool {
        match occasion {
            "enter" | "leave" => !self.zones.is_empty(),
            "on" => !self.levels.is_empty(),
            "touch" | "lost" | "breaks" => !self.groups.is_empty(),
            _ => true,
        }
    }
}

/// The string in a field.
fn word(table: &DeTable, field: &str) -> Option<String> {
    Some(table.get(field)?.get_ref().as_str()?.to_owned())
}

/// The strings in a list.
fn words(table: &DeTable, field: &str) -> Vec<String> {
    let list = table.get(field).and_then(|list| list.get_ref().as_array()).into_iter().flatten();
    list.filter_map(|item| Some(item.get_ref().as_str()?.to_owned())).collect()
}

/// The effects of a rule, as numbers in [`EFFECT_KEYS`].
fn effects_of(table: &DeTable) -> Vec<usize> {
    let has = |effect: &&str| match *effect {
        "win" | "lose" => word(table, "end").is_some_and(|end| end == *effect),
        key => table.contains_key(key),
    };
    (0..EFFECT_KEYS.len()).filter(|effect| has(&EFFECT_KEYS[*effect])).collect()
}

/// Writes the sentence of a rule.
struct Writer<'a> {
    names: &'a Names,
    table: &'a DeTable<'a>,
    text: &'a str,
    /// The rule's path.
    path: String,
    /// The occasion or effect that is being written.
    key: &'static str,
    parts: Vec<Part>,
}

impl Writer<'_> {
    /// Writes the sentence; `None` if the rule is beyond it.
    fn write(&mut self) -> Option<()> {
        let occasion = OCCASION_KEYS.iter().position(|key| self.table.contains_key(*key))?;
        self.key = OCCASION_KEYS[occasion];
        let about_body = !matches!(self.key, "on" | "every");
        let effects = effects_of(self.table);
        // Each of the rule's fields must be in the sentence.
        let known = |key: &&str| self.table.contains_key(*key);
        let others = ["to", "team"].iter().filter(|key| known(key)).count();
        let is_foreign = |effect: &usize| OF_BODY.contains(effect) && !about_body;
        if self.table.len() != 1 + effects.len() + others || effects.iter().any(is_foreign) {
            return None;
        }
        let offered = (0..OCCASIONS.len()).filter(|at| self.names.allow(OCCASION_KEYS[*at]));
        let offered = offered.map(|at| (OCCASION_KEYS[at], OCCASIONS[at].0));
        let verb = self.change("when", self.key, offered);
        self.fill(OCCASIONS[occasion].1, verb)?;
        if let Some(team) = word(self.table, "team") {
            self.say(" ");
            let (labels, path) = (self.team_labels(), self.path_of("team"));
            let team = self.choice(path, &self.names.teams, labels, &team)?;
            self.fill(strings::ONLY_TEAM, team)?;
        }
        let more = self.more(&effects, about_body);
        let offer = |at: usize| (EFFECT_KEYS[at], EFFECTS[at].0);
        for (number, &at) in effects.iter().enumerate() {
            self.say(" ");
            if number > 0 {
                self.say(say(strings::AND));
                self.say(" ");
            }
            self.key = EFFECT_KEYS[at];
            let none = (effects.len() > 1).then_some(("", strings::LEAVE_OUT));
            let same = if ENDS.contains(&at) { ENDS } else { at..at + 1 };
            let offered = none.into_iter().chain(same.chain(more.iter().copied()).map(offer));
            let change = self.change(self.key, self.key, offered);
            self.fill(EFFECTS[at].1, change)?;
        }
        self.say(" ");
        let none = [("", strings::ALSO)].into_iter();
        let also = self.change("", "", none.chain(more.into_iter().map(offer)));
        self.parts.push(Part::Blank(also));
        Some(())
    }

    /// The effects that the rule could also have.
    fn more(&self, effects: &[usize], about_body: bool) -> Vec<usize> {
        let has_end = effects.iter().any(|at| ENDS.contains(at));
        let can = |at: &usize| match *at {
            at if effects.contains(&at) => false,
            at if OF_BODY.contains(&at) => about_body,
            at if ENDS.contains(&at) => !has_end && self.names.has_round,
            at => EFFECT_KEYS[at] != "reset" || !self.names.bodies.is_empty(),
        };
        (0..EFFECTS.len()).filter(can).collect()
    }

    fn say(&mut self, words: &str) {
        if !words.is_empty() {
            self.parts.push(Part::Words(words.to_owned()));
        }
    }

    /// Writes a clause. `change` is its blank for the occasion or the effect.
    fn fill(&mut self, clause: &str, change: Row) -> Option<()> {
        let mut change = Some(change);
        for (words, blank) in pieces(clause) {
            self.say(words);
            let row = match blank {
                "" => continue,
                "verb" => change.take(),
                "who" => self.who(),
                "what" => self.what(),
                "n" => self.number(),
                "to" => self.to(),
                _ => self.text(),
            };
            self.parts.push(Part::Blank(row?));
        }
        Some(())
    }

    /// A blank whose choice changes the rule. Its path is not one of a field.
    fn change<'o>(
        &self,
        what: &str,
        now: &str,
        offered: impl Iterator<Item = (&'o str, &'o str)>,
    ) -> Row {
        let offered = offered.map(|(key, label)| (key.to_owned(), say(label).to_owned()));
        let (names, labels) = offered.unzip();
        self.row([&self.path, "#", what].concat(), FieldForm::Choice { names }, now, labels)
    }

    fn row(&self, path: String, form: FieldForm, value: &str, names: Vec<String>) -> Row {
        let words = FieldWords { label: say(strings::RULE).to_owned(), ..FieldWords::default() };
        Row { path, words, form, values: Some(vec![value.to_owned()]), default: Vec::new(), names }
    }

    /// A blank with names to choose from; `None` if the text has another one.
    fn choice(
        &self,
        path: String,
        names: &[String],
        labels: Vec<String>,
        now: &str,
    ) -> Option<Row> {
        let labels = if labels.is_empty() { names.to_vec() } else { labels };
        let form = FieldForm::Choice { names: names.to_vec() };
        names.iter().any(|name| name == now).then(|| self.row(path, form, now, labels))
    }

    fn path_of(&self, field: &str) -> String {
        [&self.path, ".", field].concat()
    }

    fn group(&self, path: String, now: &str) -> Option<Row> {
        let groups = &self.names.groups;
        self.choice(path, groups, groups.iter().map(|group| self.names.label(group)).collect(), now)
    }

    /// The kind of body that the rule is about.
    fn who(&self) -> Option<Row> {
        let key = self.key;
        match key {
            "touch" => self.group(self.path_of("touch[0]"), words(self.table, key).first()?),
            "lost" | "breaks" => self.group(self.path_of(key), &word(self.table, key)?),
            _ => {
                let zone = word(self.table, key)?;
                let zone = self.names.zones.iter().position(|known| *known == zone)?;
                let path = format!("zones[{zone}].who");
                let who = &self.names.who[zone];
                match &who[..] {
                    [] => self.group(path, "hero"),
                    [group] => self.group(path, group),
                    several => {
                        let groups = &self.names.groups;
                        let labels: Vec<String> =
                            several.iter().map(|one| self.names.label(one)).collect();
                        let offered =
                            groups.iter().map(|group| (group.clone(), self.names.label(group)));
                        let several = (SEVERAL.to_owned(), labels.join(", "));
                        let (names, labels) = std::iter::once(several).chain(offered).unzip();
                        Some(self.row(path, FieldForm::Choice { names }, SEVERAL, labels))
                    }
                }
            }
        }
    }

    /// The zone, the level, or the kind of body that is touched.
    fn what(&self) -> Option<Row> {
        let key = self.key;
        match key {
            "touch" => self.group(self.path_of("touch[1]"), words(self.table, key).get(1)?),
            _ => {
                let names = if key == "on" { &self.names.levels } else { &self.names.zones };
                self.choice(self.path_of(key), names, Vec::new(), &word(self.table, key)?)
            }
        }
    }

    fn number(&self) -> Option<Row> {
        let value = self.table.get(self.key)?;
        let is_number = matches!(value.get_ref(), DeValue::Integer(_) | DeValue::Float(_));
        let now = match value.get_ref().as_bool() {
            Some(true) => "0",
            _ if is_number => &self.text[value.span()],
            _ => return None,
        };
        let form = match self.key {
            "score" => FieldForm::Whole { range: [-POINTS_MAX, POINTS_MAX], default: 0 },
            "life" => FieldForm::Whole { range: [-LIVES_MAX, LIVES_MAX], default: 0 },
            _ => FieldForm::Number { range: [0.0, SECONDS_MAX], above: false, default: 0.0 },
        };
        Some(self.row(self.path_of(self.key), form, now, Vec::new()))
    }

    /// Whom points, lives and ends affect.
    fn to(&self) -> Option<Row> {
        let given = word(self.table, "to").unwrap_or_else(|| "it".to_owned());
        let about_body = OCCASION_KEYS[..6].iter().any(|key| self.table.contains_key(*key));
        let its = if self.names.teams.is_empty() { strings::ITS_PLAYER } else { strings::ITS_TEAM };
        let of_body = [("it", its), ("by", strings::CAUSER), ("others", strings::OTHERS)];
        let of_body = of_body.into_iter().filter(|_| about_body).chain([("all", strings::ALL)]);
        let (mut names, mut labels): (Vec<String>, Vec<String>) =
            of_body.map(|(name, label)| (name.to_owned(), say(label).to_owned())).unzip();
        names.extend(self.names.teams.iter().chain(&self.names.held).cloned());
        labels.extend(self.team_labels());
        let holder = |zone: &String| fill("whoever holds {zone}", &[("zone", zone)]);
        labels.extend(self.names.held.iter().map(holder));
        let now = if given == "it" && !about_body { "all" } else { &given };
        self.choice(self.path_of("to"), &names, labels, now)
    }

    fn team_labels(&self) -> Vec<String> {
        self.names.teams.iter().map(|team| fill("team {team}", &[("team", team)])).collect()
    }

    /// A name or a text.
    fn text(&self) -> Option<Row> {
        let key = self.key;
        match key {
            "say" => {
                let form = FieldForm::Text { chars_max: SAY_CHARS_MAX };
                Some(self.row(self.path_of(key), form, &word(self.table, key)?, Vec::new()))
            }
            "splash" => {
                let now = word(self.table, key)?;
                self.choice(self.path_of(key), &self.names.recipes, Vec::new(), &now)
            }
            _ => {
                let [body] = &words(self.table, key)[..] else { return None };
                self.choice(self.path_of("reset[0]"), &self.names.bodies, Vec::new(), body)
            }
        }
    }
}
