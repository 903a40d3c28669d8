//! A player's name and colour. Names are cleaned and checked only here.

use crate::error::{DecodeError, check};
use crate::limits::{COLORS, NAME_BYTES_MAX, NAME_CHARS_MAX};
use crate::wire::{Reader, Writer};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A player's name and colour, as others see them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Appearance {
    /// The name: 1..=20 characters after trimming, with no control characters.
    pub name: Arc<str>,
    /// Index into the palette of player colours.
    pub color: u8,
}

/// The reason why a name or colour was refused, which displays as a sentence for the player.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AppearanceError {
    /// The name has no visible characters.
    #[error("Please enter a name.")]
    NameEmpty,
    /// The name is too long.
    #[error("That name is too long: {NAME_CHARS_MAX} characters at most.")]
    NameTooLong,
    /// The name contains a character that is invisible or reorders the text around it.
    #[error("That name contains a character we can't display (U+{:04X}).", u32::from(*character))]
    NameForbidden {
        /// The first character that is not allowed.
        character: char,
    },
    /// There is no such colour.
    #[error("There is no colour {color}: allowed are 0 to {}.", COLORS - 1)]
    Color {
        /// The requested index.
        color: u8,
    },
}

impl Appearance {
    /// Cleans and checks a name. White space at the ends is trimmed, and white space inside the name becomes a single
    /// space. Letters from every script and emoji are allowed; control and format characters are not.
    pub fn new(name: &str, color: u8) -> Result<Appearance, AppearanceError> {
        if color >= COLORS {
            return Err(AppearanceError::Color { color });
        }
        // This is checked before anything is allocated, since the text may be arbitrarily long.
        let mut chars = name.trim().chars();
        if let Some(character) = first_of(chars.by_ref().take(NAME_CHARS_MAX * 8)) {
            return Err(AppearanceError::NameForbidden { character });
        }
        if chars.next().is_some() {
            return Err(AppearanceError::NameTooLong);
        }
        let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
        if !has_visible(&name) {
            return Err(AppearanceError::NameEmpty);
        }
        if name.len() > NAME_BYTES_MAX || name.chars().count() > NAME_CHARS_MAX {
            return Err(AppearanceError::NameTooLong);
        }
        Ok(Appearance { name: name.into(), color })
    }

    /// Returns the appearance with a number after the name, to distinguish it from a player with the same name. The
    /// name is shortened if the two do not fit.
    pub fn numbered(&self, number: usize) -> Appearance {
        let suffix = format!(" {number}");
        let mut base = self.name.to_string();
        while base.len() + suffix.len() > NAME_BYTES_MAX
            || base.chars().count() + suffix.len() > NAME_CHARS_MAX
        {
            base.pop();
        }
        Appearance { name: (base.trim_end().to_owned() + &suffix).into(), color: self.color }
    }

    pub(crate) fn write(&self, writer: &mut Writer) {
        writer.text(&self.name, NAME_BYTES_MAX);
        writer.byte(self.color);
    }

    /// Reads an appearance, refusing a name that is not already clean.
    pub(crate) fn read(reader: &mut Reader) -> Result<Appearance, DecodeError> {
        let name = reader.text(NAME_BYTES_MAX, "name")?;
        let color = reader.byte("color")?;
        let appearance = Appearance::new(name, color).map_err(|error| match error {
            AppearanceError::Color { .. } => DecodeError::OutOfRange { field: "color" },
            _ => DecodeError::OutOfRange { field: "name" },
        })?;
        check(&*appearance.name == name, "name")?;
        Ok(appearance)
    }
}

/// The first character in a text that is not allowed in names: one that is not drawn, reorders the text around it or is
/// for private use, or one mark too many ([`MARKS_MAX`]) on a letter.
pub fn first_forbidden(text: &str) -> Option<char> {
    first_of(text.chars())
}

