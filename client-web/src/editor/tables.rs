//! Tables without a position in the picture, such as rules, which are added to the text and removed from it.

use super::edit::{Splice, apply, own_bytes};
use super::field;
use super::form::row::quoted;
use super::references::{free_name, names};
use super::text::table_bytes_of;
use crate::view::palette;
use jostle_game::scene::TEAMS_MAX;

/// The number of entries of a list of tables.
pub fn count(text: &str, list: &str) -> usize {
    (0..).take_while(|index| table_bytes_of(text, list, Some(*index)).is_some()).count()
}

/// Adds a table with these fields, one on each line, to a list.
pub fn added(text: &str, list: &str, fields: &str) -> Option<String> {
    let last = count(text, list).checked_sub(1);
    let last = last.and_then(|index| table_bytes_of(text, list, Some(index)));
    if last.as_ref().map_or(field::is_given(text, list), |(_, inline)| *inline) {
        let entry = ["{ ", &fields.replace('\n', ", "), " }"].concat();
        return Some(apply(text, vec![field::push(text, list, &entry)?]));
    }
    let at = last.map_or(text.len(), |(bytes, _)| bytes.end);
    let ended = if at == 0 || text[..at].ends_with('\n') { "" } else { "\n" };
    let gap = if at == 0 { "" } else { "\n" };
    let table = [ended, gap, "[[", list, "]]\n", fields, "\n"].concat();
    Some(apply(text, vec![Splice::insert(at, table)]))
}

/// Adds teams up to this number. They are named after the players' colours, which are also theirs.
pub fn with_teams(mut text: String, count: usize) -> Option<String> {
    for team in self::count(&text, "teams")..count.min(TEAMS_MAX) {
        let name = palette::NAMES[team];
        let is_taken = names(&text).iter().any(|known| known == name);
        let name = if is_taken { free_name(&text, name) } else { name.to_owned() };
        text = added(&text, "teams", &["name = ", &quoted(&name)].concat())?;
    }
    Some(text)
}

/// Removes a table, given by its own name, or by its list and its index there.
pub fn removed(text: &str, path: &str, index: Option<usize>) -> Option<String> {
    let (bytes, inline) = table_bytes_of(text, path, index)?;
    Some(apply(text, vec![Splice::remove(own_bytes(text, &bytes, inline))]))
}
