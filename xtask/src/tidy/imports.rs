//! Finds the imports between the files of a workspace.
//!
//! An import of `crate::a::b::Name` imports the deepest file on that path, `a/b.rs`. Re-exports are not followed:
//! `super::Name` imports the parent module's file, even if a `pub use` there re-exports the name; that `pub use` is an
//! import by the parent. Tests, visibilities, attributes and documentation do not count as imports.

use super::source::{Crate, SourceFile};
use proc_macro2::{Group, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};

/// The names that one file imports from another, by the paths of both files.
pub type Imports<'a> = BTreeMap<(&'a str, &'a str), BTreeSet<String>>;
/// A path in code, starting with the name of the crate.
type ModulePath = Vec<String>;
type Modules<'a> = BTreeMap<ModulePath, &'a str>;

/// Finds all imports between the workspace's files.
pub fn imports<'a>(sources: &'a [SourceFile], crates: &[Crate]) -> Imports<'a> {
    let module_of = |source: &SourceFile| module_path(&source.path, crates, sources);
    let modules: Modules =
        sources.iter().map(|source| (module_of(source), source.path.as_str())).collect();
    let mut imports = Imports::new();
    for source in sources {
        let from = &source.path;
        let aliases = BTreeMap::new();
        let mut reader =
            ImportReader { modules: &modules, from, here: module_of(source), aliases, imports };
        reader.read(source.tokens.clone(), None);
        imports = reader.imports;
    }
    imports
}

/// Returns the path of a file's module. Outside `src`, each folder counts as a crate.
fn module_path(path: &str, crates: &[Crate], sources: &[SourceFile]) -> ModulePath {
    let package = crates.iter().find(|package| path.starts_with(&package.dir));
    let dir = package.map_or("", |package| package.dir.as_str());
    let inside = path[dir.len()..].trim_end_matches(".rs");
    let (folder, rest) = inside.split_once('/').unwrap_or(("", inside));
    let ident = package.filter(|_| folder == "src").map(|package| package.ident.clone());
    let mut module = vec![ident.unwrap_or_else(|| format!("{dir}{folder}"))];
    module.extend(rest.split('/').map(str::to_owned));
    let library = format!("{dir}src/lib.rs");
    // If there is also a library, a program counts as one more module.
    let is_root = match rest {
        "main" => !sources.iter().any(|source| source.path == library),
        _ => rest == "lib" || rest.ends_with("/mod") || rest.ends_with("/main"),
    };
    module.truncate(module.len() - usize::from(is_root));
    module
}

/// Collects the imports of one file.
struct ImportReader<'a, 'm> {
    modules: &'m Modules<'a>,
    from: &'a str,
    /// Path of the current module, including inline ones.
    here: ModulePath,
    /// Names brought into the file by `use` declarations.
    aliases: BTreeMap<String, ModulePath>,
    imports: Imports<'a>,
}

impl ImportReader<'_, '_> {
    /// Resolves a path as written, if it leads into this workspace.
    fn absolute(&self, written: &[String]) -> Option<ModulePath> {
        let (first, rest) = written.split_first()?;
        match first.as_str() {
            "crate" => Some([&self.here[..1], rest].concat()),
            "self" => Some([&self.here, rest].concat()),
            "super" => {
                let ups = written.iter().take_while(|segment| *segment == "super").count();
                let kept = self.here.len().checked_sub(ups)?;
                Some([&self.here[..kept], &written[ups..]].concat())
            }
            _ if self.modules.contains_key(&written[..1]) => Some(written.to_vec()),
            _ => {
                let child = [&self.here, &written[..1]].concat();
                let is_child = self.modules.contains_key(&child);
                let known = if is_child { Some(&child) } else { self.aliases.get(first) };
                known.map(|known| [known, rest].concat())
            }
        }
    }

    /// Records an import of the deepest file on a path, with the first name that follows its module path.
    fn import(&mut self, absolute: &[String]) {
        let found = (1..=absolute.len())
            .rev()
            .find_map(|length| self.modules.get(&absolute[..length]).map(|file| (*file, length)));
        let Some((file, length)) = found.filter(|(file, _)| *file != self.from) else { return };
        let name = absolute.get(length).or(absolute.last()).cloned().unwrap_or_default();
        self.imports.entry((self.from, file)).or_default().insert(name);
    }

    /// Records the import of a path as written. A path in a `use` also brings a name into the file.
    fn import_written(&mut self, written: &[String], is_use: bool, alias: Option<String>) {
        let Some(absolute) = self.absolute(written).filter(|_| is_use || written.len() > 1) else {
            return;
        };
        self.import(&absolute);
        if is_use {
            let alias = alias.or(absolute.last().cloned());
            self.aliases.extend(alias.map(|alias| (alias, absolute)));
        }
    }

