//! The words of the editor's form, which the page fetches when the editor opens.

use super::formats::plain;
use super::{Reference, TABLE_START};

/// What the paths of the form's fields begin with; the other ones are fields of the scene itself.
const SHOWN: [&str; 8] = [
    "limits.",
    "hero.",
    "bodies[].",
    "layouts[].",
    "launchers[].",
    "emitters[].",
    "zones[].",
    "round.",
];

impl Reference {
    /// A line for each field that the form shows: its paths, the section of the guide that describes it, its label,
    /// with a `+` before it if the field is for experts, and its sentence, separated by tabs.
    pub fn words(&self, _: &str) -> String {
        let mut words = String::new();
        for (rows, section) in self.tables.iter().zip(&self.sections) {
            for row in rows.iter().filter(|row| row.field.form.is_some()) {
                let paths: Vec<&str> = row.paths.iter().map(String::as_str).collect();
                let is_shown = |path: &str| {
                    !path.contains(['.', '[']) || SHOWN.iter().any(|start| path.starts_with(start))
                };
                let paths: Vec<&str> = paths.into_iter().filter(|path| is_shown(path)).collect();
                if paths.is_empty() {
                    continue;
                }
                let label = row.sentence.label.as_ref();
                let label = label.unwrap_or_else(|| {
                    panic!("no label for {paths:?}: write \"Label: Its name\" after its sentence")
                });
                let label = match label.strip_suffix(", for experts") {
                    Some(label) => format!("+{label}"),
                    None => label.clone(),
                };
                let sentence = plain(&row.sentence.text);
                words += &format!("{}\t{section}\t{label}\t{sentence}\n", paths.join(" "));
            }
        }
        words
    }
}

/// For each table of the guide, the section that contains it, as links name it: the heading's letters, digits and
/// dashes, and a number if an earlier heading has the same.
pub fn sections(guide: &str) -> Vec<String> {
    let (mut sections, mut headings, mut in_code) = (Vec::new(), Vec::<String>::new(), false);
    for line in guide.lines() {
        in_code ^= line.starts_with("```");
        if line.starts_with(TABLE_START) {
            sections.push(headings.last().cloned().unwrap_or_default());
        }
        let Some((_, heading)) =
            line.split_once("# ").filter(|_| line.starts_with('#') && !in_code)
        else {
            continue;
        };
        let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
        let link: String = heading.to_lowercase().chars().filter(kept).collect();
        let link = link.replace(' ', "-");
        let numbered = (1..).map(|number| format!("{link}-{number}"));
        let mut free = std::iter::once(link.clone()).chain(numbered);
        headings.extend(free.find(|link| !headings.contains(link)));
    }
    sections
}
