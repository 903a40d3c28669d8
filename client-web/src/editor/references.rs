//! The names in a scene, and what refers to them: rules and signals name zones, and much may follow a body.

use super::edit::{Splice, apply, item_bytes, table_splice};
use super::field;
use super::text::table_bytes;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Lists of tables, in an order in which signals come before the rules that name them.
const LISTS: [&str; 8] =
    ["teams", "bodies", "zones", "signals", "rules", "emitters", "launchers", "springs"];
/// Fields whose value is a name, or a list of names, each possibly after an exclamation mark.
const FIELDS: [&str; 13] = [
    "enter", "leave", "on", "while", "when", "any", "order", "until", "to", "reset", "follow",
    "runs", "body",
];
/// Fields without which the rest of a table still makes sense, unless it is a rule.
const CONDITIONS: [&str; 3] = ["while", "runs", "until"];
/// Minimum number of entries of an `order`.
const ORDER_MIN: usize = 2;
/// Maximum number of zones that a rule may name.
const ZONES_MAX: usize = 8;

/// The names that teams, bodies, zones and signals have.
pub fn names(text: &str) -> Vec<String> {
    let Ok(root) = DeTable::parse(text) else { return Vec::new() };
    let root = root.get_ref();
    let tables = LISTS.iter().flat_map(|list| tables(root, list)).map(|(_, table)| table);
    tables.filter_map(|table| Some(word(table.get("name")?)?.to_owned())).collect()
}

/// A name that nothing has yet, such as `zone-2`.
pub fn free_name(text: &str, base: &str) -> String {
    let taken = names(text);
    let mut names = (1..).map(|number| format!("{base}-{number}"));
    names.find(|name| !taken.contains(name)).unwrap_or_default()
}

/// Removes everything that refers to a name, such as the rules about a zone that no longer exists, and everything that
/// refers to what is removed. Lists of names lose only that name.
pub fn forget(mut text: String, name: &str) -> String {
    while let Some((splice, gone)) = reference(&text, name) {
        text = apply(&text, vec![splice]);
        if let Some(gone) = gone {
            text = forget(text, &gone);
        }
    }
    text
}

/// Removes one reference to a name. If a whole table has to go, its own name is returned too.
fn reference(text: &str, name: &str) -> Option<(Splice, Option<String>)> {
    let root = DeTable::parse(text).ok()?;
    let is_it = |value: &Spanned<DeValue>| {
        word(value).is_some_and(|word| word.strip_prefix('!').unwrap_or(word) == name)
    };
    for list in LISTS {
        for (index, (item, table)) in tables(root.get_ref(), list).enumerate() {
            for field in FIELDS {
                let Some(value) = table.get(field) else { continue };
                let items = value.get_ref().as_array().map(|items| &items[..]).unwrap_or_default();
                let found = items.iter().find(|item| is_it(item));
                let least = if field == "order" { ORDER_MIN } else { 1 };
                if let Some(found) = found.filter(|_| items.len() > least) {
                    return Some((Splice::remove(item_bytes(text, &found.span())), None));
                }
                if found.is_none() && !is_it(value) {
                    continue;
                }
                if CONDITIONS.contains(&field) && list != "rules" {
                    return Some((field::unset(text, &format!("{list}[{index}].{field}"))?, None));
                }
                let own = table.get("name").and_then(word).map(str::to_owned);
                return Some((table_splice(text, item.span(), table), own));
            }
        }
    }
    None
}

/// Lets the rules about a zone concern its copy too.
pub fn extend_rules(mut text: String, zone: &str, copy: &str) -> String {
    let Ok(root) = DeTable::parse(&text) else { return text };
    let [zone, copy] = [zone, copy].map(|name| format!("\"{name}\""));
    let (mut splices, mut added) = (Vec::new(), String::new());
    for (index, (item, table)) in tables(root.get_ref(), "rules").enumerate() {
        for field in ["enter", "leave"] {
            let Some(value) = table.get(field) else { continue };
            let said = &text[value.span()];
            if said == zone {
                let rule = &text[table_bytes(&text, item.span().start, table)];
                added.push('\n');
                added.push_str(&rule.replace(&zone, &copy));
            } else if value.get_ref().as_array().is_some_and(|items| items.len() < ZONES_MAX)
                && said.contains(&zone)
            {
                splices.extend(field::push(&text, &format!("rules[{index}].{field}"), &copy));
            }
        }
    }
    drop(root);
    text = apply(&text, splices);
    text.push_str(&added);
    text
}

/// The tables in a list, with the values that they are.
fn tables<'a, 'b>(
    root: &'b DeTable<'a>,
    list: &str,
) -> impl Iterator<Item = (&'b Spanned<DeValue<'a>>, &'b DeTable<'a>)> {
    let items = root.get(list).and_then(|value| value.get_ref().as_array());
    items.into_iter().flatten().filter_map(|item| Some((item, item.get_ref().as_table()?)))
}

fn word<'b>(value: &'b Spanned<DeValue>) -> Option<&'b str> {
    value.get_ref().as_str()
}
