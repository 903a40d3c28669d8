//! Text edits that replace ranges of bytes and leave everything else unchanged.

use super::number::written;
use super::text::{
    Extent, Number, Piece, Place, Point, ScenePieces, line_end, line_start, table_bytes,
};
use jostle_sim::Vec2;
use jostle_sim::short_sort::sort_few;
use std::ops::Range;
use toml::de::DeTable;

/// A range of bytes and the text that replaces it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Splice {
    pub at: Range<usize>,
    pub with: String,
}

impl Splice {
    /// Inserts text at this byte offset.
    pub fn insert(at: usize, with: impl Into<String>) -> Splice {
        Splice { at: at..at, with: with.into() }
    }

    pub fn remove(at: Range<usize>) -> Splice {
        Splice { at, with: String::new() }
    }
}

/// Applies splices in any order. If two overlap, the first one replaces the bytes of both.
pub fn apply(text: &str, mut splices: Vec<Splice>) -> String {
    let place = |splice: &Splice| (splice.at.start, splice.at.end);
    sort_few(&mut splices, |one, other| place(one) < place(other));
    let mut new = String::with_capacity(text.len() + 64);
    let mut from = 0;
    for Splice { at, with } in splices {
        // A splice inside an earlier one, such as a table within a removed table, is already covered.
        if at.start < from && at.end <= from {
            continue;
        }
        new.push_str(&text[from..at.start.max(from)]);
        new.push_str(&with);
        from = at.end;
    }
    new.push_str(&text[from..]);
    new
}

/// Changes a number in the text to another value, with at most `decimals` digits after the point.
pub fn set_number(text: &str, number: &Number, value: f32, decimals: u32) -> Option<Splice> {
    let before = &text[number.at.clone()];
    let with = written(value, decimals, before);
    (with != before).then(|| Splice { at: number.at.clone(), with })
}

/// Sets both numbers of a point.
pub fn set_point(text: &str, point: &Point, value: Vec2, decimals: u32) -> Vec<Splice> {
    let pairs = point.iter().zip(value.to_array());
    pairs.filter_map(|(number, value)| set_number(text, number, value, decimals)).collect()
}

pub fn moved(text: &str, piece: &Piece, by: Vec2, decimals: u32) -> Vec<Splice> {
    let points = match &piece.place {
        Some(Place::Center(point)) => std::slice::from_ref(point),
        Some(Place::Area(corners)) => corners.as_slice(),
        Some(Place::Path(points)) => points.as_slice(),
        None => return Vec::new(),
    };
    let shift = |point: &Point| {
        // A coordinate that does not change keeps its exact digits.
        let pairs = point.iter().zip(by.to_array()).filter(|(_, by)| *by != 0.0);
        let new = pairs.filter_map(|(n, by)| set_number(text, n, n.value + by, decimals));
        new.collect::<Vec<_>>()
    };
    points.iter().flat_map(shift).collect()
}

/// Removes pieces from the text: exactly their bytes, plus the empty line above a table. Comments directly above a
/// header are removed with it; other comments stay.
pub fn removed<'a>(text: &str, pieces: impl IntoIterator<Item = &'a Piece>) -> Vec<Splice> {
    let whole = pieces.into_iter().filter(|piece| !piece.scattered);
    whole.map(|piece| Splice::remove(own_bytes(text, &piece.bytes, piece.inline))).collect()
}

/// The bytes that are removed with a table or an entry between brackets.
pub(super) fn own_bytes(text: &str, bytes: &Range<usize>, inline: bool) -> Range<usize> {
    if inline { item_bytes(text, bytes) } else { with_gap(text, bytes) }
}

/// The bytes of a table, with the empty line above it.
fn with_gap(text: &str, bytes: &Range<usize>) -> Range<usize> {
    let Range { start, end } = *bytes;
    if start > 0 && line_start(text, start - 1) == start - 1 {
        return start - 1..end;
    }
    start..end
}

/// Removes a table in a list, which has a header at the start of `at` or is written in braces there.
pub fn table_splice(text: &str, at: Range<usize>, table: &DeTable) -> Splice {
    Splice::remove(match text[at.clone()].starts_with('{') {
        true => item_bytes(text, &at),
        false => with_gap(text, &table_bytes(text, at.start, table)),
    })
}

/// The bytes of an entry between brackets, including its comma and the whitespace before it.
pub(super) fn item_bytes(text: &str, bytes: &Range<usize>) -> Range<usize> {
    let blanks = |text: &str| text.len() - text.trim_start_matches([' ', '\t', '\r', '\n']).len();
    let mut end = bytes.end;
    let to_comma = end + blanks(&text[end..]);
    if text[to_comma..].starts_with(',') {
        end = to_comma + 1;
    }
    let before = &text[..bytes.start];
    let start = before.trim_end_matches([' ', '\t']).len();
    let alone = text[start..].starts_with(|_| true) && text[..start].ends_with('\n');
    let rest = &text[end..line_end(text, end)];
    if alone && rest.trim().is_empty() {
        return start..line_end(text, end);
    }
    // Removing the first entry of a list keeps the whitespace before it for the next entry.
    if text[..start].ends_with('[') {
        bytes.start..end + blanks_on_line(&text[end..])
    } else {
        start..end
    }
}

fn blanks_on_line(text: &str) -> usize {
    text.len() - text.trim_start_matches([' ', '\t']).len()
}

/// Duplicates a piece by repeating its bytes right after it.
pub fn copied(text: &str, piece: &Piece) -> Option<Splice> {
    if piece.scattered {
        return None;
    }
    let copy = &text[piece.bytes.clone()];
    if piece.inline {
        return Some(Splice::insert(piece.bytes.end, format!(", {copy}")));
    }
    let ended = if copy.ends_with('\n') { "" } else { "\n" };
    Some(Splice::insert(piece.bytes.end, format!("{ended}\n{copy}")))
}

/// Appends a table's text after the last table of its list, or at the end of the text.
pub fn appended(text: &str, sheet: &ScenePieces, list: super::text::List, table: &str) -> Splice {
    let last = sheet.pieces.iter().rfind(|piece| piece.id.list == list && !piece.inline);
    let at = last.map_or(text.len(), |piece| piece.bytes.end);
    let ended = if at == 0 || text[..at].ends_with('\n') { "" } else { "\n" };
    let gap = if at == 0 { "" } else { "\n" };
    Splice::insert(at, format!("{ended}{gap}{table}"))
}

/// Sets the size of a piece by changing its existing numbers, or adds a field if it has none.
pub fn sized(text: &str, piece: &Piece, size: Vec2, decimals: u32) -> Vec<Splice> {
    match &piece.extent {
        Extent::Radius(radius) => {
            set_number(text, radius, 0.5 * size.min_element(), decimals).into_iter().collect()
        }
        Extent::Size(point) => set_point(text, point, size, decimals),
        Extent::Unsaid => Vec::new(),
    }
}
