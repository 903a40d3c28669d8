//! Collision groups, and the pairs in which they collide by default.

use super::edit::{Splice, apply};
use super::field;

/// Pairs of groups that collide by default. `flag` stands for all groups of flags, such as `flag-1`.
const PAIRS: [[&str; 2]; 14] = [
    ["hero", "platform"],
    ["hero", "hero"],
    ["hero", "block"],
    ["hero", "minion"],
    ["minion", "platform"],
    ["minion", "minion"],
    ["minion", "block"],
    ["block", "platform"],
    ["block", "block"],
    ["pack", "platform"],
    ["pack", "block"],
    ["pack", "minion"],
    ["hero", "flag"],
    ["flag", "platform"],
];

/// Adds a collision group to the text, along with the pairs in which it collides by default.
pub fn with_group(text: &str, group: &str) -> String {
    let Some(groups) = words(text, "groups") else { return text.to_owned() };
    if groups.iter().any(|known| known == group) {
        return text.to_owned();
    }
    let mut text = match field::push(text, "groups", &format!("\"{group}\"")) {
        Some(splice) => apply(text, vec![splice]),
        None => return text.to_owned(),
    };
    let known = |name: &str| name == group || groups.iter().any(|known| known == name);
    let kind = group.split('-').next().unwrap_or(group);
    let pairs = PAIRS.iter().filter(|pair| pair.contains(&kind));
    let pairs = pairs.map(|pair| pair.map(|name| if name == kind { group } else { name }));
    for pair in pairs.filter(|pair| pair.iter().all(|name| known(name))) {
        let pair = format!("[\"{}\", \"{}\"]", pair[0], pair[1]);
        let splice: Option<Splice> = field::push(&text, "pairs", &pair)
            .or_else(|| field::set(&text, "pairs", &format!("[{pair}]")));
        if let Some(splice) = splice {
            text = apply(&text, vec![splice]);
        }
    }
    text
}

/// The texts in a list at the top of a scene.
pub fn words(text: &str, path: &str) -> Option<Vec<String>> {
    let root = toml::de::DeTable::parse(text).ok()?;
    let items = root.get_ref().get(path)?.get_ref().as_array()?;
    Some(items.iter().filter_map(|item| item.get_ref().as_str().map(str::to_owned)).collect())
}
