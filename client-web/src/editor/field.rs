//! Finds out where the value of a field such as `bodies[3].mass` is, or where it would be inserted.

use super::edit::{Splice, apply};
use super::text::{last_byte, line_end, line_start};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The location of a field in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Spot {
    There {
        /// The bytes of its value.
        value: Range<usize>,
        /// The bytes that are removed with the field.
        whole: Range<usize>,
    },
    /// The field is missing: where to insert it, and the text around its value.
    Missing {
        at: usize,
        /// The text before the value.
        before: String,
        /// The text after the value.
        after: String,
    },
}

/// One component of a path.
enum PathPart<'a> {
    Name(&'a str),
    Index(usize),
}

/// Finds a field. `None` if the text is not valid TOML or lacks the list entry that would contain the field.
pub fn find(text: &str, path: &str) -> Option<Spot> {
    let root = DeTable::parse(text).ok()?;
    let parts = parts(path)?;
    let mut table = root.get_ref();
    // The table's header and braces, if it has them, and the dotted names before its fields.
    let mut notation = TableNotation { header: None, braces: None, prefix: String::new() };
    let mut value: Option<&Spanned<DeValue>> = None;
    let last = parts.len() - 1;
    for (index, part) in parts.iter().enumerate() {
        match part {
            PathPart::Name(name) => {
                if let Some(found) = value {
                    table = found.get_ref().as_table()?;
                    notation = notation.within(text, found);
                }
                let Some(found) = table.get(*name) else {
                    let rest: Vec<&PathPart> = parts[index..].iter().collect();
                    return missing(text, table, &notation, &rest);
                };
                if index == last {
                    let key = table.keys().find(|key| key.get_ref() == name)?.span();
                    return Some(there(text, key, found.span(), notation.braces.is_some()));
                }
                let is_dotted = found.get_ref().as_table().is_some()
                    && !text[found.span()].starts_with(['[', '{']);
                if is_dotted {
                    // `walk.speed = 3`: every line repeats the dotted names before the field.
                    notation.prefix = format!("{}{name}.", notation.prefix);
                }
                value = Some(found);
            }
            PathPart::Index(at) => {
                let found = value?.get_ref().as_array()?.get(*at)?;
                if index == last {
                    let value = found.span();
                    return Some(Spot::There { whole: value.clone(), value });
                }
                value = Some(found);
            }
        }
    }
    None
}

/// How the fields of a table are written.
struct TableNotation {
    header: Option<usize>,
    braces: Option<Range<usize>>,
    prefix: String,
}

impl TableNotation {
    /// How the fields of a nested table are written.
    fn within(self, text: &str, table: &Spanned<DeValue>) -> TableNotation {
        let at = table.span();
        match text[at.clone()].chars().next() {
            Some('[') => {
                TableNotation { header: Some(at.start), braces: None, prefix: String::new() }
            }
            Some('{') => TableNotation { header: None, braces: Some(at), prefix: String::new() },
            _ => self,
        }
    }
}

fn parts(path: &str) -> Option<Vec<PathPart<'_>>> {
    let mut parts = Vec::new();
    for step in path.split('.') {
        let mut pieces = step.split('[');
        parts.push(PathPart::Name(pieces.next().filter(|name| !name.is_empty())?));
        for piece in pieces {
            parts.push(PathPart::Index(piece.strip_suffix(']')?.parse().ok()?));
        }
    }
    Some(parts)
}

fn there(text: &str, key: Range<usize>, value: Range<usize>, in_braces: bool) -> Spot {
    let whole = match in_braces {
        false => line_start(text, key.start)..line_end(text, value.end),
        true => {
            let after = text[value.end..].len() - text[value.end..].trim_start().len();
            let before = text[..key.start].trim_end();
            match () {
                () if text[value.end + after..].starts_with(',') => {
                    let rest = &text[value.end + after + 1..];
                    let blank = rest.len() - rest.trim_start_matches([' ', '\t']).len();
                    key.start..value.end + after + 1 + blank
                }
                () if before.ends_with(',') => before.len() - 1..value.end,
                () => key.start..value.end,
            }
        }
    };
    Spot::There { value, whole }
}

