//! The directory that holds the page, and what travels in place of its files: their compressed variants.
//!
//! A file is written only when its content changed, so that nothing that depends on it is rebuilt for nothing.

use crate::files::{Files, add_tree};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

/// Smaller files are compressed as well as can be even in a hurry: the dictionary saves up to 8 % of them.
const LARGE_BYTES: usize = 256 << 10;
/// Sizes of blocks, and whether brotli's dictionary is used. Results for the program differ by 0.2 %, and another setting is best
/// after each change of it.
const SETTINGS: [(i32, bool); 7] =
    [(16, true), (17, true), (18, true), (19, true), (16, false), (17, false), (19, false)];

/// How long the compression may take.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Effort {
    /// A second: for development.
    Hurried,
    /// The best of several settings: what travels from a release is what is measured.
    Good,
    /// The same, also of files that are compressed already.
    Release,
}

/// Writes each file and its compressed variant into `dist`, unless it is there already.
pub fn write_changed(dist: &Path, files: &Files, effort: Effort) -> Result<()> {
    for (name, content) in files {
        let path = dist.join(name);
        let packed = packed_name(&path);
        let same = fs::read(&path).is_ok_and(|old| old == *content);
        let is_packed = same && packed.exists() && effort != Effort::Release;
        // First: a file that is there as it should be says that its variant is too.
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

/// Pictures are compressed already.
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

/// Packs for the wire, with the best of its settings.
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

/// Removes what an earlier build left and this one did not make.
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

/// Prints the size of the page's program; returns how many of its bytes travel.
pub fn report(dist: &Path, files: &Files) -> Result<u64> {
    let wasm = files.get(Path::new("client_bg.wasm")).map_or(0, Vec::len);
    let packed = fs::metadata(dist.join("client_bg.wasm.br")).context("the program")?.len();
    let count = files.len();
    println!("web: {count} files; the program is {wasm} bytes, {packed} as it travels");
    Ok(packed)
}
