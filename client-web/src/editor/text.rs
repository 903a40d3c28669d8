//! The text of a scene and the pieces found in it. The pieces are a view of the text and are rebuilt after every
//! change. Each piece knows the byte ranges of its table and its numbers; the text is never regenerated from them.

use super::strings;
use jostle_game::scene::parse_decimal;
use jostle_sim::{Shape, Vec2};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A list in a scene file whose entries have a position in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum List {
    /// `[[bodies]]`.
    Bodies,
    /// `[[layouts]]`.
    Layouts,
    /// `[[zones]]`.
    Zones,
    /// `[[emitters]]`.
    Emitters,
    /// `[[launchers]]`.
    Launchers,
    /// The points of `hero.spawns`.
    Spawns,
}

impl List {
    /// Every list, in the order in which pieces are drawn.
    pub const ALL: [List; 6] =
        [List::Zones, List::Layouts, List::Bodies, List::Emitters, List::Launchers, List::Spawns];

    /// The list's path in the scene file.
    pub fn path(self) -> &'static str {
        match self {
            List::Bodies => "bodies",
            List::Layouts => "layouts",
            List::Zones => "zones",
            List::Emitters => "emitters",
            List::Launchers => "launchers",
            List::Spawns => "hero.spawns",
        }
    }
}

/// Identifies a piece by its location in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PieceId {
    /// The list that contains the piece.
    pub list: List,
    /// The piece's index in the list.
    pub index: usize,
}

impl PieceId {
    /// The piece's path in the file, such as `bodies[3]`.
    pub fn path(self) -> String {
        format!("{}[{}]", self.list.path(), self.index)
    }
}

/// A number in the text.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    pub at: Range<usize>,
    pub value: f32,
}

/// Two numbers in the text, `[x, y]`.
pub type Point = [Number; 2];

/// The value of a point.
pub fn vector(point: &Point) -> Vec2 {
    Vec2::new(point[0].value, point[1].value)
}

/// The position of a piece.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    Center(Point),
    /// An area given by two corners, the lower one first.
    Area([Point; 2]),
    /// A path along these points.
    Path(Vec<Point>),
}

/// The size of a piece.
#[derive(Clone, Debug, PartialEq)]
pub enum Extent {
    /// `radius`.
    Radius(Number),
    /// `size`, the full width and height.
    Size(Point),
    /// The text gives no size, so the kind determines it.
    Unsaid,
}

/// An entry in the text that has a position.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// The piece's location in the file.
    pub id: PieceId,
    /// The value of `kind`. If there is none, the list's name in the singular, such as `zone`.
    pub kind: String,
    /// The piece's `name`, if it has one.
    pub name: Option<String>,
    /// The piece's bytes. For a table, these are the comments directly above the header, the header, and all fields up
    /// to the end of the last line; for an entry within a list, its brackets and everything between them.
    pub bytes: Range<usize>,
    /// Whether the piece is within the brackets of a list and has no header.
    pub inline: bool,
    /// The position; `None` if it is not given or is relative to another body.
    pub place: Option<Place>,
    /// The size.
    pub extent: Extent,
    /// Why the piece cannot be dragged; `None` if it can.
    pub stuck: Option<&'static str>,
    /// Whether other tables lie between this piece's tables. If so, it is neither removed nor copied as a whole.
    pub scattered: bool,
}

impl Piece {
    /// The shape given by the text.
    pub fn shape(&self) -> Option<Shape> {
        match (&self.place, &self.extent) {
            (Some(Place::Area([low, high])), _) => {
                let size = (vector(high) - vector(low)).abs();
                Some(Shape::rect(size.x, size.y))
            }
            (_, Extent::Radius(radius)) => Some(Shape::circle(radius.value.abs())),
            (_, Extent::Size(size)) => {
                let size = vector(size).abs();
                Some(Shape::rect(size.x, size.y))
            }
            (_, Extent::Unsaid) => None,
        }
    }

    /// The centre, or the first point of the path.
    pub fn center(&self) -> Option<Vec2> {
        Some(match self.place.as_ref()? {
            Place::Center(point) => vector(point),
            Place::Area([low, high]) => (vector(low) + vector(high)) * 0.5,
            Place::Path(points) => vector(points.first()?),
        })
    }
}

