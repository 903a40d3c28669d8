//! Determines what a change can affect: the crates that it touches and all crates that depend on them.

use crate::shell::{output_of, root};
use crate::workspace::{Package, packages};
use anyhow::{Context, Result, bail};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Files outside the crates that are compiled into one of them.
const DATA: [(&str, &str); 11] = [
    ("shaders/", "jostle-client-web"),
    ("assets/scenes/", "jostle-game"),
    ("assets/", "jostle-client-web"),
    ("deploy/", "jostle-server"),
    ("docs/scenes.md", "jostle-game"),
    ("docs/scene.schema.json", "jostle-game"),
    ("docs/examples/tiled/", "jostle-game"),
    ("docs/protocol.md", "jostle-protocol"),
    ("docs/examples/", "jostle-cli"),
    ("tests/scenes/", "jostle-game"),
    ("tests/inputs/", "jostle-game"),
];
/// Files that every crate depends on.
const SHARED: [&str; 5] =
    ["Cargo.toml", "Cargo.lock", "rust-toolchain.toml", "clippy.toml", ".cargo/config.toml"];

/// The differences between a revision and the working tree.
pub struct TreeChange {
    /// Changed, new and removed files, relative to the root.
    pub paths: Vec<String>,
    /// Names of the affected crates and of all crates that depend on them.
    pub packages: Vec<String>,
}

impl TreeChange {
    /// Asks git for the differences between a revision and the working tree.
    pub fn since(revision: &str) -> Result<TreeChange> {
        let git = |args: &[&str]| output_of(Command::new("git").args(args).current_dir(root()));
        let changed = git(&["diff", "--name-only", "--no-renames", revision, "--"])
            .with_context(|| format!("--since {revision}: no such revision"))?;
        let new = git(&["ls-files", "--others", "--exclude-standard"])?;
        let paths: Vec<String> = changed.lines().chain(new.lines()).map(str::to_owned).collect();
        if paths.is_empty() {
            bail!("--since {revision}: nothing differs from it");
        }
        let all = packages()?;
        let touched = touched(&paths, &directories(&all));
        let packages = above(&touched, &all).into_iter().map(str::to_owned).collect();
        Ok(TreeChange { paths, packages })
    }

    /// Whether a file below one of these directories has changed.
    pub fn touches(&self, prefixes: &[&str]) -> bool {
        self.paths.iter().any(|path| prefixes.iter().any(|prefix| path.starts_with(prefix)))
    }

    /// Whether one of these crates, or one of their dependencies, has changed.
    pub fn affects(&self, names: &[&str]) -> bool {
        self.packages.iter().any(|package| names.contains(&package.as_str()))
    }
}

/// Each crate's directory relative to the root, with a trailing slash, and its name.
fn directories(packages: &[Package]) -> Vec<(String, &str)> {
    let root = root();
    let directory = |package: &Package| {
        let path = package.manifest_path.parent().unwrap_or(Path::new(""));
        format!("{}/", path.strip_prefix(&root).unwrap_or(path).display())
    };
    packages.iter().map(|package| (directory(package), package.name.as_str())).collect()
}

/// The crates that contain these files. If crates are nested, the innermost counts.
fn touched<'a>(paths: &[String], directories: &[(String, &'a str)]) -> BTreeSet<&'a str> {
    if paths.iter().any(|path| SHARED.contains(&path.as_str())) {
        return directories.iter().map(|(_, name)| *name).collect();
    }
    let data = DATA.into_iter().map(|(directory, name)| (directory.to_owned(), name));
    let data = data.filter_map(|(directory, name)| {
        let known = directories.iter().find(|(_, known)| *known == name)?;
        Some((directory, known.1))
    });
    let all: Vec<(String, &str)> = directories.iter().cloned().chain(data).collect();
    let owner = |path: &String| {
        let around = all.iter().filter(|(directory, _)| path.starts_with(directory.as_str()));
        around.max_by_key(|(directory, _)| directory.len()).map(|(_, name)| *name)
    };
    paths.iter().filter_map(owner).collect()
}

/// The given crates and all that depend on them through any kind of dependency.
fn above<'a>(touched: &BTreeSet<&'a str>, packages: &'a [Package]) -> BTreeSet<&'a str> {
    let mut found = touched.clone();
    loop {
        let depends = |package: &&Package| {
            package.dependencies.iter().any(|other| found.contains(other.name.as_str()))
        };
        let more: Vec<&str> = packages.iter().filter(depends).map(|p| p.name.as_str()).collect();
        let before = found.len();
        found.extend(more);
        if found.len() == before {
            return found;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{above, touched};
    use crate::workspace::{Dependency, Package};

    fn package(name: &str, dependencies: &[&str]) -> Package {
        let dependency = |name: &&str| Dependency { name: (*name).to_owned() };
        Package {
            name: name.to_owned(),
            manifest_path: format!("/{name}/Cargo.toml").into(),
            dependencies: dependencies.iter().map(dependency).collect(),
        }
    }

    #[test]
    fn a_file_belongs_to_the_innermost_crate() {
        let directories = [
            ("room/".to_owned(), "room"),
            ("tests/".to_owned(), "tests"),
            ("tests/fuzz/".to_owned(), "fuzz"),
        ];
        let of = |path: &str| {
            let names: Vec<&str> = touched(&[path.to_owned()], &directories).into_iter().collect();
            names
        };
        assert_eq!(of("room/src/room.rs"), ["room"]);
        assert_eq!(of("tests/fuzz/src/lib.rs"), ["fuzz"]);
        assert_eq!(of("tests/src/lib.rs"), ["tests"]);
        assert_eq!(of("README.md"), [""; 0]);
        assert_eq!(of("Cargo.lock"), ["fuzz", "room", "tests"]);
    }

    #[test]
    fn what_depends_on_a_crate_is_affected_too() {
        let packages = [
            package("sim", &[]),
            package("room", &["sim"]),
            package("server", &["room"]),
            package("xtask", &[]),
        ];
        let names = |touched: &'static str| {
            let found: Vec<&str> = above(&[touched].into(), &packages).into_iter().collect();
            found
        };
        assert_eq!(names("room"), ["room", "server"]);
        assert_eq!(names("sim"), ["room", "server", "sim"]);
        assert_eq!(names("xtask"), ["xtask"]);
    }
}
