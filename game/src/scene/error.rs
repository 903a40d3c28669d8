//! Why a scene was refused and where, and how the line of a field is found from its path.

use toml::de::{DeTable, DeValue};

/// Beginning of the allowed content if it is a guess at what was meant.
pub(super) const GUESS: &str = "did you mean ";

/// The reason why a scene was refused. Displays as `file:line: field: found ...; allowed: ...`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {field}: found {found}; {}{allowed}", lead(allowed))]
pub struct SceneError {
    /// File name, as given by the caller.
    pub file: String,
    /// Line of the field, counted from 1.
    pub line: usize,
    /// Path of the field, like `bodies[3].radius`.
    pub field: String,
    /// Content of the file at this field.
    pub found: String,
    /// Allowed content of this field, or a question that names the field that was probably meant.
    pub allowed: String,
}

/// The name that was probably meant: the one with the fewest edits, if these are at most a third of the letters.
pub(super) fn nearest<'n>(word: &str, names: &[&'n str]) -> Option<&'n str> {
    let near = names.iter().map(|name| (edits_between(word, name), *name));
    let (edits, name) = near.min_by_key(|(edits, _)| *edits)?;
    (3 * edits <= word.len().max(3)).then_some(name)
}

/// The number of letters inserted, removed or replaced between two words (Levenshtein distance).
fn edits_between(one: &str, other: &str) -> usize {
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (at, letter) in one.bytes().enumerate() {
        let mut corner = std::mem::replace(&mut row[0], at + 1);
        for (index, known) in other.bytes().enumerate() {
            let replaced = corner + usize::from(letter != known);
            corner = row[index + 1];
            row[index + 1] = replaced.min(corner + 1).min(row[index] + 1);
        }
    }
    row[other.len()]
}

/// The words before what is allowed; none before a question.
fn lead(allowed: &str) -> &'static str {
    if allowed.starts_with(GUESS) { "" } else { "allowed: " }
}

/// The line that contains a byte of a text, counted from 1. Past the end, it is the last line.
pub fn line_at(text: &[u8], at: usize) -> usize {
    1 + text.iter().take(at).filter(|&&byte| byte == b'\n').count()
}

/// Returns the byte at which the deepest existing part of a path begins, and whether that is the whole path.
pub(super) fn locate(source: &str, path: &str) -> (usize, bool) {
    let Ok(document) = DeTable::parse(source) else { return (0, false) };
    let (mut table, mut at) = (Some(document.get_ref()), 0);
    for segment in path.split('.') {
        let (name, index) = match segment.strip_suffix(']').and_then(|rest| rest.split_once('[')) {
            Some((name, index)) => (name, index.parse().ok()),
            None => (segment, None),
        };
        let Some(mut value) = table.and_then(|table| table.get(name)) else { return (at, false) };
        at = value.span().start;
        if let Some(index) = index {
            let items = value.get_ref().as_array();
            let Some(item) = items.and_then(|items| items.get::<usize>(index)) else {
                return (at, false);
            };
            (value, at) = (item, item.span().start);
        }
        table = DeValue::as_table(value.get_ref());
    }
    (at, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_leads_to_its_line_or_to_the_table_around_it() {
        let source = "title = \"a\"\n\n[limits]\nbodies = 4\n[[layouts]]\nx = 1\n[[layouts]]\ny = { z = 2 }\n";
        let line = |path: &str| {
            let (at, whole) = locate(source, path);
            (line_at(source.as_bytes(), at), whole)
        };
        assert_eq!(line("limits.bodies"), (4, true));
        assert_eq!(line("limits.players"), (3, false));
        assert_eq!(line("layouts[1].y.z"), (8, true));
        assert_eq!(line("layouts[1].count"), (7, false));
        assert_eq!(line("layouts[7]"), (5, false));
        assert_eq!(line("solver"), (1, false));
    }
}
