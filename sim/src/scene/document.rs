//! A TOML text as a tree of places: every value knows its line and its path, so that whatever is
//! wrong with it can be said with file, line, field, what was found and what is allowed.
//!
//! Scene files are read through this instead of through derived deserialisers because those know
//! no path, and because range, default and name of a field then stand in one line of code.

use super::SceneError;
use glam::Vec2;
use std::fmt;
use std::ops::Range as Bytes;
use toml::de::{DeTable, DeValue};

/// Characters of the file that an error quotes at most.
const QUOTE_CHARS_MAX: usize = 48;

/// The text and the name it has in errors.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    pub file: &'a str,
    pub source: &'a str,
}

/// Numbers that a field may hold.
#[derive(Clone, Copy)]
pub(super) struct Range {
    low: f32,
    high: f32,
    above_low: bool,
}

/// A table of the file whose keys are all known.
pub(super) struct Table<'a> {
    document: Document<'a>,
    path: String,
    at: Bytes<usize>,
    /// `None` stands for an empty table.
    entries: Option<&'a DeTable<'a>>,
    known: &'static [&'static str],
}

/// A value of the file.
pub(super) struct Field<'a> {
    document: Document<'a>,
    path: String,
    at: Bytes<usize>,
    value: &'a DeValue<'a>,
}

impl Range {
    /// `low` and `high` included.
    pub const fn from(low: f32, high: f32) -> Range {
        Range { low, high, above_low: false }
    }

    /// More than `low`, up to `high`.
    pub const fn above(low: f32, high: f32) -> Range {
        Range { low, high, above_low: true }
    }

    /// NaN and infinities lie in no range.
    pub fn contains(&self, value: f32) -> bool {
        value <= self.high && if self.above_low { value > self.low } else { value >= self.low }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.above_low {
            write!(out, "a number above {}, at most {}", self.low, self.high)
        } else {
            write!(out, "a number from {} to {}", self.low, self.high)
        }
    }
}

impl<'a> Document<'a> {
    /// An error at a byte of the text.
    pub fn error(&self, at: usize, field: &str, found: String, allowed: String) -> SceneError {
        let before = &self.source.as_bytes()[..at.min(self.source.len())];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        SceneError { file: self.file.to_owned(), line, field: field.to_owned(), found, allowed }
    }

    /// The text between two bytes on one line, shortened.
    fn quote(&self, at: &Bytes<usize>) -> String {
        let text = self.source.get(at.clone()).unwrap_or_default();
        let mut words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        if let Some((cut, _)) = words.char_indices().nth(QUOTE_CHARS_MAX) {
            words.truncate(cut);
            words.push_str("...");
        }
        words
    }
}