fn missing(
    text: &str,
    table: &DeTable,
    notation: &TableNotation,
    rest: &[&PathPart],
) -> Option<Spot> {
    let names: Option<Vec<&str>> = rest
        .iter()
        .map(|part| match part {
            PathPart::Name(name) => Some(*name),
            PathPart::Index(_) => None,
        })
        .collect();
    let names = names?;
    if let Some(braces) = &notation.braces {
        let last = last_byte(table);
        let name = names.join(".");
        let prefix = &notation.prefix;
        return Some(match table.is_empty() {
            true => Spot::Missing {
                at: braces.start + 1,
                before: format!(" {prefix}{name} = "),
                after: " ".to_owned(),
            },
            false => Spot::Missing {
                at: last,
                before: format!(", {prefix}{name} = "),
                after: String::new(),
            },
        });
    }
    let own = last_own_byte(text, table).or(notation.header);
    if names.len() > 1 && notation.header.is_none() && notation.prefix.is_empty() {
        // A missing top-level table is added at the end, with a header.
        let (name, tables) = names.split_last()?;
        let gap = if text.is_empty() { "" } else { "\n" };
        let before =
            format!("{}{gap}[{}]\n{name} = ", newline_at(text, text.len()), tables.join("."));
        return Some(Spot::Missing { at: text.len(), before, after: "\n".to_owned() });
    }
    let at = own.map_or(0, |own| line_end(text, own));
    let before = format!("{}{}{} = ", newline_at(text, at), notation.prefix, names.join("."));
    Some(Spot::Missing { at, before, after: "\n".to_owned() })
}

/// A newline if the text before this byte does not end with one.
fn newline_at(text: &str, at: usize) -> &'static str {
    if at == 0 || text[..at].ends_with('\n') { "" } else { "\n" }
}

/// The last byte of the fields directly under a table's header.
fn last_own_byte(text: &str, table: &DeTable) -> Option<usize> {
    let under = |value: &Spanned<DeValue>| match value.get_ref() {
        DeValue::Table(inner) => match text[value.span()].chars().next() {
            Some('[') => None,
            Some('{') => Some(value.span().end),
            _ => last_own_byte(text, inner),
        },
        DeValue::Array(_) if text[value.span()].starts_with("[[") => {
            // This is an array of tables with headers, or an array of arrays. Only the latter ends with a bracket.
            let header = value.get_ref().as_array()?.iter().any(|item| {
                item.get_ref().as_table().is_some() && text[item.span()].starts_with('[')
            });
            (!header).then(|| value.span().end)
        }
        _ => Some(value.span().end),
    };
    table.values().filter_map(under).max()
}

/// Sets a field to a value, or adds it after the last field of its table.
pub fn set(text: &str, path: &str, value: &str) -> Option<Splice> {
    Some(match find(text, path)? {
        Spot::There { value: at, .. } => Splice { at, with: value.to_owned() },
        Spot::Missing { at, before, after } => {
            Splice::insert(at, format!("{before}{value}{after}"))
        }
    })
}

/// Removes a field, so that its default applies again.
pub fn unset(text: &str, path: &str) -> Option<Splice> {
    match find(text, path)? {
        Spot::There { whole, .. } => Some(Splice::remove(whole)),
        Spot::Missing { .. } => None,
    }
}

/// Whether a text that is valid TOML has a field.
pub fn is_given(text: &str, path: &str) -> bool {
    matches!(find(text, path), Some(Spot::There { .. }))
}

/// Whether a field is absent from a text that is valid TOML.
pub fn is_missing(text: &str, path: &str) -> bool {
    matches!(find(text, path), Some(Spot::Missing { .. }))
}

/// Appends an entry to an existing list.
pub fn push(text: &str, path: &str, value: &str) -> Option<Splice> {
    let Spot::There { value: at, .. } = find(text, path)? else { return None };
    let list = &text[at.clone()];
    let inner = list.strip_prefix('[')?.strip_suffix(']')?;
    let ended = inner.trim_end();
    let spot = at.start + 1 + ended.len();
    if ended.is_empty() {
        return Some(Splice::insert(spot, value));
    }
    // The last entry may or may not have a trailing comma, and a comment may end its line. Exactly one of these
    // candidates is valid TOML.
    let lead = lead(inner, ended);
    let made = [
        format!("{lead}{value},"),
        format!(",{lead}{value}"),
        format!("\n{value}"),
        format!("\n, {value}"),
    ];
    let is_toml = |made: &Splice| find(&apply(text, vec![made.clone()]), path).is_some();
    made.map(|with| Splice::insert(spot, with)).into_iter().find(is_toml)
}

/// The separator between entries of a list: a line break with the last entry's indent if entries have separate lines,
/// otherwise a space.
fn lead(inner: &str, ended: &str) -> String {
    let last = ended.rfind('\n').map(|newline| &ended[newline..]);
    let indent = last.map(|line| &line[..line.len() - line.trim_start().len()]);
    match indent {
        Some(indent) if inner.len() > ended.len() => indent.to_owned(),
        _ => " ".to_owned(),
    }
}
