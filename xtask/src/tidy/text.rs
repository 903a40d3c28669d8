//! Checks individual lines for text that is forbidden in source files.

use super::files::File;
use super::finding::Finding;
use regex::Regex;

/// Patterns that no line of a text file may match, each with a remedy. They are written so that they do not match
/// themselves.
const EVERYWHERE: [(&str, &str); 4] = [
    (
        r"(?:^|[^\w.}-])/(?:home|root|tmp|work|Users)/",
        "path of one machine; paths hold anywhere; read it from the environment",
    ),
    (r"#\[ignore", "ignored test; every test runs; mend it or remove it"),
    (
        r"assert!\(true\)",
        "assertion that cannot fail; assertions check something; mend it or remove it",
    ),
    (r"\b(?:todo|unimplemented|dbg)!\(", "unfinished; only finished work is committed; finish it"),
];
/// Crates whose results may depend only on their input.
const PURE_CRATES: [&str; 4] = ["sim/src/", "game/src/", "protocol/src/", "room/src/"];
/// Names that would break purity or determinism. Clippy forbids functions whose results differ between machines; see
/// `sim/clippy.toml`.
const IMPURE: [&str; 7] =
    ["std::env", "std::fs", "std::net", "std::thread", "std::time", "HashMap", "HashSet"];
const ARCHITECTURE_LINES_MAX: usize = 199;
/// Rust files with more lines than this are listed, so that someone can check whether they still have a single subject.
const RUST_LINES_NOTED: usize = 600;
const TEXT_ENDINGS: [&str; 10] =
    [".rs", ".toml", ".md", ".wgsl", ".html", ".css", ".js", ".sh", ".yml", ".json"];

pub fn check(files: &[File]) -> Vec<Finding> {
    let everywhere =
        EVERYWHERE.map(|(pattern, fault)| (Regex::new(pattern).expect("a valid pattern"), fault));
    let mut findings = Vec::new();
    for file in files {
        let Some(text) = &file.text else { continue };
        let is_text = TEXT_ENDINGS.iter().any(|ending| file.path.ends_with(ending));
        for (index, line) in text.lines().enumerate().filter(|_| is_text) {
            let faults = everywhere.iter().filter(|(pattern, _)| pattern.is_match(line));
            findings.extend(faults.map(|(_, fault)| Finding::at(&file.path, index + 1, *fault)));
            findings
                .extend(impure(file, line).map(|fault| Finding::at(&file.path, index + 1, fault)));
        }
        // A test file needs no explanation besides the code that it tests.
        let is_explained = text.starts_with("//!") || file.path.ends_with("/tests.rs");
        if file.path.ends_with(".rs") && !is_explained {
            let fault = "does not open with `//!`; each file says what lives in it; add that line";
            findings.push(Finding::of(&file.path, fault));
        }
        let lines = text.lines().count();
        if file.path == "ARCHITECTURE.md" && lines > ARCHITECTURE_LINES_MAX {
            let fault = format!("{lines} lines; at most {ARCHITECTURE_LINES_MAX}; shorten it");
            findings.push(Finding::of(&file.path, fault));
        }
    }
    findings
}

/// Lists Rust files that are long enough to be reviewed, which is not an error.
pub fn long_files(files: &[File]) -> Vec<String> {
    let rust = files.iter().filter(|file| file.path.ends_with(".rs"));
    let counted = rust.map(|file| (file, file.text.as_deref().unwrap_or("").lines().count()));
    counted
        .filter(|(_, lines)| *lines > RUST_LINES_NOTED)
        .map(|(file, lines)| format!("{} has {lines} lines: still one subject?", file.path))
        .collect()
}

/// Finds an impure name in the code of a pure crate. Tests may use such names.
fn impure(file: &File, line: &str) -> Option<String> {
    let inside = PURE_CRATES.iter().any(|dir| file.path.starts_with(dir));
    let is_pure = inside && file.path.ends_with(".rs") && !file.path.contains("/tests");
    let code = line.split("//").next().unwrap_or(line);
    let word = IMPURE.iter().find(|word| is_pure && code.contains(**word))?;
    let why = "in a crate whose result depends on its input alone";
    Some(format!("`{word}` {why}; pass the value in"))
}

#[cfg(test)]
mod tests {
    use super::{check, long_files};
    use crate::tidy::files::File;

    /// Number of findings in a file that consists of this line.
    fn faults(path: &str, line: &str) -> usize {
        check(&[File::text(path, &format!("//! X.\n{line}\n"))]).len()
    }

    #[test]
    fn machine_paths_are_found_where_they_begin_a_path() {
        let dir = "home";
        assert_eq!(faults("a.md", &format!("see /{dir}/ann/x")), 1);
        assert_eq!(faults("a.rs", &format!("\"/{dir}/ann\"")), 1);
        assert_eq!(faults("a.rs", &format!("a/{dir}/ann")), 0);
        assert_eq!(faults("a.rs", "the /homes/ of many"), 0);
    }

    #[test]
    fn unfinished_work_is_found() {
        assert_eq!(faults("a.rs", &format!("    {}!()", "todo")), 1);
        assert_eq!(faults("a.rs", &format!("#[{}]", "ignore")), 1);
        assert_eq!(faults("a.rs", &format!("assert!({});", "true")), 1);
        assert_eq!(faults("a.rs", "let todo = 1;"), 0);
    }

    #[test]
    fn clocks_are_found_in_code_of_the_pure_crates_but_not_in_comments() {
        let line = "use std::time::Instant;";
        assert_eq!(faults("sim/src/a.rs", line), 1);
        assert_eq!(faults("server/src/a.rs", line), 0);
        assert_eq!(faults("sim/src/world/tests.rs", line), 0);
        assert_eq!(faults("sim/src/a.rs", "/// Never reads std::time."), 0);
    }

    #[test]
    fn a_file_without_a_header_and_a_long_file_are_found() {
        assert_eq!(check(&[File::text("room/src/a.rs", "fn f() {}\n")]).len(), 1);
        assert_eq!(check(&[File::text("room/src/a/tests.rs", "fn f() {}\n")]).len(), 0);
        assert_eq!(long_files(&[File::text("a.rs", &"\n".repeat(601))]).len(), 1);
        assert_eq!(check(&[File::text("ARCHITECTURE.md", &"x\n".repeat(200))]).len(), 1);
    }
}
