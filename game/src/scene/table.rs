//! Reads scene files, which are TOML tables. Their fields are declared where they are read.
//!
//! A single call names a field together with its type, range and default: `table.get("mass").number(1.0,
//! Range::from(MASS_MIN, MASS_MAX))`. Fields that were never requested are unknown. Derived deserialisers are not
//! suitable: six tables share eight fields, and serde can either flatten shared fields or refuse unknown ones, but
//! not both.
//!
//! The same calls make the editor's form ([`FieldInfo`]) and, in tests, the tables of `docs/scenes.md`, the schema for text
//! editors and the classes of the Tiled project. A field's sentence there is the comment above its call, or above
//! the field of the type that the call fills.
//!
//! Readers never fail. They report errors to the [`Document`] and continue with the default, and
//! [`Document::checked`] returns the first error at the end. A table is therefore always read as a whole, and a
//! misspelled field is reported as unknown rather than as missing.

use super::decimal::parse_decimal;
use super::error::{GUESS, SceneError, line_at, nearest};
use super::field::{FieldForm, FieldInfo, Range};
#[cfg(test)]
use super::tests::reference::FieldNote;
use glam::Vec2;
use jostle_sim::TICKS_PER_SECOND;
use std::cell::{Cell, RefCell};
use std::fmt;
use std::ops::{Range as Bytes, RangeInclusive};
use toml::de::{DeTable, DeValue};

/// Maximum number of characters that an error quotes from the file.
const QUOTE_CHARS_MAX: usize = 48;
/// Number of recorded fields among which a field that is requested again is searched. No table has more.
const RECENT_FIELDS: usize = 64;

/// The text of a scene, its name in errors, and the first error found.
#[derive(Default)]
pub(super) struct Document<'a> {
    pub file: &'a str,
    pub source: &'a str,
    error: RefCell<Option<SceneError>>,
    /// All requested fields, if they are recorded, each with whether another field of its table rules it out.
    asked: Option<RefCell<Vec<(FieldInfo, bool)>>>,
    /// Whether a field that the file does not have is being read, to record what it may contain.
    reads_absent: Cell<bool>,
    /// What the documentation says about each field, if notes are wanted.
    #[cfg(test)]
    pub notes: Option<RefCell<Vec<FieldNote>>>,
}

/// A table in the file; a missing one reads as empty.
pub(super) struct Table<'a> {
    document: &'a Document<'a>,
    path: String,
    at: Bytes<usize>,
    entries: Option<&'a DeTable<'a>>,
    known: RefCell<Vec<&'static str>>,
}

/// A value in the file, which may be missing.
#[derive(Clone)]
pub(super) struct Field<'a> {
    document: &'a Document<'a>,
    path: String,
    at: Bytes<usize>,
    value: Option<&'a DeValue<'a>>,
    /// Whether the reader has a default, which it does not if the file must have the field, or if it may be absent.
    has_default: bool,
}