impl<'a> Table<'a> {
    /// The whole file; refuses keys that are not in `known`.
    pub fn root(
        document: Document<'a>,
        entries: &'a DeTable<'a>,
        known: &'static [&'static str],
    ) -> Result<Table<'a>, SceneError> {
        Table { document, path: String::new(), at: 0..0, entries: Some(entries), known }
            .refuse_unknown()
    }

    /// An empty table in the place of a missing one.
    pub fn as_if_empty(&self, name: &str, known: &'static [&'static str]) -> Table<'a> {
        let (path, at) = (self.path_of(name), self.at.clone());
        Table { document: self.document, path, at, entries: None, known }
    }

    fn refuse_unknown(self) -> Result<Table<'a>, SceneError> {
        let unknown = self
            .entries
            .into_iter()
            .flat_map(DeTable::keys)
            .filter(|key| !self.known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start);
        let Some(key) = unknown else { return Ok(self) };
        let allowed = format!("the fields {}", self.known.join(", "));
        let field = self.path_of(key.get_ref());
        Err(self.document.error(key.span().start, &field, "an unknown field".into(), allowed))
    }

    fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// The field, if the file has it. The name must be one of the known ones.
    pub fn get(&self, name: &str) -> Option<Field<'a>> {
        debug_assert!(self.known.contains(&name), "{name} is missing from the known fields");
        let value = self.entries?.get(name)?;
        Some(Field {
            document: self.document,
            path: self.path_of(name),
            at: value.span(),
            value: value.get_ref(),
        })
    }

    /// Whether the file has the field.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// The field, or an error that says what it may be.
    pub fn need(&self, name: &str, allowed: &str) -> Result<Field<'a>, SceneError> {
        self.get(name).ok_or_else(|| self.error(name, "nothing".into(), allowed.into()))
    }

    /// An error at a field, or at the table where the field would be.
    pub fn error(&self, name: &str, found: String, allowed: String) -> SceneError {
        let value = self.entries.and_then(|entries| entries.get(name));
        let at = value.map_or(self.at.start, |value| value.span().start);
        self.document.error(at, &self.path_of(name), found, allowed)
    }

    /// A number, or `default` where the file says nothing.
    pub fn number(&self, name: &str, default: f32, range: Range) -> Result<f32, SceneError> {
        self.get(name).map_or(Ok(default), |field| field.number(range))
    }

    /// A whole number, or `default` where the file says nothing.
    pub fn whole(&self, name: &str, default: u32, low: u32, high: u32) -> Result<u32, SceneError> {
        self.get(name).map_or(Ok(default), |field| field.whole(low, high))
    }

    /// Two numbers, or `default` where the file says nothing.
    pub fn vector(&self, name: &str, default: Vec2, range: Range) -> Result<Vec2, SceneError> {
        self.get(name).map_or(Ok(default), |field| field.vector(range))
    }

    /// A list of values; empty where the file says nothing.
    pub fn list(&self, name: &str) -> Result<Vec<Field<'a>>, SceneError> {
        self.get(name).map_or(Ok(Vec::new()), |field| field.list())
    }

    /// A table; `None` where the file says nothing.
    pub fn table(
        &self,
        name: &str,
        known: &'static [&'static str],
    ) -> Result<Option<Table<'a>>, SceneError> {
        self.get(name).map(|field| field.table(known)).transpose()
    }
}

impl<'a> Field<'a> {
    /// An error here that quotes the value.
    pub fn refuse(&self, allowed: impl Into<String>) -> SceneError {
        let found = match self.value {
            DeValue::Table(_) => "a table".to_owned(),
            _ => self.document.quote(&self.at),
        };
        self.refuse_as(found, allowed)
    }

    /// An error here.
    pub fn refuse_as(&self, found: impl Into<String>, allowed: impl Into<String>) -> SceneError {
        self.document.error(self.at.start, &self.path, found.into(), allowed.into())
    }

    /// A finite number in the range; whole numbers count.
    pub fn number(&self, range: Range) -> Result<f32, SceneError> {
        let value = match self.value {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok().map(|wide| wide as f32),
            DeValue::Integer(_) => self.integer().map(|whole| whole as f32),
            _ => None,
        };
        value.filter(|&number| range.contains(number)).ok_or_else(|| self.refuse(range.to_string()))
    }

    /// A whole number from `low` to `high`.
    pub fn whole(&self, low: u32, high: u32) -> Result<u32, SceneError> {
        self.integer()
            .and_then(|value| u32::try_from(value).ok())
            .filter(|value| (low..=high).contains(value))
            .ok_or_else(|| self.refuse(format!("a whole number from {low} to {high}")))
    }

    fn integer(&self) -> Option<i64> {
        let integer = self.value.as_integer()?;
        i64::from_str_radix(integer.as_str(), integer.radix()).ok()
    }

    /// `true` or `false`.
    pub fn truth(&self) -> Result<bool, SceneError> {
        self.value.as_bool().ok_or_else(|| self.refuse("true or false"))
    }

    /// A string of 1 to `chars_max` characters without control characters.
    pub fn text(&self, chars_max: usize) -> Result<String, SceneError> {
        self.value
            .as_str()
            .filter(|text| (1..=chars_max).contains(&text.chars().count()))
            .filter(|text| !text.chars().any(char::is_control))
            .map(str::to_owned)
            .ok_or_else(|| self.refuse(format!("a text of 1 to {chars_max} characters, one line")))
    }