/// The pieces of a text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenePieces {
    /// The pieces, in the order of [`List::ALL`] and, within a list, in file order.
    pub pieces: Vec<Piece>,
    /// The value of `size`, if valid.
    pub world: Option<Vec2>,
}

impl ScenePieces {
    /// Parses a text; `None` if it is not valid TOML.
    pub fn read(text: &str) -> Option<ScenePieces> {
        let root = DeTable::parse(text).ok()?;
        let root = root.get_ref();
        let mut pieces = Vec::new();
        let headers = headers(text, root);
        for list in List::ALL {
            let Some(items) = value_at(root, list.path()).and_then(|v| v.get_ref().as_array())
            else {
                continue;
            };
            for (index, item) in items.iter().enumerate() {
                pieces.extend(piece(text, &headers, PieceId { list, index }, item));
            }
        }
        let world = root.get("size").and_then(point).map(|size| vector(&size));
        Some(ScenePieces { pieces, world })
    }

    /// The piece with this id.
    pub fn piece(&self, id: PieceId) -> Option<&Piece> {
        self.pieces.iter().find(|piece| piece.id == id)
    }
}

/// The value at a dotted path, such as `hero.spawns`.
pub fn value_at<'a, 'b>(root: &'b DeTable<'a>, path: &str) -> Option<&'b Spanned<DeValue<'a>>> {
    let (first, rest) = path.split_once('.').map_or((path, None), |(a, b)| (a, Some(b)));
    let value = root.get(first)?;
    match rest {
        Some(rest) => value_at(value.get_ref().as_table()?, rest),
        None => Some(value),
    }
}

fn piece(text: &str, headers: &[usize], id: PieceId, item: &Spanned<DeValue>) -> Option<Piece> {
    let at = item.span();
    let inline = id.list == List::Spawns || text[at.clone()].starts_with('{');
    let base = Piece {
        id,
        kind: id.list.path().trim_end_matches('s').to_owned(),
        name: None,
        bytes: at,
        inline,
        place: None,
        extent: Extent::Unsaid,
        stuck: None,
        scattered: false,
    };
    if id.list == List::Spawns {
        let place = point(item).map(Place::Center);
        return Some(Piece { kind: "spawn".to_owned(), place, ..base });
    }
    let table = item.get_ref().as_table()?;
    let word = |field: &str| Some(table.get(field)?.get_ref().as_str()?.to_owned());
    let place = place(table);
    let stuck = match () {
        () if table.contains_key("follow") => Some(strings::FOLLOWS),
        () if place.is_none() => Some(strings::NO_PLACE),
        () => None,
    };
    let bytes = match inline {
        true => item.span(),
        false => table_bytes(text, item.span().start, table),
    };
    Some(Piece {
        kind: word("kind").unwrap_or(base.kind),
        name: word("name"),
        scattered: !inline && is_scattered(text, headers, &bytes, item.span().start, table),
        bytes,
        place: place.filter(|_| stuck.is_none()),
        extent: extent(table),
        stuck,
        ..base
    })
}

fn place(table: &DeTable) -> Option<Place> {
    let corners = |value: &Spanned<DeValue>| -> Option<[Point; 2]> {
        let [low, high] = value.get_ref().as_array()?.get(..)? else { return None };
        Some([point(low)?, point(high)?])
    };
    if let Some(value) = table.get("path") {
        let points = value.get_ref().as_array()?.iter().map(point).collect::<Option<Vec<_>>>()?;
        return Some(Place::Path(points)).filter(|place| *place != Place::Path(Vec::new()));
    }
    if let Some(value) = table.get("area") {
        return corners(value).map(Place::Area);
    }
    table.get("position").and_then(point).map(Place::Center)
}

fn extent(table: &DeTable) -> Extent {
    let radius = table.get("radius").and_then(number).map(Extent::Radius);
    let size = || table.get("size").and_then(point).map(Extent::Size);
    radius.or_else(size).unwrap_or(Extent::Unsaid)
}

