//! `cargo xtask tidy`: the habits of this code base as checks, so that nobody has to remember
//! them in a review. Each check reads tracked files and returns findings; it changes nothing.

mod arrows;
mod links;
mod text;

use crate::shell::{output_of, root, say};
use crate::workspace::packages;
use anyhow::{Context, Result, bail};
use std::fs;
use std::process::Command;

/// What belongs into a repository is smaller; pictures are the largest.
const FILE_BYTES_MAX: usize = 1_500_000;

/// A file that git tracks or would track.
struct File {
    /// From the root, with slashes.
    path: String,
    /// Text, or `None` if it is not UTF-8.
    text: Option<String>,
    bytes: usize,
}

/// Something to mend, with its place.
type Finding = String;

/// All checks; any finding is an error, after all were printed.
pub fn tidy() -> Result<()> {
    let files = files()?;
    let mut findings = sizes(&files);
    findings.extend(text::check(&files));
    findings.extend(links::check(&files));
    findings.extend(arrows::check(&packages()?));
    findings.extend(one_set_of_lints(&files));
    for finding in &findings {
        say("tidy", finding);
    }
    for note in text::long_files(&files) {
        say("tidy", &format!("note: {note}"));
    }
    if findings.is_empty() {
        say("tidy", &format!("{} files, nothing to mend", files.len()));
        return Ok(());
    }
    bail!("{} things to mend", findings.len())
}

/// The crates that must be deterministic refuse the same things.
fn one_set_of_lints(files: &[File]) -> Vec<Finding> {
    let text = |path: &str| files.iter().find(|file| file.path == path)?.text.as_deref();
    let expected = text("sim/clippy.toml");
    let others = ["protocol/clippy.toml", "room/clippy.toml"];
    let differs = others.into_iter().filter(|path| expected.is_none() || text(path) != expected);
    differs.map(|path| format!("{path}: must be the same as sim/clippy.toml")).collect()
}

/// Tracked files and new ones that are not ignored.
fn files() -> Result<Vec<File>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "--cached", "--others", "--exclude-standard", "-z"]);
    let listed = output_of(git.current_dir(root())).context("tidy works in a git checkout")?;
    let paths = listed.split('\0').filter(|path| !path.is_empty());
    let mut files = Vec::new();
    for path in paths {
        // A file that was removed but not yet staged is still listed.
        if let Ok(content) = fs::read(root().join(path)) {
            let bytes = content.len();
            files.push(File {
                path: path.to_owned(),
                text: String::from_utf8(content).ok(),
                bytes,
            });
        }
    }
    Ok(files)
}

fn sizes(files: &[File]) -> Vec<Finding> {
    let large = files.iter().filter(|file| file.bytes > FILE_BYTES_MAX);
    large
        .map(|file| format!("{}: {} bytes, at most {FILE_BYTES_MAX}", file.path, file.bytes))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{FILE_BYTES_MAX, File, sizes};

    #[test]
    fn a_large_file_is_found_and_one_at_the_limit_is_not() {
        let file = |bytes| File { path: "a.png".into(), text: None, bytes };
        assert_eq!(sizes(&[file(FILE_BYTES_MAX)]).len(), 0);
        assert_eq!(sizes(&[file(FILE_BYTES_MAX + 1)]).len(), 1);
    }
}
