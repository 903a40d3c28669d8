//! The languages of the page. English texts are in the code and in `index.html`, and serve as keys. Every other
//! language has a file in `web`, which contains each sentence in both languages and is fetched when first used.
//!
//! Sentences in the code go through [`say`], or through [`fill`] if they have placeholders. A test finds sentences that
//! lack a translation.

use std::cell::RefCell;

thread_local! {
    /// The sentences of the current language. Each frame looks up a few dozen of several hundred.
    static TABLE: RefCell<Vec<(&'static str, &'static str)>> = const { RefCell::new(Vec::new()) };
}

/// Loads the sentences of a language file. With an empty file, the page is in English.
pub fn speak(file: &'static str) {
    TABLE.with_borrow_mut(|table| *table = pairs(file).collect());
}

/// Translates an English sentence; unknown sentences are returned unchanged.
#[inline(never)]
pub fn say(english: &str) -> &str {
    let known = |table: &Vec<(&str, &'static str)>| {
        table.iter().find(|entry| entry.0 == english).map(|entry| entry.1)
    };
    TABLE.with_borrow(known).unwrap_or(english)
}

/// Translates an English sentence and replaces its `{placeholders}`.
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

/// Translates an English sentence and splits it at its placeholder.
pub fn around(english: &str) -> (&str, &str) {
    let sentence = say(english);
    placeholder(sentence).map_or((sentence, ""), |(before, _, after)| (before, after))
}

/// Translates an English sentence and splits it at its placeholders: each text, possibly empty, with the name of the
/// placeholder after it, which is empty at the end.
pub fn pieces(english: &str) -> Vec<(&str, &str)> {
    let (mut pieces, mut rest) = (Vec::new(), say(english));
    while let Some((before, name, after)) = placeholder(rest) {
        pieces.push((before, name));
        rest = after;
    }
    pieces.push((rest, ""));
    pieces
}

/// The text before the first placeholder, the placeholder's name, and the rest.
fn placeholder(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once('{')?;
    let (name, after) = rest.split_once('}')?;
    Some((before, name, after))
}

/// The entries of a language file. Each is a line of English, followed by a line with a tab and the translation. Lines
/// that begin with `#` are comments.
fn pairs(file: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut lines = file.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    std::iter::from_fn(move || {
        Some((lines.next()?, lines.next()?.strip_prefix('\t').unwrap_or_default()))
    })
}

#[cfg(test)]
mod tests;