    /// The string as it is, if it is one.
    pub fn word(&self) -> Option<&'a str> {
        self.value.as_str()
    }

    /// The position of the word in a list of choices.
    pub fn choice(&self, choices: &[&str]) -> Result<usize, SceneError> {
        self.word()
            .and_then(|word| choices.iter().position(|&choice| choice == word))
            .ok_or_else(|| self.refuse(one_of(choices)))
    }

    /// The values of a list.
    pub fn list(&self) -> Result<Vec<Field<'a>>, SceneError> {
        let DeValue::Array(array) = self.value else { return Err(self.refuse("a list")) };
        let item = |(index, value): (usize, &'a toml::Spanned<DeValue<'a>>)| Field {
            document: self.document,
            path: format!("{}[{index}]", self.path),
            at: value.span(),
            value: value.get_ref(),
        };
        Ok(array.iter().enumerate().map(item).collect())
    }

    /// Exactly `N` values of a list.
    pub fn items<const N: usize>(&self, allowed: &str) -> Result<[Field<'a>; N], SceneError> {
        let items = self.list().map_err(|_| self.refuse(allowed))?;
        items.try_into().map_err(|_| self.refuse(allowed))
    }

    /// Two numbers, each in the range.
    pub fn vector(&self, range: Range) -> Result<Vec2, SceneError> {
        let [x, y] = self.items(&format!("[x, y], each {range}"))?;
        Ok(Vec2::new(x.number(range)?, y.number(range)?))
    }

    /// Two corners, [[low x, low y], [high x, high y]].
    pub fn corners(&self, range: Range) -> Result<[Vec2; 2], SceneError> {
        let [low, high] = self.items(&format!("[[x, y], [x, y]], each {range}"))?;
        let (low, high) = (low.vector(range)?, high.vector(range)?);
        if low.x <= high.x && low.y <= high.y {
            return Ok([low, high]);
        }
        Err(self.refuse("a low corner that is not above the high one"))
    }

    /// A table; refuses keys that are not in `known`.
    pub fn table(&self, known: &'static [&'static str]) -> Result<Table<'a>, SceneError> {
        let DeValue::Table(entries) = self.value else { return Err(self.refuse("a table")) };
        let at = self.at.clone();
        Table {
            document: self.document,
            path: self.path.clone(),
            at,
            entries: Some(entries),
            known,
        }
        .refuse_unknown()
    }

    /// The field of this table, or the table itself where it has no such field. For checks of
    /// tables that were read before.
    pub fn inner(&self, name: &str) -> Field<'a> {
        let inner = self.value.as_table().and_then(|entries| entries.get(name));
        let (at, value) =
            inner.map_or((self.at.clone(), self.value), |inner| (inner.span(), inner.get_ref()));
        Field { document: self.document, path: format!("{}.{name}", self.path), at, value }
    }

    /// Names and values of a table whose keys are free, in order of the names.
    pub fn named(&self) -> Result<Vec<(&'a str, Field<'a>)>, SceneError> {
        let DeValue::Table(entries) = self.value else { return Err(self.refuse("a table")) };
        let entry = |(key, value): (&'a toml::Spanned<_>, &'a toml::Spanned<DeValue<'a>>)| {
            let name: &'a std::borrow::Cow<'a, str> = key.get_ref();
            let field = Field {
                document: self.document,
                path: format!("{}.{name}", self.path),
                at: value.span(),
                value: value.get_ref(),
            };
            (name.as_ref(), field)
        };
        Ok(entries.iter().map(entry).collect())
    }
}

/// "one of a, b, c".
pub(super) fn one_of<T: AsRef<str>>(choices: &[T]) -> String {
    let names: Vec<&str> = choices.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        "nothing: the list is empty".to_owned()
    } else {
        format!("one of {}", names.join(", "))
    }
}
