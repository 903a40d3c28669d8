//! Writes the directory of the page: its files, and the compressed variants that are sent instead.
//!
//! A file is written only if its content has changed, to avoid needless rebuilds.

use crate::files::{Files, add_tree};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

/// Files smaller than this get the best compression even in a hurry, since the dictionary saves up to 8 %.
const LARGE_BYTES: usize = 256 << 10;
/// Block sizes, each with whether to use brotli's dictionary. Results for the program differ by 0.2 %, and the best
/// setting varies from build to build.
const SETTINGS: [(i32, bool); 7] =
    [(16, true), (17, true), (18, true), (19, true), (16, false), (17, false), (19, false)];

/// How much time compression may take.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Effort {
    /// About a second; for development.
    Hurried,
    /// The best of several settings, so that measured sizes are those of a release.
    Good,
    /// Like `Good`, but also for files that are already compressed.
    Release,
}

/// Writes each file and its compressed variant into `dist`, unless it is already up to date.
pub fn write_changed(dist: &Path, files: &Files, effort: Effort) -> Result<()> {
    for (name, content) in files {
        let path = dist.join(name);
        let packed = packed_name(&path);
        let same = fs::read(&path).is_ok_and(|old| old == *content);
        let is_packed = same && packed.exists() && effort != Effort::Release;
        // Write the variant first, so that if a file is up to date, its variant is too.
        if compressible(name) && !is_packed {
            write(&packed, &compress(content, effort)?)?;
        }
        if !same {
            write(&path, content)?;
        }
    }
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> Result<()> {
    if let Some(dir) = path.parent() {
        fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
    }
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}

/// Whether a file is worth compressing; pictures are already compressed.
fn compressible(name: &Path) -> bool {
    let extension = name.extension().and_then(|extension| extension.to_str());
    matches!(
        extension,
        Some("css" | "html" | "js" | "json" | "svg" | "toml" | "txt" | "wasm" | "webmanifest")
    )
}

fn packed_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".br");
    name.into()
}

/// Compresses a file with whichever setting works best.
fn compress(content: &[u8], effort: Effort) -> Result<Vec<u8>> {
    let (quality, settings) = match effort {
        Effort::Hurried if content.len() > LARGE_BYTES => (2, &SETTINGS[..1]),
        _ => (11, &SETTINGS[..]),
    };
    let packed: Vec<Result<Vec<u8>>> = thread::scope(|scope| {
        let pack = |&setting| scope.spawn(move || compress_with(content, quality, setting));
        let running: Vec<_> = settings.iter().map(pack).collect();
        running.into_iter().map(|one| one.join().expect("brotli does not panic")).collect()
    });
    let packed: Vec<Vec<u8>> = packed.into_iter().collect::<Result<_>>()?;
    packed.into_iter().min_by_key(Vec::len).context("no setting of brotli")
}

fn compress_with(
    content: &[u8],
    quality: i32,
    (lgblock, use_dictionary): (i32, bool),
) -> Result<Vec<u8>> {
    let parameters = brotli::enc::BrotliEncoderParams {
        quality,
        lgwin: 22,
        lgblock,
        use_dictionary,
        ..Default::default()
    };
    let mut packed = Vec::new();
    brotli::BrotliCompress(&mut &content[..], &mut packed, &parameters).context("brotli")?;
    Ok(packed)
}

/// Removes files from earlier builds that are not part of this one.
pub fn remove_others(dist: &Path, files: &Files) -> Result<()> {
    let mut present = BTreeMap::new();
    add_tree(&mut present, dist, Path::new(""))?;
    for name in present.keys() {
        let made = files.contains_key(name)
            || name.extension().is_some_and(|extension| extension == "br")
                && files.contains_key(&name.with_extension(""));
        if !made {
            let path = dist.join(name);
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    Ok(())
}

/// Prints the size of the page's program and returns its compressed size.
pub fn report(dist: &Path, files: &Files) -> Result<u64> {
    let wasm = files.get(Path::new("client_bg.wasm")).map_or(0, Vec::len);
    let packed = fs::metadata(dist.join("client_bg.wasm.br")).context("the program")?.len();
    let count = files.len();
    println!("web: {count} files; the program is {wasm} bytes, {packed} as it travels");
    Ok(packed)
}