fn first_of(mut chars: impl Iterator<Item = char>) -> Option<char> {
    let (mut marks, mut tags_left) = (0, 0);
    chars.find(|&character| {
        if tags_left > 0 && FLAG_TAGS.contains(&character) {
            tags_left -= 1;
            return false;
        }
        tags_left = if character == BLACK_FLAG { FLAG_TAGS_MAX } else { 0 };
        marks = if is_mark(character) { marks + 1 } else { 0 };
        marks > MARKS_MAX || is_forbidden(character)
    })
}

/// Returns whether a text contains a visible character.
pub fn has_visible(text: &str) -> bool {
    !text.chars().all(is_blank)
}

/// The first character of the flags of England, Scotland and Wales. It is followed by tag characters: the region's code
/// and a terminator.
const BLACK_FLAG: char = '\u{1f3f4}';
const FLAG_TAGS: RangeInclusive<char> = '\u{e0020}'..='\u{e007f}';
/// Five letters, such as `gbeng`, and the terminator.
const FLAG_TAGS_MAX: usize = 6;
/// Maximum number of marks on one letter: accents, vowel signs, joiners and variation selectors. Tibetan and pointed
/// Hebrew need three; larger stacks would cover the lines above.
const MARKS_MAX: usize = 4;

/// Whether a character is drawn on top of the one before it, or joins that one to the next. The standard library, which
/// knows Unicode's marks, escapes them only at the beginning of a text.
fn is_mark(character: char) -> bool {
    is_joiner(character) || is_escaped(character.escape_debug()) && is_printable(character)
}

fn is_joiner(character: char) -> bool {
    matches!(character, '\u{200c}' | '\u{200d}')
}

/// Whether Unicode assigns the character to something visible. Spaces other than the ordinary one do not count.
fn is_printable(character: char) -> bool {
    let text = String::from_iter(['a', character]);
    !is_escaped(text.escape_debug().skip(1))
}

fn is_escaped(mut escape: impl Iterator<Item = char>) -> bool {
    escape.next() == Some('\\') && escape.next() == Some('u')
}

/// Control characters, direction marks and overrides, format characters, private-use characters, unassigned codes, and
/// letters without ink. Joiners (U+200C, U+200D) are allowed, since Persian and emoji need them. White space is handled
/// elsewhere.
fn is_forbidden(character: char) -> bool {
    let blank_letter = matches!(
        character,
        '\u{34f}'
            | '\u{115f}'
            | '\u{1160}'
            | '\u{17b4}'
            | '\u{17b5}'
            | '\u{2800}'
            | '\u{3164}'
            | '\u{ffa0}'
    );
    let is_kept = character.is_whitespace() || is_joiner(character);
    blank_letter || !is_kept && (character.is_control() || !is_printable(character))
}