    /// Records the imports in a token stream, including those in macro calls. Inside the braces of a `use`, `before` is
    /// the path before the braces.
    fn read(&mut self, tokens: TokenStream, before: Option<&[String]>) {
        let mut is_use = before.is_some();
        let (mut path, mut colons): (ModulePath, u32) = (Vec::new(), 0);
        let mut tokens = tokens.into_iter();
        while let Some(token) = tokens.next() {
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                TokenTree::Punct(punct) if punct.as_char() == '*' && is_use => {
                    path.push("*".to_owned());
                }
                TokenTree::Group(group) if is_use && colons == 2 => {
                    self.read(group.stream(), Some(&path));
                    path.clear();
                }
                TokenTree::Ident(ident) if is_use && ident == "as" => {
                    let alias = tokens.next().map(|alias| alias.to_string());
                    self.import_written(&path, true, alias);
                    path.clear();
                }
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.import_written(&path, is_use, None);
                        path = before.unwrap_or_default().to_vec();
                    }
                    match ident.to_string() {
                        name if name == "use" => is_use = true,
                        name if name == "mod" => self.read_module(&mut tokens),
                        name if name == "self" && before.is_some() => {}
                        name => path.push(name),
                    }
                }
                other => {
                    self.import_written(&path, is_use, None);
                    path.clear();
                    is_use &= !matches!(&other, TokenTree::Punct(punct) if punct.as_char() == ';');
                    self.read_other(other, &mut tokens);
                }
            }
            colons = 0;
        }
        self.import_written(&path, is_use, None);
    }

    /// Reads an inline module. A module in a separate file is read with that file.
    fn read_module(&mut self, tokens: &mut impl Iterator<Item = TokenTree>) {
        let name = tokens.next().map(|name| name.to_string());
        if let Some(TokenTree::Group(group)) = tokens.next() {
            self.here.extend(name);
            self.read(group.stream(), None);
            self.here.pop();
        }
    }

    /// Reads tokens inside brackets, but skips attributes and visibilities.
    fn read_other(&mut self, token: TokenTree, rest: &mut impl Iterator<Item = TokenTree>) {
        match token {
            TokenTree::Punct(punct) if punct.as_char() == '#' => drop(rest.next()),
            TokenTree::Group(group) if !is_visibility(&group) => self.read(group.stream(), None),
            _ => {}
        }
    }
}

/// Whether a group has the form `(in path)`, as after `pub`.
fn is_visibility(group: &Group) -> bool {
    let first = group.stream().into_iter().next();
    matches!(first, Some(TokenTree::Ident(ident)) if ident == "in")
}

#[cfg(test)]
mod tests {
    use super::imports;
    use crate::tidy::files::File;
    use crate::tidy::source::{crates, parse};

    /// Lists the imports of `sim/src/a.rs`, one file per line with the imported names.
    fn imported(text: &str) -> Vec<String> {
        let manifest = |name: &str| format!("[package]\nname = \"jostle-{name}\"\n");
        let mut files = vec![File::text("sim/Cargo.toml", &manifest("sim"))];
        files.push(File::text("game/Cargo.toml", &manifest("game")));
        files.push(File::text("sim/src/a.rs", text));
        let others = ["sim/src/lib.rs", "sim/src/b.rs", "sim/src/b/c.rs", "sim/src/d/mod.rs"];
        let others = others.into_iter().chain(["sim/src/a/e.rs", "game/src/lib.rs"]);
        files.extend(others.map(|path| File::text(path, "")));
        let sources = parse(&files).expect("parses");
        let found = imports(&sources, &crates(&files));
        let lines = found.iter().map(|((_, to), names)| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            format!("{to} {}", names.join(" "))
        });
        lines.collect()
    }

    #[test]
    fn an_import_is_of_the_deepest_file_on_its_path() {
        let text = "use crate::{X, b::{self, B as Y, c::*}, d::D};\nuse jostle_game::Game;\n";
        let all = [
            "game/src/lib.rs Game",
            "sim/src/b.rs B b",
            "sim/src/b/c.rs *",
            "sim/src/d/mod.rs D",
            "sim/src/lib.rs X",
        ];
        assert_eq!(imported(text), all);
        assert_eq!(imported("use std::fs;\nuse self::own::f;\nfn b() { b() }\n"), [""; 0]);
    }

    #[test]
    fn paths_in_code_and_in_macros_are_imports() {
        assert_eq!(imported("fn f(x: super::b::B) {}"), ["sim/src/b.rs B"]);
        assert_eq!(imported("fn f() { e::g() }"), ["sim/src/a/e.rs g"]);
        assert_eq!(imported("fn f() { print!(\"{}\", [1, crate::d::N]) }"), ["sim/src/d/mod.rs N"]);
        assert_eq!(imported("mod own { fn f() { super::super::b::g() } }"), ["sim/src/b.rs g"]);
        assert_eq!(
            imported("use crate::b;\nfn f() { b::c::g() }"),
            ["sim/src/b.rs b", "sim/src/b/c.rs g"]
        );
    }
}
