//! `cargo xtask tidy --figures`: figures about the size and coupling of the code.

use super::circles::circles;
use super::files::File;
use super::imports::{Imports, imports};
use super::source::{SourceFile, crates, parse};
use super::types::{FILES_MAX, METHODS_MAX, OFTEN, types};
use anyhow::Result;
use proc_macro2::Span;
use std::collections::BTreeMap;
use syn::visit::{self, Visit};
use syn::{Block, FnArg, ImplItemFn, ItemFn, ItemStruct, Signature, TraitItemFn, Type};

const FUNCTION_LINES_MAX: usize = 55;
const STRUCT_FIELDS_MAX: usize = 14;
const MOST_IMPORTS: usize = 10;
/// A doc comment with at most this many words probably just repeats a name.
const SHORT_DOC_WORDS: usize = 3;
/// Parts of the code whose production lines are counted, given by prefixes and suffixes of paths.
const PARTS: [(&str, &[(&str, &str)]); 3] = [
    ("page/dom", &[("client-web/src/page/dom", "")]),
    (
        "records of a game",
        &[
            ("room/src/recorder", ""),
            ("room/src/clip", ""),
            ("room/src/log", ""),
            ("server/src/log", ""),
            ("server/src/runs", ""),
            ("server/src/replays", ""),
            ("server/src/durable", ""),
            ("server/src/records", ""),
            ("server/src/host/room_state", ""),
            ("server/src/fleet/nats/", ""),
        ],
    ),
    (
        "state",
        &[
            ("sim/src/state", ""),
            ("game/src/state", ""),
            ("sim/src/", "/state.rs"),
            ("sim/src/", "/saved.rs"),
            ("game/src/", "/state.rs"),
        ],
    ),
];

/// Returns the figures for a checkout as text.
///
/// Production lines are all lines of tracked `*.rs` files, including comments and empty lines, but excluding the
/// top-level directories `tests` and `bench`, folders `tests` and `benches`, files `tests.rs`, and inline `#[cfg(test)]
/// mod` blocks. Build scripts and examples count. The other figures cover the same files.
pub fn figures(files: &[File]) -> Result<String> {
    let sources = parse(files)?;
    let imports = imports(&sources, &crates(files));
    let mut found = FigureVisitor::default();
    for source in &sources {
        found.path.clone_from(&source.path);
        source.items.iter().for_each(|item| found.visit_item(item));
    }
    let types = types(&sources);
    let parts = [
        circles_of(&imports),
        lines(&sources),
        counts(files, &sources),
        list(&format!("types of more than {METHODS_MAX} methods"), &types.large),
        list(&format!("types with methods in more than {FILES_MAX} files"), &types.spread),
        format!("names of several types: {}\n", types.shared),
        list(&format!("names of at least {OFTEN} types"), &types.often),
        list(&format!("functions of more than {FUNCTION_LINES_MAX} lines"), &found.functions),
        list(&format!("structs of more than {STRUCT_FIELDS_MAX} fields"), &found.structs),
        list("functions that take a tuple of references", &found.tuples),
        list("files that import the most others", &most_imports(&imports)),
    ];
    Ok(parts.concat())
}

fn list(title: &str, lines: &[String]) -> String {
    let lines: String = lines.iter().map(|line| format!("  {line}\n")).collect();
    format!("{title}: {}\n{lines}", lines.lines().count())
}

/// Returns all cycles and the number that would remain if no file imported a module that contains it.
fn circles_of(imports: &Imports) -> String {
    let mut beside = imports.clone();
    beside.retain(|(from, to), _| !lies_below(from, to));
    let beside = circles(&beside).len();
    let circles = circles(imports);
    let mut out = format!("circles of files: {} ({beside} among siblings)\n", circles.len());
    for circle in &circles {
        out += &format!("  {} files:\n    {}\n", circle.files.len(), circle.ties.join("\n    "));
    }
    out
}

/// Whether a file belongs to a module inside another file's module.
fn lies_below(file: &str, other: &str) -> bool {
    let endings = ["/lib.rs", "/main.rs", "/mod.rs", ".rs"];
    let dir = endings.iter().find_map(|ending| other.strip_suffix(ending)).unwrap_or(other);
    file.strip_prefix(dir).is_some_and(|rest| rest.starts_with('/'))
}

fn lines(sources: &[SourceFile]) -> String {
    let mut lines: BTreeMap<&str, usize> = BTreeMap::new();
    for source in sources {
        *lines.entry(source.path.split('/').next().unwrap_or("")).or_default() += source.lines;
    }
    let each: String = lines.iter().map(|(top, lines)| format!("  {lines:6} {top}\n")).collect();
    format!("production lines: {}\n{each}", lines.values().sum::<usize>())
}

/// Counts everything that needs no parsing: tracked files, lines of tests, lines of [`PARTS`], short comments and
/// `mod.rs` files.
fn counts(files: &[File], sources: &[SourceFile]) -> String {
    let rust = files.iter().filter(|file| file.path.ends_with(".rs"));
    let own = rust.filter(|file| !file.path.starts_with("bench/"));
    let all: usize = own.map(|file| file.text.as_deref().unwrap_or("").lines().count()).sum();
    let production: usize = sources.iter().map(|source| source.lines).sum();
    let mut out = format!("tracked files: {}\ntest lines: {}\n", files.len(), all - production);
    for (title, paths) in PARTS {
        let belongs = |path: &str| {
            paths.iter().any(|(begin, end)| path.starts_with(begin) && path.ends_with(end))
        };
        let lines = sources.iter().filter(|source| belongs(&source.path));
        out += &format!("lines of {title}: {}\n", lines.map(|source| source.lines).sum::<usize>());
    }
    let shipped = |file: &&File| sources.iter().any(|source| source.path == file.path);
    let texts = files.iter().filter(shipped).filter_map(|file| file.text.as_deref());
    let short: usize = texts.map(short_docs).sum();
    let modules = files.iter().filter(|file| file.path.ends_with("/mod.rs")).count();
    out + &format!("doc comments of up to {SHORT_DOC_WORDS} words: {short}\nmod.rs: {modules}\n")
}

