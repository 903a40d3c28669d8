//! The page's languages. English stands in the program and in `index.html`, and is the key of every other
//! language: a file of `web` that holds each sentence in both, and is fetched when it is first used.
//!
//! A sentence of the program goes through [`say`], or through [`fill`] if it has placeholders. A test finds those
//! that a language lacks.

use std::cell::RefCell;

thread_local! {
    /// The sentences of the language; a few hundred, and some tens are said in a frame.
    static TABLE: RefCell<Vec<(&'static str, &'static str)>> = const { RefCell::new(Vec::new()) };
}

/// Takes over the sentences of a language's file; without any the page speaks English.
pub fn speak(file: &'static str) {
    TABLE.with_borrow_mut(|table| *table = pairs(file).collect());
}

/// An English sentence in the page's language; a sentence that is not known stays as it is.
#[inline(never)]
pub fn say(english: &str) -> &str {
    let known = |table: &Vec<(&str, &'static str)>| {
        table.iter().find(|entry| entry.0 == english).map(|entry| entry.1)
    };
    TABLE.with_borrow(known).unwrap_or(english)
}

/// An English sentence in the page's language, with its `{placeholders}` replaced by what they stand for.
#[inline(never)]
pub fn fill(english: &str, parts: &[(&str, &str)]) -> String {
    let mut rest = say(english);
    let mut filled = String::new();
    while let Some((before, name, after)) = placeholder(rest) {
        filled += before;
        filled += parts.iter().find(|part| part.0 == name).map_or("", |part| part.1);
        rest = after;
    }
    filled + rest
}

/// The parts of an English sentence before and after its placeholder, in the page's language.
pub fn around(english: &str) -> (&str, &str) {
    let sentence = say(english);
    placeholder(sentence).map_or((sentence, ""), |(before, _, after)| (before, after))
}

/// The text before the first placeholder, the placeholder's name, and the rest.
fn placeholder(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once('{')?;
    let (name, after) = rest.split_once('}')?;
    Some((before, name, after))
}

/// The entries of a file: a line of English, and below it the other language after a tab. Lines that begin with
/// `#` are comments.
fn pairs(file: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut lines = file.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    std::iter::from_fn(move || {
        Some((lines.next()?, lines.next()?.strip_prefix('\t').unwrap_or_default()))
    })
}

#[cfg(test)]
mod tests;
