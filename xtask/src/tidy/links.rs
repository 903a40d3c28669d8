//! Checks that what documents point to exists: files, headings, and the names in the code map.

use super::files::File;
use super::finding::Finding;
use super::source::idents;
use regex::Regex;

/// A link's target, or a path in backticks below a directory with tracked files, which must exist too.
const POINTERS: &str = r"\]\((?<target>[^)]*)\)|`(?<path>(?:sim|game|protocol|room|server|cli|client-web|tests|bench|xtask|shaders|assets|docs|deploy)/[\w./-]*)`";
/// Built, not tracked.
const BUILT: &str = "client-web/dist";
/// `World`, `World::step`, `session` or `sim`, but no command, path or option.
const SYMBOL: &str = r"`([\w:]+)`";

pub fn check(files: &[File]) -> Vec<Finding> {
    let pointers = Regex::new(POINTERS).expect("a valid pattern");
    let mut findings = unknown_symbols(files);
    for document in files.iter().filter(|file| file.path.ends_with(".md")) {
        for (line, text) in prose(document) {
            for pointer in pointers.captures_iter(text) {
                let fault = match pointer.name("target") {
                    Some(target) => broken(document, target.as_str(), files),
                    None => missing(&pointer["path"], files),
                };
                findings.extend(fault.map(|fault| Finding::at(&document.path, line, fault)));
            }
        }
    }
    findings
}

/// Lines outside of code blocks, with their numbers.
fn prose(document: &File) -> impl Iterator<Item = (usize, &str)> {
    let mut inside = false;
    let lines = document.text.iter().flat_map(|text| text.lines());
    (1..).zip(lines).filter(move |(_, line)| {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        !inside && !fence
    })
}

fn missing(path: &str, files: &[File]) -> Option<String> {
    let is_missing = !path.starts_with(BUILT) && !exists(files, path);
    is_missing
        .then(|| format!("`{path}` does not exist; documents name tracked files; correct the path"))
}

fn broken(document: &File, target: &str, files: &[File]) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (path, heading) = target.split_once('#').unwrap_or((target, ""));
    let path = if path.is_empty() { document.path.clone() } else { resolve(&document.path, path) };
    if !exists(files, &path) {
        let allowed = "links lead to tracked files";
        return Some(format!("link to {path}, which does not exist; {allowed}; correct it"));
    }
    let linked = files.iter().find(|file| file.path == path)?;
    let text = linked.text.as_deref().unwrap_or("");
    let known = heading.is_empty() || headings(text).any(|known| known == heading);
    let allowed = "links lead to headings";
    (!known).then(|| {
        format!("link to #{heading}, which is no heading of {path}; {allowed}; correct it")
    })
}

/// Names that ARCHITECTURE.md mentions and that neither the code nor the files have any more.
fn unknown_symbols(files: &[File]) -> Vec<Finding> {
    let Some(map) = files.iter().find(|file| file.path == "ARCHITECTURE.md") else {
        return Vec::new();
    };
    let mut known = idents(files);
    let names = files.iter().flat_map(|file| file.path.split('/'));
    known.extend(names.map(|name| name.split('.').next().unwrap_or(name).to_owned()));
    let symbol = Regex::new(SYMBOL).expect("a valid pattern");
    let mut findings = Vec::new();
    for (line, text) in prose(map) {
        for name in symbol.captures_iter(text).map(|found| found.extract::<1>().1[0]) {
            if !name.split("::").all(|part| known.contains(part)) {
                let fault =
                    format!("no `{name}` in the code; the code map names what exists; correct it");
                findings.push(Finding::at(&map.path, line, fault));
            }
        }
    }
    findings
}

/// A tracked file, or a directory of tracked files.
fn exists(files: &[File], path: &str) -> bool {
    let dir = format!("{}/", path.trim_end_matches('/'));
    files.iter().any(|file| file.path == path || file.path.starts_with(&dir))
}

/// A path relative to the document, from the root.
fn resolve(document: &str, path: &str) -> String {
    let mut parts: Vec<&str> = document.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop();
            }
            name => parts.push(name),
        }
    }
    parts.join("/")
}

/// Anchors of a document's headings, made as code hosts make them.
fn headings(text: &str) -> impl Iterator<Item = String> {
    text.lines().filter(|line| line.starts_with('#')).map(|line| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::tidy::files::File;

    fn file(path: &str, text: &str) -> File {
        File::text(path, text)
    }

    fn problems(text: &str) -> usize {
        let other = file("docs/a.md", "# Two words, really\n");
        check(&[file("docs/b.md", text), other, file("README.md", "")]).len()
    }

    #[test]
    fn good_links_are_accepted() {
        let text = "# Own\n[a](a.md) [r](../README.md) [h](a.md#two-words-really) [o](#own) \
                    [w](https://example.com/x) `docs/a.md` `docs/`\n";
        assert_eq!(problems(text), 0);
    }

    #[test]
    fn broken_links_and_names_are_found() {
        assert_eq!(problems("[a](c.md)"), 1);
        assert_eq!(problems("[a](a.md#three)"), 1);
        assert_eq!(problems("[a](#none)"), 1);
        assert_eq!(problems("see `docs/gone.md`"), 1);
    }

    #[test]
    fn names_that_the_code_lost_are_found() {
        let map =
            file("ARCHITECTURE.md", "`World::step` `sim`\n`GONE` `Gone::gone` `gone` `a.rs`\n");
        let code = file("sim/a.rs", "//! Has Gone, GONE.\nimpl World { fn step() {} }\n");
        let said: Vec<String> = check(&[map, code]).iter().map(ToString::to_string).collect();
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said[0].starts_with("ARCHITECTURE.md:2: no `GONE` in the code"), "{said:?}");
    }

    #[test]
    fn code_blocks_are_not_read() {
        assert_eq!(problems("```\n[a](c.md)\n```\n"), 0);
    }
}
