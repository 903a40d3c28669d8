//! Finds import cycles, which are files of a crate that import each other directly or indirectly.

use super::finding::Finding;
use super::imports::Imports;
use std::collections::{BTreeMap, BTreeSet};

/// Files that import each other, with the imports between them.
pub struct Circle<'a> {
    pub files: BTreeSet<&'a str>,
    /// Imports within the cycle, one per line.
    pub ties: Vec<String>,
}

/// Finds the cycles, which are strongly connected components with more than one file.
pub fn circles<'a>(imports: &Imports<'a>) -> Vec<Circle<'a>> {
    let mut nexts: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in imports.keys() {
        nexts.entry(from).or_default().push(to);
    }
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        nexts.keys().map(|file| (*file, reach(file, &nexts))).collect();
    let reaches = |from: &str, to: &str| reached.get(from).is_some_and(|all| all.contains(to));
    let mut circles: Vec<Circle> = Vec::new();
    for (file, others) in &reached {
        if others.contains(file) && !circles.iter().any(|circle| circle.files.contains(file)) {
            let files = others.iter().copied().filter(|other| reaches(other, file)).collect();
            circles.push(Circle { ties: ties(&files, imports), files });
        }
    }
    circles
}

/// The files that a file imports, directly or indirectly.
fn reach<'a>(file: &'a str, nexts: &BTreeMap<&'a str, Vec<&'a str>>) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut open = vec![file];
    while let Some(file) = open.pop() {
        let new = nexts.get(file).into_iter().flatten().filter(|next| found.insert(**next));
        open.extend(new.copied());
    }
    found
}

fn ties(files: &BTreeSet<&str>, imports: &Imports) -> Vec<String> {
    let inside =
        imports.iter().filter(|((from, to), _)| files.contains(from) && files.contains(to));
    inside
        .map(|((from, to), names)| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            format!("{from} imports {} from {to}", names.join(", "))
        })
        .collect()
}

/// Reports each cycle at its first file.
pub fn check(imports: &Imports) -> Vec<Finding> {
    let circles = circles(imports);
    let finding = |circle: &Circle| {
        let ties = circle.ties.join("\n    ");
        let allowed = "imports form no circle; move what they share into a file below them";
        let file = circle.files.first().expect("a circle has files");
        Finding::of(file, format!("circle of files; {allowed}:\n    {ties}"))
    };
    circles.iter().map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::tidy::files::File;
    use crate::tidy::imports::imports;
    use crate::tidy::source::{crates, parse};

    const MANIFEST: &str = "[package]\nname = \"jostle-sim\"\n";

    /// Returns the findings for a crate that consists of the given files.
    fn messages(files: &[(&str, &str)]) -> Vec<String> {
        let mut tree = vec![File::text("sim/Cargo.toml", MANIFEST)];
        tree.extend(files.iter().map(|(path, text)| File::text(&format!("sim/src/{path}"), text)));
        let sources = parse(&tree).expect("parses");
        let found = check(&imports(&sources, &crates(&tree)));
        found.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn siblings_that_import_each_other_are_a_circle() {
        let a = ("a.rs", "use crate::b::B;\npub struct A(B);\n");
        let b = ("b.rs", "pub struct B;\nfn f(_: &crate::a::A) {}\n");
        let said = messages(&[("lib.rs", "mod a;\nmod b;\n"), a, b]);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].starts_with("sim/src/a.rs: circle of files"), "{said:?}");
        assert!(said[0].contains("sim/src/a.rs imports B from sim/src/b.rs"), "{said:?}");
        assert!(said[0].contains("sim/src/b.rs imports A from sim/src/a.rs"), "{said:?}");
        assert_eq!(messages(&[a, ("b.rs", "pub struct B;\n")]), [""; 0]);
    }

    #[test]
    fn a_parent_and_a_child_that_import_each_other_are_a_circle() {
        let parent =
            ["mod b;\nuse b::f;\n", "mod b;\npub use self::b::f;\n", "mod b;\nfn g() { b::f() }\n"];
        for parent in parent {
            let child = [
                "use super::A;\n",
                "fn f() -> super::A { A }\n",
                "fn f() { print!(\"{}\", super::A) }\n",
            ];
            for child in child {
                let said = messages(&[("a.rs", parent), ("a/b.rs", child)]);
                assert_eq!(said.len(), 1, "{parent}{child}{said:?}");
            }
            assert_eq!(messages(&[("a.rs", parent), ("a/b.rs", "use crate::c::C;\n")]), [""; 0]);
        }
        assert_eq!(messages(&[("a.rs", "mod b;\n"), ("a/b.rs", "use super::A;\n")]), [""; 0]);
    }

    #[test]
    fn tests_visibilities_and_documentation_tie_nothing() {
        let a = ("a.rs", "mod b;\nuse b::B;\n");
        let free = "//! As [`super::A`].\npub(in super::super::a) struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n";
        assert_eq!(messages(&[a, ("a/b.rs", free)]), [""; 0]);
        assert_eq!(messages(&[a, ("a/b/tests.rs", "use crate::a::A;\n"), ("a/b.rs", "")]), [""; 0]);
    }
}