fn short_docs(text: &str) -> usize {
    let (mut short, mut words) = (0, 0);
    for line in text.lines() {
        match line.trim_start().strip_prefix("///") {
            Some(doc) => words += doc.split_whitespace().count(),
            None => {
                short += usize::from((1..=SHORT_DOC_WORDS).contains(&words));
                words = 0;
            }
        }
    }
    short
}

fn most_imports(imports: &Imports) -> Vec<String> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    imports.keys().for_each(|(from, _)| *counts.entry(from).or_default() += 1);
    let mut most: Vec<(&str, usize)> = counts.into_iter().collect();
    most.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    most.iter().take(MOST_IMPORTS).map(|(file, count)| format!("{count:4} {file}")).collect()
}

/// Collects figures from the files read so far.
#[derive(Default)]
struct FigureVisitor {
    /// Path of the current file.
    path: String,
    functions: Vec<String>,
    structs: Vec<String>,
    tuples: Vec<String>,
}

impl FigureVisitor {
    fn place(&self, span: Span) -> String {
        format!("{}:{}", self.path, span.start().line)
    }

    fn function(&mut self, signature: &Signature, block: &Block) {
        let first = signature.fn_token.span;
        let lines = block.brace_token.span.close().end().line + 1 - first.start().line;
        let named = format!("{} {}", self.place(first), signature.ident);
        if lines > FUNCTION_LINES_MAX {
            self.functions.push(format!("{lines:4} {named}"));
        }
        if signature.inputs.iter().any(is_tuple_of_references) {
            self.tuples.push(named);
        }
    }
}

fn is_tuple_of_references(argument: &FnArg) -> bool {
    let FnArg::Typed(argument) = argument else { return false };
    let Type::Tuple(tuple) = argument.ty.as_ref() else { return false };
    tuple.elems.iter().any(|element| matches!(element, Type::Reference(_)))
}

impl<'ast> Visit<'ast> for FigureVisitor {
    fn visit_item_fn(&mut self, function: &'ast ItemFn) {
        self.function(&function.sig, &function.block);
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast ImplItemFn) {
        self.function(&function.sig, &function.block);
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast TraitItemFn) {
        if let Some(block) = &function.default {
            self.function(&function.sig, block);
        }
        visit::visit_trait_item_fn(self, function);
    }

    fn visit_item_struct(&mut self, item: &'ast ItemStruct) {
        if item.fields.len() > STRUCT_FIELDS_MAX {
            let place = self.place(item.struct_token.span);
            self.structs.push(format!("{:4} {place} {}", item.fields.len(), item.ident));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::figures;
    use crate::tidy::files::File;

    fn printed(text: &str) -> String {
        let manifest = File::text("sim/Cargo.toml", "[package]\nname = \"jostle-sim\"\n");
        let below = File::text("sim/src/a/b.rs", "use super::S;\n");
        figures(&[manifest, File::text("sim/src/a.rs", text), below]).expect("parses")
    }

    #[test]
    fn what_is_too_large_is_listed_with_its_place() {
        let body = "\n".repeat(54);
        let fields: String = (0..21).map(|n| format!("f{n}: u8,")).collect();
        let text =
            format!("fn f() {{\n{body}}}\nstruct S {{ {fields} }}\nfn g(a: (&u8, &u8)) {{}}\n");
        let said = printed(&text);
        assert!(said.contains("production lines: 59\n      59 sim\n"), "{said}");
        assert!(said.contains("55 lines: 1\n    56 sim/src/a.rs:1 f\n"), "{said}");
        assert!(said.contains("14 fields: 1\n    21 sim/src/a.rs:57 S\n"), "{said}");
        assert!(said.contains("tuple of references: 1\n  sim/src/a.rs:58 g\n"), "{said}");
        assert!(said.contains("tracked files: 3\ntest lines: 0\n"), "{said}");
        assert!(said.contains("most others: 1\n     1 sim/src/a/b.rs\n"), "{said}");
    }

    #[test]
    fn what_is_small_enough_and_what_only_tests_build_is_not() {
        let body = "\n".repeat(53);
        let text = format!(
            "fn f(a: &(u8, u8)) {{\n{body}}}\n#[cfg(test)]\nmod tests {{\n fn g(a: (&u8, &u8)) {{}}\n}}\n"
        );
        let said = printed(&text);
        assert!(
            said.contains("circles of files: 0 (0 among siblings)\nproduction lines: 56\n"),
            "{said}"
        );
        assert!(said.contains("55 lines: 0\nstructs of more than 14 fields: 0\n"), "{said}");
        assert!(said.contains("tuple of references: 0\n"), "{said}");
    }

    #[test]
    fn circles_with_a_parent_are_told_from_those_among_siblings() {
        let said = printed("mod b;\nuse b::B;\n");
        assert!(said.contains("circles of files: 1 (0 among siblings)\n  2 files:\n"), "{said}");
    }
}
