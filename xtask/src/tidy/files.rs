//! The files of a checkout.

use crate::shell::output_of;
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;
use std::process::Command;

/// A file that git tracks, or a new one that is not ignored.
pub struct File {
    /// Path relative to the root, with slashes.
    pub path: String,
    /// The file's text, or `None` if it is not UTF-8.
    pub text: Option<String>,
    pub bytes: usize,
}

impl File {
    /// Creates a file that exists only in memory, for tests.
    #[cfg(test)]
    pub fn text(path: &str, text: &str) -> Self {
        Self { path: path.into(), bytes: text.len(), text: Some(text.into()) }
    }
}

/// Reads tracked files and new ones that are not ignored.
pub fn read(root: &Path) -> Result<Vec<File>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "--cached", "--others", "--exclude-standard", "-z"]);
    let listed = output_of(git.current_dir(root)).context("tidy works in a git checkout")?;
    let mut files = Vec::new();
    for path in listed.split('\0').filter(|path| !path.is_empty()) {
        // A file whose removal has not been staged is still listed.
        if let Ok(content) = fs::read(root.join(path)) {
            let bytes = content.len();
            files.push(File { path: path.into(), text: String::from_utf8(content).ok(), bytes });
        }
    }
    Ok(files)
}
