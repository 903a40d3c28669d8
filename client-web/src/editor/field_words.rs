//! The words of the form: a label, a sentence and a section of the documentation for each field. They are made from the
//! comments of the code that reads scenes, as `fields.txt`, which the page fetches when the editor first opens.

use crate::language::say;
use std::cell::Cell;

thread_local! {
    /// The address of the documentation on the first line, then the fields.
    static WORDS: Cell<&'static str> = const { Cell::new("") };
}

/// The words of the form for a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldWords {
    pub label: String,
    /// A sentence that explains the field, or empty.
    pub help: &'static str,
    /// The address of the field's section in the documentation, or empty.
    pub docs: String,
    /// Whether the field is folded away.
    pub is_expert: bool,
}

/// Learns the words of all fields.
pub fn learn(docs: &str, fields: &str) {
    WORDS.set([docs, fields].join("\n").leak());
}

pub fn are_known() -> bool {
    !WORDS.get().is_empty()
}

/// The words for the field with this path. Unknown fields are called by their names.
pub fn of(path: &str, name: &str) -> FieldWords {
    let general: String = path.chars().filter(|letter| !letter.is_ascii_digit()).collect();
    let (docs, fields) = WORDS.get().split_once('\n').unwrap_or_default();
    let known = fields.lines().find_map(|line| {
        let mut parts = line.split('\t');
        let is_it = parts.next()?.split(' ').any(|path| path == general);
        Some([parts.next()?, parts.next()?, parts.next()?]).filter(|_| is_it)
    });
    let Some([section, label, help]) = known else {
        let label = name.replace(['_', '.'], " ");
        return FieldWords { label, ..FieldWords::default() };
    };
    let expert = label.strip_prefix('+');
    let link = || [docs, "#", section].concat();
    FieldWords {
        label: say(expert.unwrap_or(label)).to_owned(),
        help: say(help),
        docs: if docs.is_empty() { String::new() } else { link() },
        is_expert: expert.is_some(),
    }
}
