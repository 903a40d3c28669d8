//! The Rust files of a checkout, parsed once for all code checks.

use super::files::File;
use anyhow::{Context, Result};
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use std::collections::BTreeSet;
use syn::{Attribute, Item, Path};

/// Top-level directories whose code is never shipped.
const MEASURING: [&str; 2] = ["tests", "bench"];
/// Folders of a crate that contain tests and benchmarks.
const TEST_FOLDERS: [&str; 2] = ["tests", "benches"];

/// A parsed Rust file.
pub struct SourceFile {
    /// Path relative to the root, with slashes.
    pub path: String,
    /// Items that are compiled outside of tests.
    pub items: Vec<Item>,
    /// The file's items as tokens.
    pub tokens: TokenStream,
    /// Number of lines, excluding inline test modules.
    pub lines: usize,
}

/// A crate: a folder with a manifest.
pub struct Crate {
    /// Folder relative to the root, with a trailing slash.
    pub dir: String,
    /// Name in code: `jostle_sim`.
    pub ident: String,
}

/// Parses the Rust files that are shipped or used to build shipped code.
pub fn parse(files: &[File]) -> Result<Vec<SourceFile>> {
    let rust = files.iter().filter(|file| file.path.ends_with(".rs"));
    rust.filter(|file| is_production(&file.path))
        .map(|file| SourceFile::parse(file).with_context(|| file.path.clone()))
        .collect()
}

/// All identifiers in the code and its tests, excluding names that occur only in comments and strings.
pub fn idents(files: &[File]) -> BTreeSet<String> {
    let rust = files.iter().filter(|file| file.path.ends_with(".rs"));
    let texts = rust.filter_map(|file| file.text.as_deref());
    let mut idents = BTreeSet::new();
    texts.filter_map(|text| text.parse().ok()).for_each(|tokens| collect(tokens, &mut idents));
    idents
}

fn collect(tokens: TokenStream, idents: &mut BTreeSet<String>) {
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => {
                idents.insert(ident.to_string());
            }
            TokenTree::Group(group) => collect(group.stream(), idents),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

/// Finds the crates of a checkout by their manifests, inner ones first.
pub fn crates(files: &[File]) -> Vec<Crate> {
    let manifests = files.iter().filter_map(|file| {
        let dir = file.path.strip_suffix("Cargo.toml").filter(|dir| dir.ends_with('/'))?;
        let text = file.text.as_deref()?;
        let name = text.lines().find_map(|line| line.strip_prefix("name = \""))?;
        let ident = name.trim_end_matches('"').replace('-', "_");
        Some(Crate { dir: dir.to_owned(), ident })
    });
    let mut crates: Vec<Crate> = manifests.collect();
    crates.sort_by_key(|package| std::cmp::Reverse(package.dir.len()));
    crates
}

impl SourceFile {
    fn parse(file: &File) -> syn::Result<Self> {
        let text = file.text.as_deref().unwrap_or("");
        let items = syn::parse_file(text)?.items;
        let (tests, items): (Vec<Item>, Vec<Item>) =
            items.into_iter().partition(|item| attributes(item).iter().any(is_for_tests));
        let in_tests: usize = tests.iter().map(inline_lines).sum();
        let lines = text.lines().count() - in_tests;
        let tokens = items.iter().map(ToTokens::to_token_stream).collect();
        Ok(Self { path: file.path.clone(), items, tokens, lines })
    }
}

fn is_production(path: &str) -> bool {
    let mut folders: Vec<&str> = path.split('/').collect();
    let name = folders.pop();
    let measures = folders.first().is_some_and(|top| MEASURING.contains(top));
    let tests = folders.iter().any(|folder| TEST_FOLDERS.contains(folder));
    !measures && !tests && name != Some("tests.rs")
}

/// The attributes of an item, if it is of a kind that can be compiled only for tests.
fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Mod(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn is_for_tests(attribute: &Attribute) -> bool {
    let condition = attribute.path().is_ident("cfg").then(|| attribute.parse_args::<Path>());
    condition.is_some_and(|path| path.is_ok_and(|path| path.is_ident("test")))
}

/// Number of lines in an inline module, including its attributes; 0 for anything else.
fn inline_lines(item: &Item) -> usize {
    let Item::Mod(module) = item else { return 0 };
    let Some((braces, _)) = &module.content else { return 0 };
    let attribute = module.attrs.first().map(|attribute| attribute.pound_token.spans[0]);
    let first = attribute.unwrap_or(module.mod_token.span).start().line;
    braces.span.close().end().line + 1 - first
}

#[cfg(test)]
mod tests {
    use super::{SourceFile, crates, is_production};
    use crate::tidy::files::File;

    #[test]
    fn lines_of_inline_test_modules_are_not_counted() {
        let text = "//! A.\n\nfn f() {}\n\n#[cfg(test)]\nmod tests {\n    fn g() {}\n}\n";
        let source = SourceFile::parse(&File::text("sim/src/a.rs", text)).expect("parses");
        assert_eq!((source.lines, source.items.len()), (4, 1));
    }

    #[test]
    fn production_is_what_is_neither_test_nor_measurement() {
        for path in ["sim/src/a.rs", "sim/examples/a.rs", "server/build.rs"] {
            assert!(is_production(path), "{path}");
        }
        let others = ["sim/src/a/tests.rs", "sim/src/tests/a.rs", "sim/benches/a.rs"];
        for path in others.into_iter().chain(["tests/src/a.rs", "bench/src/a.rs"]) {
            assert!(!is_production(path), "{path}");
        }
    }

    #[test]
    fn crates_are_named_by_their_manifests() {
        let outer = File::text("tests/Cargo.toml", "[package]\nname = \"jostle-tests\"\n");
        let inner = File::text("tests/fuzz/Cargo.toml", "[package]\nname = \"jostle-fuzz\"\n");
        let found = crates(&[outer, inner, File::text("Cargo.toml", "[workspace]\n")]);
        let idents: Vec<&str> = found.iter().map(|package| package.ident.as_str()).collect();
        assert_eq!(idents, ["jostle_fuzz", "jostle_tests"]);
    }
}
