//! Names that look alike. A room numbers players who have the same name. Here, confusable names are treated as the
//! same, so that no player can impersonate another.

use std::sync::Arc;
use unicode_security::confusable_detection::skeleton;

/// The name to use in a room: the wanted name, or the one among the `others` that it resembles.
pub fn unmistakable<'a>(
    wanted: &Arc<str>,
    others: impl Iterator<Item = &'a Arc<str>> + Clone,
) -> Arc<str> {
    let looks: String = skeleton(base(wanted)).collect();
    let mut others = others;
    let double =
        others.find(|other| base(other) != base(wanted) && skeleton(base(other)).eq(looks.chars()));
    Arc::clone(double.unwrap_or(wanted))
}

/// A guest's scene's title in lists. A title that resembles the title of one of the server's own scenes is marked as a
/// guest's.
pub fn guests_title<'a>(title: &str, mut own: impl Iterator<Item = &'a str>) -> String {
    let looks = looks_of(title);
    match own.any(|own| looks_of(own).iter().any(|look| !look.is_empty() && looks.contains(look))) {
        true => format!("{title} (guest)"),
        false => title.to_owned(),
    }
}

/// The skeleton of a title without its number, reduced to letters and digits, both as written and in lower case.
fn looks_of(title: &str) -> [String; 2] {
    let base = base(title.trim());
    [base.to_owned(), base.to_lowercase()]
        .map(|text| skeleton(&text).filter(|character| character.is_alphanumeric()).collect())
}

/// A name without the number that a room added.
fn base(name: &str) -> &str {
    match name.rsplit_once(' ') {
        Some((base, number)) if number.bytes().all(|byte| byte.is_ascii_digit()) => base,
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_guests_title_that_looks_like_one_of_the_servers_says_whose_it_is() {
        let title = |title: &str| guests_title(title, ["Arena", "Lock", "Tower"].into_iter());
        for same in ["Arena", "ARENA", " Arena.", "Arena 2", "\u{410}rena", "Iock", "A r e n a"] {
            assert_eq!(title(same), format!("{same} (guest)"));
        }
        for other in ["A pit", "Arenas", "My arena", "\u{4e2d}"] {
            assert_eq!(title(other), other);
        }
    }

    #[test]
    fn a_name_that_looks_like_anothers_becomes_its_namesake() {
        let others: [Arc<str>; 4] = ["Ann".into(), "Bill".into(), "Zoë".into(), "Max 2".into()];
        let name = |wanted: &str| unmistakable(&wanted.into(), others.iter()).to_string();
        // A Cyrillic A, a Greek alpha, a full-width letter, an I for an l, and a separate combining accent.
        for (wanted, double) in [
            ("\u{410}nn", "Ann"),
            ("\u{391}nn", "Ann"),
            ("\u{ff21}nn", "Ann"),
            ("BiIl", "Bill"),
            ("Bi1l", "Bill"),
            ("Zoe\u{308}", "Zoë"),
            ("Ann", "Ann"),
            ("\u{41c}ax", "Max 2"),
            ("\u{41c}ax 2", "Max 2"),
            ("\u{41c}ax 7", "Max 2"),
        ] {
            assert_eq!(name(wanted), double, "{wanted:?}");
        }
        for wanted in ["Anna", "ann", "Zoe", "Anne", "\u{4e2d}", "Max", "Max 3"] {
            assert_eq!(name(wanted), wanted);
        }
    }
}
