//! Lines that rules say, with the names of players in them.

use super::known::SENTENCE_CHARS_MAX;
use crate::scene::table::Field;

/// A line for the feed: the name of a player, a text, the name of another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Whose name comes first.
    pub first: Option<Whose>,
    /// The text between the names.
    pub text: String,
    /// Whose name comes last.
    pub last: Option<Whose>,
}

/// A player whom a line names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whose {
    /// `{it}`: the player whose hero it is about, or who touched that body last.
    It,
    /// `{by}`: who caused it.
    By,
}

const WORDS: [(&str, Whose); 2] = [("{it}", Whose::It), ("{by}", Whose::By)];

impl Line {
    /// Reads `say`; nothing where it is not given.
    pub(super) fn read(field: &Field) -> Option<Line> {
        if !field.is_given() {
            return None;
        }
        let text = field.text(SENTENCE_CHARS_MAX);
        let line = Line::of(&text);
        if line.text.trim().is_empty() || line.text.contains(['{', '}']) {
            field.refuse("a text that may begin and end with {it} or {by}");
        }
        Some(line)
    }

    fn of(text: &str) -> Line {
        let (mut text, mut first, mut last) = (text, None, None);
        for (word, whose) in WORDS {
            if let Some(rest) = text.strip_prefix(word) {
                (text, first) = (rest, Some(whose));
                break;
            }
        }
        for (word, whose) in WORDS {
            if let Some(rest) = text.strip_suffix(word) {
                (text, last) = (rest, Some(whose));
                break;
            }
        }
        Line { first, text: text.to_owned(), last }
    }

    /// Returns whether it names a player.
    pub(super) fn has_names(&self) -> bool {
        self.first.is_some() || self.last.is_some()
    }
}
