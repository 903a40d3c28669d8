//! Names that look alike. A room numbers namesakes; here a name that only looks like another's is made its
//! namesake, so that nobody can pass for somebody else.

use std::sync::Arc;
use unicode_security::confusable_detection::skeleton;

/// The name to ask a room for: the wanted one, or the one of the `others` that it looks like.
pub fn unmistakable<'a>(
    wanted: &Arc<str>,
    others: impl Iterator<Item = &'a Arc<str>> + Clone,
) -> Arc<str> {
    // A namesake is numbered by the room, and whoever else it looks like has a number already.
    if others.clone().any(|other| other == wanted) {
        return Arc::clone(wanted);
    }
    let looks: String = skeleton(wanted).collect();
    let mut others = others;
    let double = others.find(|other| skeleton(other).eq(looks.chars()));
    Arc::clone(double.unwrap_or(wanted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_looks_like_anothers_becomes_its_namesake() {
        let others: [Arc<str>; 3] = ["Ann".into(), "Bill".into(), "Zoë".into()];
        let name = |wanted: &str| unmistakable(&wanted.into(), others.iter()).to_string();
        // Cyrillic A, Greek Alpha, full width, an I for an l, and an accent written apart.
        for (wanted, double) in [
            ("\u{410}nn", "Ann"),
            ("\u{391}nn", "Ann"),
            ("\u{ff21}nn", "Ann"),
            ("BiIl", "Bill"),
            ("Bi1l", "Bill"),
            ("Zoe\u{308}", "Zoë"),
            ("Ann", "Ann"),
        ] {
            assert_eq!(name(wanted), double, "{wanted:?}");
        }
        for wanted in ["Anna", "ann", "Zoe", "Anne", "\u{4e2d}"] {
            assert_eq!(name(wanted), wanted);
        }
    }
}