/// Whether a character leaves no ink. A name needs at least one that does.
fn is_blank(character: char) -> bool {
    character.is_whitespace()
        || matches!(
            character,
            '\u{34f}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' | '\u{200c}' | '\u{200d}'
                | '\u{2800}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{ffa0}'
                | '\u{e0000}'..='\u{e01ef}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> Result<String, AppearanceError> {
        Appearance::new(text, 0).map(|appearance| appearance.name.to_string())
    }

    #[test]
    fn spaces_are_trimmed_and_collapsed() {
        assert_eq!(name("  Ann \t\u{a0} Lee\n"), Ok("Ann Lee".to_owned()));
    }

    #[test]
    fn every_script_and_emoji_are_allowed() {
        for text in ["Ørsted", "محمد", "שרה", "日本語", "می‌خواهم", "👩‍👩‍👧", "❤️", "a\u{301}"]
        {
            assert_eq!(name(text), Ok(text.to_owned()));
        }
    }

    #[test]
    fn names_without_a_visible_character_are_refused() {
        for text in ["", "   ", "\u{a0}\u{3000}", "\u{200d}\u{fe0f}"] {
            assert_eq!(name(text), Err(AppearanceError::NameEmpty), "{text:?}");
        }
    }

    #[test]
    fn controls_and_direction_overrides_are_refused() {
        for character in [
            '\0',
            '\u{1b}',
            '\u{7f}',
            '\u{9f}',
            '\u{ad}',
            '\u{61c}',
            '\u{180e}',
            '\u{200b}',
            '\u{200f}',
            '\u{202e}',
            '\u{2067}',
            '\u{feff}',
            '\u{fff9}',
            '\u{e0041}',
        ] {
            let found = name(&format!("Ann{character}Lee"));
            assert_eq!(found, Err(AppearanceError::NameForbidden { character }));
        }
    }

    #[test]
    fn what_is_blank_private_or_not_assigned_is_refused() {
        // Letters without ink, private-use characters, noncharacters, and unassigned codes.
        for character in [
            '\u{2800}',
            '\u{3164}',
            '\u{ffa0}',
            '\u{115f}',
            '\u{34f}',
            '\u{e000}',
            '\u{f8ff}',
            '\u{f0000}',
            '\u{10fffd}',
            '\u{fdd0}',
            '\u{ffff}',
            '\u{378}',
            '\u{50000}',
        ] {
            let found = name(&format!("Ann{character}"));
            assert_eq!(found, Err(AppearanceError::NameForbidden { character }), "{character:?}");
        }
    }

    #[test]
    fn few_marks_stand_on_a_letter() {
        for text in [
            "Việt",
            "e\u{301}\u{323}\u{302}\u{307}e\u{301}",
            "שָׁלוֹם",
            "नमस्ते",
            "ที่นี่",
            "❤️‍🔥",
            "1️⃣",
            "👍🏽",
            "བསྒྲུབས",
        ] {
            assert_eq!(name(text), Ok(text.to_owned()));
        }
        let tags = "\u{e0067}\u{e0062}\u{e0073}\u{e0063}\u{e0074}\u{e007f}";
        assert!(name(&format!("Isla {BLACK_FLAG}{tags}")).is_ok(), "the flag of Scotland");
        for hidden in [format!("Isla{tags}"), format!("{BLACK_FLAG}{tags}\u{e007f}")] {
            assert!(name(&hidden).is_err(), "tags that belong to no flag");
        }
        let stacked = format!("a{}", "\u{301}".repeat(19));
        let refused = Err(AppearanceError::NameForbidden { character: '\u{301}' });
        assert_eq!(name(&stacked), refused);
        assert_eq!(first_forbidden(&stacked), Some('\u{301}'));
        assert_eq!(name(&stacked[..1 + 2 * 4]).map(|name| name.len()), Ok(9));
        for joiner in ['\u{200c}', '\u{200d}'] {
            let marks = "\u{301}".repeat(4);
            let refused = Err(AppearanceError::NameForbidden { character: joiner });
            assert_eq!(name(&format!("a{marks}{joiner}{marks}")), refused, "{joiner:?}");
        }
    }

    #[test]
    fn length_is_limited_in_characters_and_in_bytes() {
        assert_eq!(name(&"ü".repeat(20)), Ok("ü".repeat(20)));
        assert_eq!(name(&"ü".repeat(21)), Err(AppearanceError::NameTooLong));
        assert_eq!(name(&"🙂".repeat(16)), Ok("🙂".repeat(16)));
        assert_eq!(name(&"🙂".repeat(17)), Err(AppearanceError::NameTooLong));
        assert_eq!(name(&"x".repeat(100_000)), Err(AppearanceError::NameTooLong));
    }

    #[test]
    fn colours_are_limited() {
        assert!(Appearance::new("Ann", COLORS - 1).is_ok());
        assert_eq!(Appearance::new("Ann", COLORS), Err(AppearanceError::Color { color: COLORS }));
    }

    #[test]
    fn a_number_fits_after_any_name() {
        for text in ["Ann", "abcdefghij klmnopqr", "🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂🙂"]
        {
            let numbered = Appearance::new(text, 3).unwrap().numbered(12);
            assert!(numbered.name.ends_with(" 12"));
            assert_eq!(Appearance::new(&numbered.name, 3), Ok(numbered));
        }
    }

    #[test]
    fn errors_are_sentences() {
        let error = Appearance::new("a\u{202e}", 0).unwrap_err();
        assert_eq!(error.to_string(), "That name contains a character we can't display (U+202E).");
    }
}