/// Reads a value of the form `[x, y]`.
pub fn point(value: &Spanned<DeValue>) -> Option<Point> {
    let [x, y] = value.get_ref().as_array()?.get(..)? else { return None };
    Some([number(x)?, number(y)?])
}

/// Reads a finite number.
pub fn number(value: &Spanned<DeValue>) -> Option<Number> {
    let parsed = match value.get_ref() {
        DeValue::Float(float) => parse_decimal(float.as_str())?,
        DeValue::Integer(whole) => i64::from_str_radix(whole.as_str(), whole.radix()).ok()? as f64,
        _ => return None,
    };
    let number = Number { at: value.span(), value: parsed as f32 };
    number.value.is_finite().then_some(number)
}

/// The bytes of a table that has no position, given by the list that contains it, or by its own name, and whether it is
/// within brackets. `None` if its fields are not in one place.
pub fn table_bytes_of(
    text: &str,
    path: &str,
    index: Option<usize>,
) -> Option<(Range<usize>, bool)> {
    let root = DeTable::parse(text).ok()?;
    let value = value_at(root.get_ref(), path)?;
    let value = match index {
        Some(index) => value.get_ref().as_array()?.get(index)?,
        None => value,
    };
    let (table, at) = (value.get_ref().as_table()?, value.span());
    if text[at.clone()].starts_with('{') {
        return index.map(|_| (at, true));
    }
    let bytes = table_bytes(text, at.start, table);
    let all = headers(text, root.get_ref());
    let is_whole =
        text[at.clone()].starts_with('[') && !is_scattered(text, &all, &bytes, at.start, table);
    is_whole.then_some((bytes, false))
}

/// The bytes of a table whose header is at `header`, including the comments directly above it.
pub fn table_bytes(text: &str, header: usize, table: &DeTable) -> Range<usize> {
    let start = with_comments(text, line_start(text, header));
    start..line_end(text, last_byte(table).max(header))
}

/// Whether a table's bytes contain the header of another table.
fn is_scattered(
    text: &str,
    all: &[usize],
    bytes: &Range<usize>,
    header: usize,
    table: &DeTable,
) -> bool {
    let own = headers(text, table);
    let foreign = |at: &&usize| **at != header && !own.contains(at);
    all.iter().filter(|at| bytes.contains(at)).any(|at| foreign(&at))
}

/// The offsets of the headers of all nested tables.
fn headers(text: &str, table: &DeTable) -> Vec<usize> {
    let mut found = Vec::new();
    let mut look = |value: &Spanned<DeValue>| {
        let Some(table) = value.get_ref().as_table() else { return };
        if text[value.span()].starts_with('[') {
            found.push(value.span().start);
        }
        found.extend(headers(text, table));
    };
    for value in table.values() {
        match value.get_ref().as_array() {
            Some(items) => items.iter().for_each(&mut look),
            None => look(value),
        }
    }
    found
}

/// The last byte that belongs to anything in a table.
pub fn last_byte(table: &DeTable) -> usize {
    let ends = table.iter().map(|(key, value)| {
        let inner = value.get_ref().as_table().map_or(0, last_byte);
        let listed = value.get_ref().as_array().map_or(0, |items| {
            let ends = items.iter().map(|item| {
                let inner = item.get_ref().as_table().map_or(0, last_byte);
                inner.max(item.span().end)
            });
            ends.max().unwrap_or(0)
        });
        key.span().end.max(value.span().end).max(inner).max(listed)
    });
    ends.max().unwrap_or(0)
}

/// The start of the line that contains a byte.
pub fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |newline| newline + 1)
}

/// The end of the line that contains a byte, including the newline.
pub fn line_end(text: &str, at: usize) -> usize {
    text[at..].find('\n').map_or(text.len(), |newline| at + newline + 1)
}

/// The start of the comments directly above the line that begins at `start`.
fn with_comments(text: &str, mut start: usize) -> usize {
    while start > 0 {
        let above = line_start(text, start - 1);
        if !text[above..start].trim_start().starts_with('#') {
            break;
        }
        start = above;
    }
    start
}