impl<'a> Document<'a> {
    pub fn new(file: &'a str, source: &'a str) -> Document<'a> {
        Document { file, source, ..Document::default() }
    }

    /// Creates a document that records the fields requested by its readers.
    pub fn noting(file: &'a str, source: &'a str) -> Document<'a> {
        Document { asked: Some(RefCell::default()), ..Document::new(file, source) }
    }

    /// The recorded fields that the file has or may have, in the order in which they were requested.
    pub fn into_asked(self) -> Vec<FieldInfo> {
        let asked = self.asked.map(RefCell::into_inner).unwrap_or_default();
        asked
            .into_iter()
            .filter(|(_, is_ruled_out)| !is_ruled_out)
            .map(|(field, _)| field)
            .collect()
    }

    pub fn root(&'a self, entries: &'a DeTable<'a>) -> Table<'a> {
        let (path, known) = (String::new(), RefCell::default());
        Table { document: self, path, at: 0..0, entries: Some(entries), known }
    }

    /// Creates an error at this byte of the text.
    pub fn error(&self, at: usize, field: &str, found: String, allowed: String) -> SceneError {
        let line = line_at(self.source.as_bytes(), at);
        SceneError { file: self.file.to_owned(), line, field: field.to_owned(), found, allowed }
    }

    /// Returns `value`, or the first reported error.
    pub fn checked<T>(&self, value: T) -> Result<T, SceneError> {
        self.error.take().map_or(Ok(value), Err)
    }

    fn is_good(&self) -> bool {
        self.error.borrow().is_none()
    }

    /// The text between two byte positions, cut to one line and shortened.
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
    /// Reads a table as a whole. An unknown field is reported in place of other errors within it.
    pub fn read<T>(&self, read: impl FnOnce(&Table<'a>) -> T) -> T {
        let was_good = self.document.is_good();
        let value = read(self);
        if was_good && let Some(error) = self.unknown_field() {
            self.document.error.replace(Some(error));
        }
        value
    }

    fn unknown_field(&self) -> Option<SceneError> {
        let known = self.known.borrow();
        let unknown = self
            .entries?
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start)?;
        let allowed = match nearest(unknown.get_ref(), &known) {
            Some(name) => format!("{GUESS}{name}?"),
            None => format!("the fields {}", known.join(", ")),
        };
        let field = path_of(&self.path, unknown.get_ref());
        Some(self.document.error(unknown.span().start, &field, "an unknown field".into(), allowed))
    }

    /// Returns a field and marks it as known, whether or not the file has it.
    pub fn get(&self, name: &'static str) -> Field<'a> {
        let mut known = self.known.borrow_mut();
        if !known.contains(&name) {
            known.push(name);
        }
        let value = self.entries.and_then(|entries| entries.get(name));
        let field = Field {
            document: self.document,
            path: path_of(&self.path, name),
            at: value.map_or(self.at.clone(), |value| value.span()),
            value: value.map(|value| value.get_ref()),
            has_default: true,
        };
        #[cfg(test)]
        field.remark(|_| ());
        field
    }

    /// Returns a field that the file must have.
    pub fn need(&self, name: &'static str, allowed: &str) -> Field<'a> {
        let field = Field { has_default: false, ..self.get(name) };
        #[cfg(test)]
        field.remark(|note| note.needed = Some(allowed.to_owned()));
        if !field.is_given() {
            field.refuse(allowed);
        }
        field
    }

    /// Refuses the second of two fields if the first is given too.
    pub fn not_both(&self, one: &'static str, other: &'static str) {
        let [first, second] = [one, other].map(|name| self.get(name));
        match [&first, &second].map(Field::is_given) {
            [true, true] => second.refuse_as(format!("{one} and {other}"), "only one of the two"),
            [true, false] => second.rule_out(),
            [false, true] => first.rule_out(),
            [false, false] => {}
        }
    }
}

impl<'a> Field<'a> {
    /// Returns whether the file has the field.
    pub fn is_given(&self) -> bool {
        self.value.is_some()
    }

    /// Reads a field that has no default. Where fields are recorded, an absent one is read too.
    pub fn given<T>(&self, read: impl FnOnce(&Field<'a>) -> T) -> Option<T> {
        #[cfg(test)]
        let is_noted = self.remark(|note| note.is_optional = true);
        #[cfg(not(test))]
        let is_noted = false;
        if self.is_given() {
            return Some(read(self));
        }
        if is_noted || self.document.asked.is_some() {
            let outside = self.document.reads_absent.replace(true);
            read(&Field { has_default: false, ..self.clone() });
            self.document.reads_absent.set(outside);
        }
        None
    }

    /// Tells the documentation which values are allowed, if no single call says so.
    pub fn describe(&self, _allowed: impl fmt::Display) {
        #[cfg(test)]
        self.remark(|note| note.describe(_allowed.to_string()));
    }

    /// Changes the note about this field, if notes are wanted. Values in lists have none.
    #[cfg(test)]
    fn remark(&self, change: impl FnOnce(&mut FieldNote)) -> bool {
        let Some(notes) = &self.document.notes else { return false };
        if !self.path.ends_with(']') {
            change(FieldNote::of(&mut notes.borrow_mut(), &self.path));
        }
        true
    }

    /// Refuses a field that would have a meaning only with another one that the file lacks; `allowed` says so.
    pub fn refuse_if_given(&self, allowed: &str) {
        if self.is_given() {
            self.refuse(allowed);
        } else {
            self.rule_out();
        }
    }

    /// Records that the file may not have this field, because of another one that it has or lacks.
    fn rule_out(&self) {
        if !self.document.reads_absent.get() {
            self.record(|| FieldForm::Truth { default: false }, true);
        }
    }

    /// Path of the field, such as `layouts[2].count`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Reports an error that quotes the value.
    pub fn refuse(&self, allowed: impl Into<String>) {
        let found = match self.value {
            None => "nothing".to_owned(),
            Some(DeValue::Table(_)) => "a table".to_owned(),
            Some(_) => self.document.quote(&self.at),
        };
        self.refuse_as(found, allowed);
    }

    pub fn refuse_as(&self, found: impl Into<String>, allowed: impl Into<String>) {
        if self.document.is_good() {
            let error =
                self.document.error(self.at.start, &self.path, found.into(), allowed.into());
            self.document.error.replace(Some(error));
        }
    }

    /// Records the field and its form, if fields are being recorded. Entries of lists of values are not fields.
    fn note(&self, form: impl Fn() -> FieldForm) {
        #[cfg(test)]
        self.remark(|note| note.keep(form()));
        self.record(form, false);
    }

    fn record(&self, form: impl Fn() -> FieldForm, is_ruled_out: bool) {
        let Some(asked) = &self.document.asked else { return };
        let mut asked = asked.borrow_mut();
        // A field is requested again only while its table is read, so that the search can be short.
        let mut recent = asked.iter_mut().rev().take(RECENT_FIELDS);
        if let Some(known) = recent.find(|(known, _)| known.path == self.path) {
            known.1 |= is_ruled_out;
        } else if !self.path.ends_with(']') {
            let (path, has_default) = (self.path.clone(), self.has_default);
            let given = self.is_given().then(|| self.at.clone());
            asked.push((FieldInfo { path, given, form: form(), has_default }, is_ruled_out));
        }
    }

    /// Applies `wanted` to the value, if the file has one, and reports an error if it returns `None`.
    fn parse<T>(
        &self,
        wanted: impl FnOnce(&'a DeValue<'a>) -> Option<T>,
        allowed: impl Fn() -> String,
    ) -> Option<T> {
        #[cfg(test)]
        self.remark(|note| note.allow(allowed()));
        let found = wanted(self.value?);
        if found.is_none() {
            self.refuse(allowed());
        }
        found
    }

    /// A finite number within the range; integers are accepted.
    pub fn number(&self, default: f32, range: Range) -> f32 {
        self.note(|| FieldForm::Number { range: range.ends(), above: range.above_low, default });
        let number = |value| number_of(value).filter(|&number| range.contains(number));
        self.parse(number, || range.to_string()).unwrap_or(default)
    }

    /// A number of seconds, as whole ticks.
    pub fn ticks(&self, default: f32, range: Range) -> u32 {
        #[cfg(test)]
        self.remark(|note| note.allow(format!("{range} s")));
        (self.number(default, range) * TICKS_PER_SECOND as f32 + 0.5) as u32
    }

    /// Returns whether the value is a number, whatever its range.
    pub fn is_number(&self) -> bool {
        self.value.is_some_and(|value| number_of(value).is_some())
    }

    /// A whole number in the range.
    pub fn whole(&self, default: u32, range: RangeInclusive<u32>) -> u32 {
        let ends = || [i64::from(*range.start()), i64::from(*range.end())];
        self.note(|| FieldForm::Whole { range: ends(), default: default.into() });
        let whole = |value| u32::try_from(integer_of(value)?).ok().filter(|n| range.contains(n));
        let allowed = || format!("a whole number from {} to {}", range.start(), range.end());
        self.parse(whole, allowed).unwrap_or(default)
    }

    /// An integer with a magnitude of at most `max`.
    pub fn signed(&self, default: i32, max: i32) -> i32 {
        let ends = [-i64::from(max), i64::from(max)];
        self.note(|| FieldForm::Whole { range: ends, default: default.into() });
        let fits = |number: &i32| number.abs() <= max;
        let signed = |value| i32::try_from(integer_of(value)?).ok().filter(fits);
        self.parse(signed, || format!("a whole number from -{max} to {max}")).unwrap_or(default)
    }

    pub fn truth(&self, default: bool) -> bool {
        self.note(|| FieldForm::Truth { default });
        self.parse(DeValue::as_bool, || "true or false".to_owned()).unwrap_or(default)
    }

    /// A string of 1 to `chars_max` characters without control characters; empty if the value is wrong.
    pub fn text(&self, chars_max: usize) -> String {
        self.note(|| FieldForm::Text { chars_max });
        let text = |value: &'a DeValue<'a>| {
            let text = value.as_str()?;
            let fits = (1..=chars_max).contains(&text.chars().count());
            (fits && !text.chars().any(char::is_control)).then_some(text)
        };
        let allowed = || format!("a text of 1 to {chars_max} characters, one line");
        self.parse(text, allowed).unwrap_or_default().to_owned()
    }

    /// The unchecked string, if the value is one.
    pub fn word(&self) -> Option<&'a str> {
        self.value?.as_str()
    }

    /// The index of the value in a list of names.
    pub fn index_in<T: AsRef<str>>(&self, names: &[T]) -> Option<usize> {
        let words = || names.iter().map(|name| name.as_ref().to_owned()).collect();
        self.note(|| FieldForm::Choice { names: words() });
        let index = |value: &DeValue| {
            let word = value.as_str()?;
            names.iter().position(|name| name.as_ref() == word)
        };
        self.parse(index, || one_of(names))
    }

    /// The choice named by the value.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Option<T> {
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        self.index_in(&names).map(|index| choices[index].1)
    }

    /// The choice that the string names; if there is no string, the first choice.
    pub fn choice_or_first<T: Copy>(&self, choices: &[(&str, T)]) -> T {
        #[cfg(test)]
        self.remark(|note| note.default = Some(choices[0].0.to_owned()));
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        choices[self.index_in(&names).unwrap_or(0)].1
    }

    /// The values of a list.
    pub fn items(&self) -> Vec<Field<'a>> {
        let array = self.parse(DeValue::as_array, || "a list".to_owned());
        let items = array.into_iter().flat_map(|array| array.iter().enumerate());
        items.map(|(index, item)| self.inside(format!("{}[{index}]", self.path), item)).collect()
    }

    /// Like [`Field::items`], with a word for what the items are.
    pub fn items_of(&self, things: &str) -> Vec<Field<'a>> {
        self.describe(things);
        self.items()
    }

    /// The values of a list whose length is within the range.
    pub fn some_items(&self, count: RangeInclusive<usize>, allowed: &str) -> Vec<Field<'a>> {
        self.describe(allowed);
        let items = self.items();
        if self.is_given() && !count.contains(&items.len()) {
            self.refuse(allowed);
        }
        items
    }

    /// The value itself, or the values of a list of 1 to `max` entries.
    pub fn one_or_more(&self, max: usize) -> Vec<Field<'a>> {
        match self.value {
            None => Vec::new(),
            Some(DeValue::Array(_)) => self.some_items(1..=max, &format!("1 to {max} values")),
            Some(_) => vec![self.clone()],
        }
    }

    /// Exactly `N` values of a list, each read by the same function.
    pub fn array<const N: usize, T: Copy>(
        &self,
        default: [T; N],
        allowed: impl Fn() -> String,
        read: impl Fn(&Field<'a>, T) -> T,
    ) -> [T; N] {
        let is_it = |value: &'a DeValue<'a>| value.as_array().filter(|array| array.len() == N);
        if self.parse(is_it, allowed).is_none() {
            return default;
        }
        let items = self.items();
        std::array::from_fn(|index| read(&items[index], default[index]))
    }

    /// Two numbers, each in the range.
    pub fn vector(&self, default: Vec2, range: Range) -> Vec2 {
        self.note(|| FieldForm::Vector { range: range.ends(), default: default.to_array() });
        let allowed = || format!("[x, y], each {range}");
        self.array(default.to_array(), allowed, |item, base| item.number(base, range)).into()
    }

    /// Two corners, [[low x, low y], [high x, high y]].
    pub fn corners(&self, default: [Vec2; 2], range: Range) -> [Vec2; 2] {
        let allowed = || format!("[[x, y], [x, y]], each {range}");
        let [low, high] = self.array(default, allowed, |item, base| item.vector(base, range));
        if low.x > high.x || low.y > high.y {
            self.refuse("a low corner that is not above the high one");
        }
        [low, high]
    }

    /// Reads a table; a missing one reads as empty.
    pub fn table<T>(&self, read: impl FnOnce(&Table<'a>) -> T) -> T {
        self.table_or("a table", read)
    }

    /// Like [`Field::table`], for a field where something else is allowed too.
    pub fn table_or<T>(&self, allowed: &str, read: impl FnOnce(&Table<'a>) -> T) -> T {
        let entries = self.parse(DeValue::as_table, || allowed.to_owned());
        let (path, at) = (self.path.clone(), self.at.clone());
        Table { document: self.document, path, at, entries, known: RefCell::default() }.read(read)
    }

    /// Returns a field of this table, or the table itself if it has no such field. Used by checks on tables that have
    /// already been read.
    pub fn inner(&self, name: &str) -> Field<'a> {
        let inner = self.value.and_then(DeValue::as_table).and_then(|entries| entries.get(name));
        let path = path_of(&self.path, name);
        match inner {
            Some(value) => self.inside(path, value),
            None => Field { path, ..self.clone() },
        }
    }

    /// Returns whether this table has a field.
    pub fn has(&self, name: &str) -> bool {
        self.value.and_then(DeValue::as_table).is_some_and(|entries| entries.contains_key(name))
    }

    /// Names and values of a table with arbitrary keys, sorted by name.
    pub fn named(&self) -> Vec<(&'a str, Field<'a>)> {
        let table = self.parse(DeValue::as_table, || "a table".to_owned());
        let entries = table.into_iter().flat_map(DeTable::iter);
        let named = entries.map(|(key, value)| {
            let name = key.get_ref().as_ref();
            (name, self.inside(path_of(&self.path, name), value))
        });
        named.collect()
    }

    fn inside(&self, path: String, value: &'a toml::Spanned<DeValue<'a>>) -> Field<'a> {
        let (document, at, value) = (self.document, value.span(), Some(value.get_ref()));
        Field { document, path, at, value, has_default: true }
    }
}

/// Reads the tables of a list with at most `max` entries.
pub(super) fn read_list<T>(
    root: &Table,
    name: &'static str,
    max: usize,
    mut read: impl FnMut(&Table) -> T,
) -> Vec<T> {
    let field = root.get(name);
    let entries = field.items();
    if entries.len() > max {
        field.refuse_as(format!("{} entries", entries.len()), format!("at most {max}"));
    }
    entries.iter().map(|entry| entry.table(&mut read)).collect()
}

fn path_of(table: &str, name: &str) -> String {
    if table.is_empty() { name.to_owned() } else { format!("{table}.{name}") }
}

fn number_of(value: &DeValue) -> Option<f32> {
    match value {
        DeValue::Float(float) => parse_decimal(float.as_str()).map(|wide| wide as f32),
        _ => integer_of(value).map(|whole| whole as f32),
    }
}

fn integer_of(value: &DeValue) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// Formats choices as "one of a, b, c".
pub(super) fn one_of<T: AsRef<str>>(choices: impl IntoIterator<Item = T>) -> String {
    let names: Vec<T> = choices.into_iter().collect();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        "nothing: the list is empty".to_owned()
    } else {
        format!("one of {}", names.join(", "))
    }
}
