//! Checks citations of `docs/physics.md`: a number such as (A2.19) in a comment or document must be one of its rows.

use super::files::File;
use super::finding::Finding;
use regex::Regex;
use std::collections::BTreeSet;

const ROWS: &str = "docs/physics.md";
/// Stored results, in which such numbers have other meanings.
const RESULTS: &str = "docs/report/";
/// Comment markers by file extension. Documents are checked in full.
const COMMENTS: [(&str, &str); 6] =
    [(".rs", "//"), (".wgsl", "//"), (".js", "//"), (".toml", "#"), (".html", "<!--"), (".md", "")];
/// A letter from A to D, one or two digits and, in A, a second number. Rows of C may end in a letter.
const CITATION: &str = r"\b(?:[A-D]\d{1,2}(?:\.\d{1,2})?|C\d{1,2}[a-z])\b";

pub fn check(files: &[File]) -> Vec<Finding> {
    let Some(text) = files.iter().find(|file| file.path == ROWS).and_then(|f| f.text.as_ref())
    else {
        return vec![Finding::of(ROWS, "missing; citations need its rows; restore it")];
    };
    let citation = Regex::new(CITATION).expect("a valid pattern");
    let rows: BTreeSet<&str> =
        text.lines().filter_map(|line| line.strip_prefix("| ")?.split(' ').next()).collect();
    let mut findings = Vec::new();
    for file in files.iter().filter(|file| !file.path.starts_with(RESULTS)) {
        let Some((_, mark)) = COMMENTS.iter().find(|(end, _)| file.path.ends_with(end)) else {
            continue;
        };
        for (index, line) in file.text.iter().flat_map(|text| text.lines()).enumerate() {
            let comment = line.find(mark).map_or("", |at| &line[at..]);
            let cited = citation.find_iter(comment).map(|cited| cited.as_str());
            findings.extend(cited.filter(|row| !rows.contains(row)).map(|row| {
                let allowed = "citations name rows; add the row or correct the number";
                Finding::at(
                    &file.path,
                    index + 1,
                    format!("`{row}` is no row of {ROWS}; {allowed}"),
                )
            }));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::tidy::files::File;

    fn messages(path: &str, text: &str) -> Vec<String> {
        let rows = "# Physics\n| A2.19 | it falls |\n| B3 | it is square |\n| C22a | it ends |\n";
        let files = [File::text("docs/physics.md", rows), File::text(path, text)];
        check(&files).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_citation_of_a_row_that_is_not_there_is_found() {
        for row in ["A2.20", "A3.1", "B4", "C22", "C22b", "D1"] {
            let said = messages("sim/src/a.rs", &format!("fn f() {{}}\n// It falls ({row}).\n"));
            let expected = format!("sim/src/a.rs:2: `{row}` is no row of docs/physics.md");
            assert!(said.len() == 1 && said[0].starts_with(&expected), "{said:?}");
        }
        for (path, text) in
            [("a.toml", "x = 1 # (B9)"), ("a.md", "(B9)"), ("a.html", "<!-- B9. -->")]
        {
            assert_eq!(messages(path, text).len(), 1, "{path}");
        }
    }

    #[test]
    fn rows_that_exist_and_what_is_no_citation_are_accepted() {
        let text = "// It falls (A2.19, B3), as in C22a.\nlet a = B4; // F2, A10k, D65x, C, 0xC1\n";
        assert_eq!(messages("sim/src/a.rs", text), [""; 0]);
        assert_eq!(messages("docs/report/summary.md", "B9"), [""; 0]);
        assert_eq!(check(&[]).len(), 1, "the rows are needed");
    }
}
