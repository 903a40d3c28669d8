//! Checks of lines: what must not stand in a source file, and where.

use super::files::File;
use super::finding::{Fault, Finding};

/// Directories that exist on one machine only.
const MACHINE_DIRS: [&str; 5] = ["home", "root", "tmp", "work", "Users"];
/// Macros that mark unfinished work. Listed without their brackets, or this file would be found.
const UNFINISHED: [&str; 3] = ["todo", "unimplemented", "dbg"];
/// Crates whose result may depend on nothing but their input.
const PURE_CRATES: [&str; 4] = ["sim/src/", "game/src/", "protocol/src/", "room/src/"];
/// What would let the outside in, or an order that is not the same everywhere.
const IMPURE: [&str; 7] =
    ["std::env", "std::fs", "std::net", "std::thread", "std::time", "HashMap", "HashSet"];
/// Functions of the standard library that differ from machine to machine by a bit or more.
const INEXACT: [&str; 12] = [
    ".sin()",
    ".cos()",
    ".tan()",
    ".sin_cos()",
    ".atan2(",
    ".acos()",
    ".powf(",
    ".exp()",
    ".ln()",
    ".mul_add(",
    ".hypot(",
    ".cbrt()",
];
const ARCHITECTURE_LINES_MAX: usize = 199;
/// Beyond it a Rust file has to be asked whether it still has one subject.
const RUST_LINES_NOTED: usize = 600;
const TEXT_ENDINGS: [&str; 10] =
    [".rs", ".toml", ".md", ".wgsl", ".html", ".css", ".js", ".sh", ".yml", ".json"];

pub fn check(files: &[File]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in files {
        let Some(text) = &file.text else { continue };
        if TEXT_ENDINGS.iter().any(|ending| file.path.ends_with(ending)) {
            every_line(file, text, machine_path, &mut findings);
        }
        if file.path.ends_with(".rs") {
            every_line(file, text, unfinished, &mut findings);
            header(file, text, &mut findings);
        }
        if is_pure(&file.path) {
            every_line(file, text, impure, &mut findings);
        }
        if file.path == "ARCHITECTURE.md" && text.lines().count() > ARCHITECTURE_LINES_MAX {
            let lines = text.lines().count();
            findings.push(Fault::Long(lines, ARCHITECTURE_LINES_MAX).of(&file.path));
        }
    }
    findings
}

/// Rust files that are long enough to be looked at; not an error.
pub fn long_files(files: &[File]) -> Vec<String> {
    let rust = files.iter().filter(|file| file.path.ends_with(".rs"));
    let counted = rust.map(|file| (file, file.text.as_deref().unwrap_or("").lines().count()));
    counted
        .filter(|(_, lines)| *lines > RUST_LINES_NOTED)
        .map(|(file, lines)| format!("{} has {lines} lines: still one subject?", file.path))
        .collect()
}

fn every_line(
    file: &File,
    text: &str,
    fault_in: fn(&str) -> Option<Fault>,
    findings: &mut Vec<Finding>,
) {
    for (index, line) in text.lines().enumerate() {
        findings.extend(fault_in(line).map(|fault| fault.at(&file.path, index + 1)));
    }
}

/// A path below one of [`MACHINE_DIRS`], unless it goes on from something, as in `a/tmp/b`.
fn machine_path(line: &str) -> Option<Fault> {
    MACHINE_DIRS.iter().find_map(|dir| {
        let path = format!("/{dir}/");
        let found = line.match_indices(&path).any(|(at, _)| {
            let before = line[..at].chars().next_back();
            !before.is_some_and(|c| c.is_ascii_alphanumeric() || "_.-}".contains(c))
        });
        found.then_some(Fault::MachinePath(path))
    })
}

fn unfinished(line: &str) -> Option<Fault> {
    let ignored = format!("#[{}", "ignore");
    if line.contains(&ignored) {
        return Some(Fault::IgnoredTest);
    }
    let hollow = format!("assert!({})", "true");
    if line.contains(&hollow) {
        return Some(Fault::HollowAssertion);
    }
    let name = UNFINISHED.iter().find(|name| line.contains(&format!("{name}!(")))?;
    Some(Fault::Unfinished(name))
}

/// Every file says what lives in it; a file of tests is explained by what it tests.
fn header(file: &File, text: &str, findings: &mut Vec<Finding>) {
    if !text.starts_with("//!") && !file.path.ends_with("/tests.rs") {
        findings.push(Fault::NoHeader.of(&file.path));
    }
}

/// Tests may look at the world outside.
fn is_pure(path: &str) -> bool {
    let inside = PURE_CRATES.iter().any(|dir| path.starts_with(dir));
    inside && path.ends_with(".rs") && !path.contains("/tests")
}

fn impure(line: &str) -> Option<Fault> {
    let code = line.split("//").next().unwrap_or(line);
    let word = IMPURE.iter().chain(&INEXACT).find(|word| code.contains(**word))?;
    Some(Fault::Impure(word))
}

#[cfg(test)]
mod tests {
    use super::{check, impure, long_files, machine_path, unfinished};
    use crate::tidy::files::File;

    fn file(path: &str, text: &str) -> File {
        File::text(path, text)
    }

    #[test]
    fn machine_paths_are_found_where_they_begin_a_path() {
        let dir = "home";
        assert!(machine_path(&format!("see /{dir}/ann/x")).is_some());
        assert!(machine_path(&format!("\"/{dir}/ann\"")).is_some());
        assert!(machine_path(&format!("a/{dir}/ann")).is_none());
        assert!(machine_path("the /homes/ of many").is_none());
    }

    #[test]
    fn unfinished_work_is_found() {
        assert!(unfinished(&format!("    {}!()", "todo")).is_some());
        assert!(unfinished(&format!("#[{}]", "ignore")).is_some());
        assert!(unfinished("let todo = 1;").is_none());
    }

    #[test]
    fn clocks_are_found_in_code_but_not_in_comments() {
        assert!(impure("use std::time::Instant;").is_some());
        assert!(impure("let y = x.sin();").is_some());
        assert!(impure("/// Never reads std::time.").is_none());
    }

    #[test]
    fn only_the_pure_crates_are_held_to_purity() {
        let text = "//! X.\nuse std::time::Instant;\n";
        assert_eq!(check(&[file("sim/src/a.rs", text)]).len(), 1);
        assert_eq!(check(&[file("server/src/a.rs", text)]).len(), 0);
        assert_eq!(check(&[file("sim/src/world/tests.rs", text)]).len(), 0);
    }

    #[test]
    fn a_file_without_a_header_and_a_long_file_are_found() {
        assert_eq!(check(&[file("room/src/a.rs", "fn f() {}\n")]).len(), 1);
        assert_eq!(check(&[file("room/src/a/tests.rs", "fn f() {}\n")]).len(), 0);
        assert_eq!(long_files(&[file("a.rs", &"\n".repeat(601))]).len(), 1);
        assert_eq!(check(&[file("ARCHITECTURE.md", &"x\n".repeat(200))]).len(), 1);
    }
}
