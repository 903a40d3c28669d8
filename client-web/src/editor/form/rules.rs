//! Changes of rules by their sentences.

use super::row::{quoted, value};
use super::sentence::{EFFECT_KEYS, Names, OCCASION_KEYS, OF_BODY, Part, SEVERAL, sentences};
use crate::editor::edit::{Splice, apply};
use crate::editor::field::{self, Spot};
use crate::editor::strings;
use crate::editor::tables;
use crate::language::say;
use toml::de::DeTable;

/// The text after a blank of a rule was filled; `None` if nothing changes.
pub fn changed(text: &str, path: &str, new: &str) -> Option<String> {
    if let Some((rule, old)) = path.split_once('#') {
        let root = DeTable::parse(text).ok()?;
        let names = Names::read(root.get_ref());
        return match old {
            "when" => with_occasion(text, &names, rule, new),
            _ => with_effect(text, &names, rule, old, new),
        };
    }
    let parts = sentences(text).into_iter().flat_map(|sentence| sentence.parts);
    let row = parts.into_iter().find_map(|part| match part {
        Part::Blank(row) if row.path == path => Some(row),
        _ => None,
    })?;
    let value = value(&row.form, &[new.to_owned()], &[]).filter(|_| new != SEVERAL)?;
    let value = if path.ends_with(".who") { ["[", &value, "]"].concat() } else { value };
    set(text, path, &value)
}

/// Adds a rule about a zone, or about time if there is no zone.
pub fn added(text: &str, zone: Option<&str>) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let names = Names::read(root.get_ref());
    let zone = zone.or(names.zones.first().map(String::as_str));
    let occasion = match zone {
        Some(zone) => format!("enter = {}", quoted(zone)),
        None => "every = 10".to_owned(),
    };
    tables::added(text, "rules", &(occasion + "\nscore = 1"))
}

/// Gives a rule another occasion, without the effects that it cannot have there.
fn with_occasion(text: &str, names: &Names, rule: &str, new: &str) -> Option<String> {
    let path_of = |key: &str| [rule, ".", key].concat();
    let old = OCCASION_KEYS.iter().find(|key| field::is_given(text, &path_of(key)))?;
    let group = |wished: &str| {
        let known = names.groups.iter().find(|group| *group == wished);
        known.or(names.groups.first()).map(|group| quoted(group))
    };
    let value = match new {
        "enter" | "leave" if matches!(*old, "enter" | "leave") => given(text, &path_of(old))?,
        "enter" | "leave" => quoted(names.zones.first()?),
        "touch" => ["[", &group("hero")?, ", ", &group("block")?, "]"].concat(),
        "lost" => group("hero")?,
        "breaks" => group("block")?,
        "on" => quoted(names.levels.first()?),
        "every" => "10".to_owned(),
        _ => "true".to_owned(),
    };
    let mut text = renamed(text, rule, old, new, &value)?;
    if matches!(new, "on" | "every") {
        for key in EFFECT_KEYS[OF_BODY].iter().chain(&["team"]) {
            if let Some(splice) = field::unset(&text, &path_of(key)) {
                text = apply(&text, vec![splice]);
            }
        }
        if given(&text, &path_of("to")).is_some_and(|to| ["\"by\"", "\"others\""].contains(&&*to)) {
            text = set(&text, &path_of("to"), "\"all\"")?;
        }
    }
    let has_effect = EFFECT_KEYS.iter().any(|key| field::is_given(&text, &path_of(field_of(key))));
    if has_effect { Some(text) } else { set(&text, &path_of("score"), "1") }
}

/// Gives a rule an effect in place of another one. Either may be empty.
fn with_effect(text: &str, names: &Names, rule: &str, old: &str, new: &str) -> Option<String> {
    let path_of = |effect: &str| [rule, ".", field_of(effect)].concat();
    let value = match new {
        "score" | "life" | "stun" => "1".to_owned(),
        "splash" => "\"spark\"".to_owned(),
        "say" => quoted(say(strings::WELL_DONE)),
        "win" | "lose" => quoted(new),
        "reset" => ["[", &quoted(names.bodies.first()?), "]"].concat(),
        "" => return Some(apply(text, vec![field::unset(text, &path_of(old))?])),
        _ => "true".to_owned(),
    };
    if old.is_empty() || field_of(old) == field_of(new) {
        return set(text, &path_of(new), &value);
    }
    renamed(text, rule, field_of(old), field_of(new), &value)
}

/// The field of an effect.
fn field_of(effect: &str) -> &str {
    if matches!(effect, "win" | "lose") { "end" } else { effect }
}

fn set(text: &str, path: &str, value: &str) -> Option<String> {
    Some(apply(text, vec![field::set(text, path, value)?]))
}

/// The value of a field, as in the text.
fn given(text: &str, path: &str) -> Option<String> {
    let Spot::There { value, .. } = field::find(text, path)? else { return None };
    Some(text[value].to_owned())
}

/// Replaces a field of a table by another one, in its place.
fn renamed(text: &str, table: &str, old: &str, new: &str, with: &str) -> Option<String> {
    let Spot::There { value, .. } = field::find(text, &[table, ".", old].concat())? else {
        return None;
    };
    let key = text[..value.start].rfind(old)?;
    let name = Splice { at: key..key + old.len(), with: new.to_owned() };
    Some(apply(text, vec![name, Splice { at: value, with: with.to_owned() }]))
}
