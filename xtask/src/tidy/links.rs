//! What documents point to exists: files, headings, and the names in the code map.

use super::files::File;
use super::finding::{Fault, Finding};
use super::source::idents;

/// Directories whose files documents name in backticks; such a name must exist too.
const SOURCE_DIRS: [&str; 13] = [
    "sim/",
    "game/",
    "protocol/",
    "room/",
    "server/",
    "cli/",
    "client-web/",
    "tests/",
    "bench/",
    "xtask/",
    "shaders/",
    "assets/",
    "docs/",
];
/// Built, not tracked.
const BUILT_DIRS: [&str; 2] = ["client-web/dist", "target"];

pub fn check(files: &[File]) -> Vec<Finding> {
    let documents = files.iter().filter(|file| file.path.ends_with(".md"));
    let mut findings = unknown_symbols(files);
    for document in documents {
        let text = prose(document.text.as_deref().unwrap_or(""));
        for (line, target) in links(&text) {
            let fault = broken(document, &target, files);
            findings.extend(fault.map(|fault| fault.at(&document.path, line)));
        }
        for (line, name) in named_files(&text) {
            if !exists(files, &name) {
                findings.push(Fault::DeadPath(name).at(&document.path, line));
            }
        }
    }
    findings
}

/// The document with its code blocks blanked, so that line numbers stay.
fn prose(text: &str) -> String {
    let mut inside = false;
    let mut out = String::new();
    for line in text.lines() {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        if !inside && !fence {
            out.push_str(line);
        }
        out.push('\n');
    }
    out
}

/// Targets of `[text](target)`, with their lines.
fn links(text: &str) -> Vec<(usize, String)> {
    let mut links = Vec::new();
    for (index, line) in text.lines().enumerate() {
        for part in line.split("](").skip(1) {
            if let Some(end) = part.find(')') {
                links.push((index + 1, part[..end].to_owned()));
            }
        }
    }
    links
}

/// Paths in backticks that begin with one of [`SOURCE_DIRS`], with their lines.
fn named_files(text: &str) -> Vec<(usize, String)> {
    let mut names = Vec::new();
    for (index, line) in text.lines().enumerate() {
        for name in line.split('`').skip(1).step_by(2) {
            let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c));
            let built = BUILT_DIRS.iter().any(|dir| name.starts_with(dir));
            if plain && !built && SOURCE_DIRS.iter().any(|dir| name.starts_with(dir)) {
                names.push((index + 1, name.to_owned()));
            }
        }
    }
    names
}

fn broken(document: &File, target: &str, files: &[File]) -> Option<Fault> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (path, heading) = target.split_once('#').unwrap_or((target, ""));
    let path = if path.is_empty() { document.path.clone() } else { resolve(&document.path, path) };
    if !exists(files, &path) {
        return Some(Fault::DeadLink(path));
    }
    let linked = files.iter().find(|file| file.path == path)?;
    let text = linked.text.as_deref().unwrap_or("");
    let known = heading.is_empty() || headings(text).any(|known| known == heading);
    (!known).then(|| Fault::DeadHeading(heading.to_owned(), path))
}

/// Names that ARCHITECTURE.md mentions and that neither the code nor the files have any more.
fn unknown_symbols(files: &[File]) -> Vec<Finding> {
    let Some(map) = files.iter().find(|file| file.path == "ARCHITECTURE.md") else {
        return Vec::new();
    };
    let mut known = idents(files);
    let names = files.iter().flat_map(|file| file.path.split('/'));
    known.extend(names.map(|name| name.split('.').next().unwrap_or(name).to_owned()));
    let text = prose(map.text.as_deref().unwrap_or(""));
    let mut findings = Vec::new();
    for (index, line) in text.lines().enumerate() {
        for name in line.split('`').skip(1).step_by(2).filter(|name| is_symbol(name)) {
            if !name.split("::").all(|part| known.contains(part)) {
                findings.push(Fault::DeadSymbol(name.to_owned()).at(&map.path, index + 1));
            }
        }
    }
    findings
}

/// `World`, `World::step`, `session` or `sim`, but no command, path or option.
fn is_symbol(name: &str) -> bool {
    name.chars().all(|c| c.is_ascii_alphanumeric() || "_:".contains(c))
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
