//! Tables without a position in the picture, such as rules, which are added to the text and removed from it.

use super::edit::{Splice, apply, own_bytes};
use super::field;
use super::text::table_bytes_of;

/// The number of entries of a list of tables.
pub fn count(text: &str, list: &str) -> usize {
    (0..).take_while(|index| table_bytes_of(text, list, Some(*index)).is_some()).count()
}

/// Adds a table with these fields to a list.
pub fn added(text: &str, list: &str, fields: &[String]) -> Option<String> {
    let last = count(text, list).checked_sub(1);
    let last = last.and_then(|index| table_bytes_of(text, list, Some(index)));
    if last.as_ref().map_or(field::is_given(text, list), |(_, inline)| *inline) {
        let entry = ["{ ", &fields.join(", "), " }"].concat();
        return Some(apply(text, vec![field::push(text, list, &entry)?]));
    }
    let at = last.map_or(text.len(), |(bytes, _)| bytes.end);
    let ended = if at == 0 || text[..at].ends_with('\n') { "" } else { "\n" };
    let gap = if at == 0 { "" } else { "\n" };
    let table = [ended, gap, "[[", list, "]]\n", &fields.join("\n"), "\n"].concat();
    Some(apply(text, vec![Splice::insert(at, table)]))
}

/// Removes a table, given by its own name, or by its list and its index there.
pub fn removed(text: &str, path: &str, index: Option<usize>) -> Option<String> {
    let (bytes, inline) = table_bytes_of(text, path, index)?;
    Some(apply(text, vec![Splice::remove(own_bytes(text, &bytes, inline))]))
}
