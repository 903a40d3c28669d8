//! Gathers the files of the page.

use crate::guide;
use crate::text::{squeezed, without_comments};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// The files of a page, as a map from the path below `dist` to the content.
pub type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Gathers all files of the page.
pub fn gather(root: &Path, bound: &Path) -> Result<Files> {
    let mut files = BTreeMap::new();
    add_tree(&mut files, bound, Path::new(""))?;
    add_tree(&mut files, &root.join("client-web/web"), Path::new(""))?;
    for name in ["client.js", "index.html", "style.css"] {
        let content = files.get_mut(Path::new(name)).with_context(|| format!("no {name}"))?;
        *content = without_comments(std::str::from_utf8(content).context("a text")?).into_bytes();
    }
    let style = files.get_mut(Path::new("style.css")).context("no style.css")?;
    *style = squeezed(std::str::from_utf8(style).context("a text")?).into_bytes();
    let guide = fs::read_to_string(root.join("docs/scenes.md")).context("docs/scenes.md")?;
    files.insert("scenes.html".into(), guide::page(&guide).into_bytes());
    add_tree(&mut files, &root.join("assets/sprites"), Path::new("sprites"))?;
    add_tree(&mut files, &root.join("assets/pictures"), Path::new("pictures"))?;
    add_tree(&mut files, &root.join("assets/scenes"), Path::new("scenes"))?;
    Ok(files)
}

/// Puts a digest of all files into the URLs in the document, and into a file for the server. Browsers may cache files
/// with such URLs forever.
pub fn stamp(files: &mut Files) -> Result<()> {
    let mut digest = DefaultHasher::new();
    files.hash(&mut digest);
    let version = format!("v-{:016x}", digest.finish());
    let document = files.get_mut(Path::new("index.html")).context("no index.html")?;
    let text = std::str::from_utf8(document).context("index.html")?;
    *document = text.replace("=\"/assets/", &format!("=\"/assets/{version}/")).into_bytes();
    files.insert("version.txt".into(), version.into_bytes());
    Ok(())
}

/// Adds all files below `dir`, if it exists, under `prefix`.
pub fn add_tree(files: &mut Files, dir: &Path, prefix: &Path) -> Result<()> {
    if !dir.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(dir).with_context(|| format!("cannot list {}", dir.display()))? {
        let path = entry?.path();
        let name = prefix.join(path.file_name().expect("a listed entry has a name"));
        if path.is_dir() {
            add_tree(files, &path, &name)?;
        } else {
            let content =
                fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            files.insert(name, content);
        }
    }
    Ok(())
}
