//! Typed names, cut to the length that the protocol allows without splitting a user-perceived character, and random
//! names for new players. Only `Appearance::new` validates the content of a name.

use jostle_protocol::limits::{NAME_BYTES_MAX, NAME_CHARS_MAX};

const ADJECTIVES: [&str; 16] = [
    "Brave", "Bouncy", "Calm", "Clever", "Dizzy", "Fuzzy", "Gentle", "Happy", "Jolly", "Lucky",
    "Mellow", "Nimble", "Quick", "Sunny", "Swift", "Wobbly",
];
const ANIMALS: [&str; 16] = [
    "Badger", "Beaver", "Crab", "Ferret", "Fox", "Gecko", "Heron", "Koala", "Lemur", "Lynx",
    "Mole", "Newt", "Otter", "Owl", "Panda", "Puffin",
];

/// The prefix of `text` that fits the limits of a name, for a field in which the player is typing. Text that is short
/// enough is not changed, since a joiner at its end may be waiting for the next letter.
pub fn fit(text: &str) -> &str {
    let fits = |(count, (at, c)): &(usize, (usize, char))| {
        *count < NAME_CHARS_MAX && at + c.len_utf8() <= NAME_BYTES_MAX
    };
    let within = text.char_indices().enumerate().take_while(fits).last();
    let end = within.map_or(0, |(_, (at, c))| at + c.len_utf8());
    let (kept, rest) = text.split_at(end);
    if rest.is_empty() {
        return text;
    }
    // Two regional indicators together form one flag.
    let indicators = kept.chars().rev().take_while(|&c| is_regional(c)).count();
    let half_flag = indicators % 2 == 1 && rest.starts_with(is_regional);
    let kept = kept.strip_suffix(is_regional).filter(|_| half_flag).unwrap_or(kept);
    kept.trim_end_matches(is_dangling)
}

/// The name in a field: [`fit`] without trailing joiners and incomplete characters.
pub fn finished(text: &str) -> &str {
    fit(text).trim_end_matches(|c: char| c.is_whitespace() || is_dangling(c))
}

/// A friendly random name for a player without one.
pub fn friendly_name(random: u32) -> String {
    let adjective = ADJECTIVES[random as usize % ADJECTIVES.len()];
    let animal = ANIMALS[(random >> 8) as usize % ANIMALS.len()];
    format!("{adjective} {animal}")
}

fn is_regional(character: char) -> bool {
    matches!(character, '\u{1f1e6}'..='\u{1f1ff}')
}

/// Whether a character is meaningless at the end of a name, because it only modifies the next character, is a flag tag
/// without the final tag (U+E007F), or is the replacement character left by half a character.
fn is_dangling(character: char) -> bool {
    matches!(character, '\u{200c}' | '\u{200d}' | '\u{e0020}'..='\u{e007e}' | '\u{fffd}')
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_protocol::Appearance;

    const FAMILY: &str = "\u{1f469}\u{200d}\u{1f469}\u{200d}\u{1f467}";
    const ENGLAND: &str = "\u{1f3f4}\u{e0067}\u{e0062}\u{e0065}\u{e006e}\u{e0067}\u{e007f}";

    #[test]
    fn a_name_that_fits_stays_as_typed() {
        let long = "x".repeat(NAME_CHARS_MAX);
        for text in ["", "Ann ", "\u{645}\u{6cc}\u{200c}", FAMILY, ENGLAND, &long] {
            assert_eq!(fit(text), text);
        }
    }

    #[test]
    fn characters_are_counted_and_not_utf16_units() {
        assert_eq!(fit(&"\u{fc}".repeat(30)), "\u{fc}".repeat(NAME_CHARS_MAX));
        assert_eq!(fit(&"\u{1f642}".repeat(30)), "\u{1f642}".repeat(NAME_BYTES_MAX / 4));
    }

    #[test]
    fn truncation_leaves_no_invisible_part() {
        let after = |count: usize, tail: &str| fit(&("x".repeat(count) + tail)).to_owned();
        // The family's second joiner is the 20th character.
        assert_eq!(after(16, FAMILY), "x".repeat(16) + "\u{1f469}\u{200d}\u{1f469}");
        assert_eq!(after(16, ENGLAND), "x".repeat(16) + "\u{1f3f4}");
        let flags = "\u{1f1eb}\u{1f1ee}\u{1f1f8}\u{1f1ea}";
        assert_eq!(after(17, flags), "x".repeat(17) + "\u{1f1eb}\u{1f1ee}");
        assert_eq!(after(18, flags), "x".repeat(18) + "\u{1f1eb}\u{1f1ee}");
        assert_eq!(after(19, flags), "x".repeat(19));
    }

    #[test]
    fn a_finished_name_ends_with_a_visible_character() {
        for tail in ["\u{200d}", " \u{200c} ", "\u{fffd}", "\u{200d}\u{fffd}"] {
            assert_eq!(finished(&format!("Ann{tail}")), "Ann");
        }
        assert_eq!(finished(ENGLAND), ENGLAND);
        assert_eq!(finished(" \u{200d} "), "");
    }

    #[test]
    fn whatever_is_typed_the_name_is_not_too_long() {
        for text in ["x", "\u{fc}", FAMILY, ENGLAND, "\u{1f1eb}\u{1f1ee}", "a \u{301}"] {
            let name = finished(&text.repeat(40)).to_owned();
            assert!(Appearance::new(&name, 0).is_ok(), "{name:?}");
        }
    }

    #[test]
    fn friendly_names_are_valid_names() {
        for random in 0..=0xFFFF {
            let name = friendly_name(random);
            assert_eq!(Appearance::new(&name, 0).map(|a| a.name), Ok(name.into()));
        }
    }
}
