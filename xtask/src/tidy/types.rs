//! Figures about types for `cargo xtask tidy --figures`: their size, the number of files they are spread over, and
//! names used more than once.

use super::source::SourceFile;
use std::collections::{BTreeMap, BTreeSet};
use syn::visit::{self, Visit};
use syn::{Ident, ImplItem, ItemEnum, ItemImpl, ItemStruct, ItemTrait, ItemUnion, Type};

pub const METHODS_MAX: usize = 50;
pub const FILES_MAX: usize = 3;
/// A name is listed if at least this many types share it.
pub const OFTEN: usize = 4;

/// Figures about types, one per line.
#[derive(Default)]
pub struct Types {
    /// Types with more than [`METHODS_MAX`] methods, not counting trait methods.
    pub large: Vec<String>,
    /// Types with methods in more than [`FILES_MAX`] files.
    pub spread: Vec<String>,
    /// Number of names shared by several types.
    pub shared: usize,
    /// Names shared by at least [`OFTEN`] types.
    pub often: Vec<String>,
}

/// Collects the figures. If several types in a crate have the same name, methods are attributed to the one whose file
/// is closest.
pub fn types(sources: &[SourceFile]) -> Types {
    let mut reader = TypeVisitor::default();
    for source in sources {
        reader.path.clone_from(&source.path);
        source.items.iter().for_each(|item| reader.visit_item(item));
    }
    let TypeVisitor { defined, methods, .. } = reader;
    let mut of: BTreeMap<(&str, &str), (usize, BTreeSet<&str>)> = BTreeMap::new();
    for (name, path, count) in &methods {
        let Some(homes) = defined.get(name) else { continue };
        let top = |path: &str| path.split('/').next().map(str::to_owned);
        let homes = homes.iter().filter(|home| top(home) == top(path));
        let Some(home) = homes.max_by_key(|home| shared_bytes(home, path)) else { continue };
        let (methods, files) = of.entry((name, home)).or_default();
        *methods += count;
        files.insert(path);
    }
    let mut types = Types::default();
    for ((name, home), (methods, files)) in of {
        if methods > METHODS_MAX {
            types.large.push(format!("{methods:4} {home} {name}"));
        }
        if files.len() > FILES_MAX {
            types.spread.push(format!("{:4} {home} {name}", files.len()));
        }
    }
    for (name, homes) in defined.iter().filter(|(_, homes)| homes.len() > 1) {
        types.shared += 1;
        if homes.len() >= OFTEN {
            types.often.push(format!("{:4} {name}", homes.len()));
        }
    }
    types
}

fn shared_bytes(a: &str, b: &str) -> usize {
    a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count()
}

#[derive(Default)]
struct TypeVisitor {
    /// Path of the current file.
    path: String,
    /// The files that define each type, by name.
    defined: BTreeMap<String, Vec<String>>,
    /// For each `impl`: the name of the type, the file, and the number of methods.
    methods: Vec<(String, String, usize)>,
}

impl TypeVisitor {
    fn define(&mut self, name: &Ident) {
        self.defined.entry(name.to_string()).or_default().push(self.path.clone());
    }
}

impl<'ast> Visit<'ast> for TypeVisitor {
    fn visit_item_struct(&mut self, item: &'ast ItemStruct) {
        self.define(&item.ident);
    }

    fn visit_item_enum(&mut self, item: &'ast ItemEnum) {
        self.define(&item.ident);
    }

    fn visit_item_union(&mut self, item: &'ast ItemUnion) {
        self.define(&item.ident);
    }

    fn visit_item_trait(&mut self, item: &'ast ItemTrait) {
        self.define(&item.ident);
        visit::visit_item_trait(self, item);
    }

    fn visit_item_impl(&mut self, item: &'ast ItemImpl) {
        if let (None, Type::Path(path)) = (&item.trait_, item.self_ty.as_ref())
            && let Some(last) = path.path.segments.last()
        {
            let methods = item.items.iter().filter(|item| matches!(item, ImplItem::Fn(_)));
            self.methods.push((last.ident.to_string(), self.path.clone(), methods.count()));
        }
        visit::visit_item_impl(self, item);
    }
}

#[cfg(test)]
mod tests {
    use super::types;
    use crate::tidy::files::File;
    use crate::tidy::source::parse;

    #[test]
    fn methods_count_for_the_nearest_type_of_their_name() {
        let methods: String = (0..51).map(|n| format!("fn f{n}() {{}}\n")).collect();
        let file = |path: &str, text: String| File::text(path, &text);
        let files = [
            file("sim/src/a.rs", "struct S;".to_owned()),
            file("sim/src/a/b.rs", format!("impl S {{\n{methods}}}\n")),
            file("sim/src/c.rs", "struct S; impl S { fn f() {} } impl Default for S {}".to_owned()),
            file("game/src/a.rs", "enum S {}".to_owned()),
            file("game/src/b.rs", "struct T; impl T { fn f() {} }".to_owned()),
            file("game/src/c.rs", "impl T {} trait S {}".to_owned()),
        ];
        let found = types(&parse(&files).expect("parses"));
        assert_eq!(found.large, ["  51 sim/src/a.rs S"]);
        assert_eq!((found.shared, found.often), (1, vec!["   4 S".to_owned()]));
        assert!(found.spread.is_empty());
    }
}
