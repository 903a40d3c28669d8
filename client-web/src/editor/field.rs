//! Fields by their paths, like `bodies[3].mass`: where their values stand, or where they would.

use super::edit::{Splice, apply};
use super::text::{last_byte, line_end, line_start};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A field of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Spot {
    There {
        /// The bytes of its value.
        value: Range<usize>,
        /// Those that go when it is removed.
        whole: Range<usize>,
    },
    /// It is not there; with what would add it around a value.
    Missing {
        at: usize,
        /// The text before the value.
        before: String,
        /// The text after it.
        after: String,
    },
}

/// One step of a path.
enum PathPart<'a> {
    Name(&'a str),
    Index(usize),
}

/// Finds a field; `None` if the text is no TOML, or lacks the entry that would have it.
pub fn find(text: &str, path: &str) -> Option<Spot> {
    let root = DeTable::parse(text).ok()?;
    let parts = parts(path)?;
    let mut table = root.get_ref();
    // Header of the table, if it has one; whether it has braces; names before its fields.
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
                    // `walk.speed = 3`: the names before it are part of each line.
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
    /// How those of a table within it are written.
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
        // A table of the top level that is not there: it gets a header, at the end.
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

/// A newline, if the text before a byte lacks one.
fn newline_at(text: &str, at: usize) -> &'static str {
    if at == 0 || text[..at].ends_with('\n') { "" } else { "\n" }
}

/// The furthest byte of the fields that stand under a table's own header.
fn last_own_byte(text: &str, table: &DeTable) -> Option<usize> {
    let under = |value: &Spanned<DeValue>| match value.get_ref() {
        DeValue::Table(inner) => match text[value.span()].chars().next() {
            Some('[') => None,
            Some('{') => Some(value.span().end),
            _ => last_own_byte(text, inner),
        },
        DeValue::Array(_) if text[value.span()].starts_with("[[") => {
            // A list of tables with headers, or one of lists: only the latter ends with a bracket of its own.
            let header = value.get_ref().as_array()?.iter().any(|item| {
                item.get_ref().as_table().is_some() && text[item.span()].starts_with('[')
            });
            (!header).then(|| value.span().end)
        }
        _ => Some(value.span().end),
    };
    table.values().filter_map(under).max()
}

/// Gives a field a value, or adds it after the last field of its table.
pub fn set(text: &str, path: &str, value: &str) -> Option<Splice> {
    Some(match find(text, path)? {
        Spot::There { value: at, .. } => Splice { at, with: value.to_owned() },
        Spot::Missing { at, before, after } => {
            Splice::insert(at, format!("{before}{value}{after}"))
        }
    })
}

/// Removes a field, so that its default holds again.
pub fn unset(text: &str, path: &str) -> Option<Splice> {
    match find(text, path)? {
        Spot::There { whole, .. } => Some(Splice::remove(whole)),
        Spot::Missing { .. } => None,
    }
}

/// Whether a text that is TOML lacks a field.
pub fn is_missing(text: &str, path: &str) -> bool {
    matches!(find(text, path), Some(Spot::Missing { .. }))
}

/// Appends an entry to a list that is there.
pub fn push(text: &str, path: &str, value: &str) -> Option<Splice> {
    let Spot::There { value: at, .. } = find(text, path)? else { return None };
    let list = &text[at.clone()];
    let inner = list.strip_prefix('[')?.strip_suffix(']')?;
    let ended = inner.trim_end();
    let spot = at.start + 1 + ended.len();
    if ended.is_empty() {
        return Some(Splice::insert(spot, value));
    }
    // The last entry has a comma or none, and a comment may end its line: only one of these is TOML.
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

/// The separator of entries of a list: a new line like the last, if each has its own.
fn lead(inner: &str, ended: &str) -> String {
    let last = ended.rfind('\n').map(|newline| &ended[newline..]);
    let indent = last.map(|line| &line[..line.len() - line.trim_start().len()]);
    match indent {
        Some(indent) if inner.len() > ended.len() => indent.to_owned(),
        _ => " ".to_owned(),
    }
}
