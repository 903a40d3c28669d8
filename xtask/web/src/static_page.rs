//! The page without a server: a folder for any file host. It is the same page that the server embeds, but with relative
//! URLs, a mark in the document, and the list of scenes as a file. An element next to it plays scenes in other pages.

use anyhow::{Context, Result, ensure};
use jostle_game::Scene;
use jostle_protocol::web::{SceneCard, Scenes};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The start of the page's document.
const ROOT: &str = "<html ";

/// The element that plays scenes in other pages, and an example of such a page.
const ELEMENT: [(&str, &str); 3] = [
    ("jostle-scene.js", include_str!("static_page/jostle-scene.js")),
    ("example.html", include_str!("static_page/example.html")),
    ("example.toml", include_str!("static_page/example.toml")),
];

/// Writes the files of a page into the folder `out`, replacing its previous contents.
pub fn write(out: &Path, files: &BTreeMap<PathBuf, Vec<u8>>) -> Result<()> {
    if out.exists() {
        fs::remove_dir_all(out).with_context(|| format!("cannot clear {}", out.display()))?;
    }
    for (name, content) in site(files)? {
        let path = out.join(name);
        let dir = path.parent().expect("a file of the folder lies in one");
        fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
        fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// All files of the folder, by relative path. All that the document uses are in a folder named after their digest, so that
/// no browser mixes two versions.
fn site(files: &BTreeMap<PathBuf, Vec<u8>>) -> Result<BTreeMap<PathBuf, Vec<u8>>> {
    let text = |name: &str| {
        let content = files.get(Path::new(name)).with_context(|| format!("no {name}"))?;
        std::str::from_utf8(content).with_context(|| name.to_owned())
    };
    let folder = format!("assets/{}", text("version.txt")?);
    let mut site = BTreeMap::new();
    for (name, content) in files {
        if !["index.html", "version.txt"].map(Path::new).contains(&name.as_path()) {
            site.insert(Path::new(&folder).join(name), content.clone());
        }
    }
    site.insert(
        Path::new(&folder).join("scenes.json"),
        serde_json::to_vec(&scenes(&folder, files))?,
    );
    site.extend(ELEMENT.map(|(name, text)| (name.into(), text.into())));
    site.insert("index.html".into(), document(text("index.html")?, &folder)?.into());
    Ok(site)
}

/// Returns the document with relative URLs, marked with the folder that contains all other files.
fn document(page: &str, folder: &str) -> Result<String> {
    ensure!(page.contains(ROOT), "index.html has no {ROOT:?}");
    let marked = page.replacen(ROOT, &format!("{ROOT}data-static=\"{folder}\" "), 1);
    let relative = marked.replace("=\"/", "=\"");
    ensure!(relative.contains(&format!("=\"{folder}/")), "index.html names no file of {folder}");
    Ok(relative)
}

/// The answer of a server to `/api/scenes`, to be stored in a file.
fn scenes(folder: &str, files: &BTreeMap<PathBuf, Vec<u8>>) -> Scenes {
    let card = |scene: &Scene| {
        let picture = format!("pictures/{}.webp", scene.name);
        let is_there = files.contains_key(Path::new(&picture));
        SceneCard::of(scene, is_there.then(|| format!("{folder}/{picture}")))
    };
    Scenes { scenes: Scene::built_in().iter().map(card).collect(), guest_scenes: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn the_document_is_marked_and_its_addresses_are_relative() {
        let page =
            r#"<html lang="en"><link href="/assets/v-1/a.css"><a href="https://x/"></a></html>"#;
        let expected = r#"<html data-static="assets/v-1" lang="en"><link href="assets/v-1/a.css"><a href="https://x/"></a></html>"#;
        assert_eq!(document(page, "assets/v-1").expect("a page"), expected);
        assert!(document("<p>", "assets/v-1").is_err());
    }

    #[test]
    fn the_example_is_a_scene() {
        let [.., (file, text)] = ELEMENT;
        assert_eq!(Scene::parse(file, text).map(|scene| scene.title).as_deref(), Ok("Yard"));
    }

    #[test]
    fn files_lie_below_their_version_and_scenes_are_listed() {
        let page = r#"<html lang="en"><script src="/assets/v-1/start.js"></script></html>"#;
        let files = [
            ("index.html", page),
            ("version.txt", "v-1"),
            ("start.js", "1"),
            ("pictures/arena.webp", "2"),
        ];
        let files = files.map(|(name, text)| (PathBuf::from(name), text.into()));
        let site = site(&BTreeMap::from(files)).expect("a site");
        let names: Vec<_> = site.keys().filter_map(|name| name.to_str()).collect();
        let below = ["pictures/arena.webp", "scenes.json", "start.js"];
        let below = below.map(|name| format!("assets/v-1/{name}"));
        let beside = ["example.html", "example.toml", "index.html", "jostle-scene.js"];
        assert_eq!(names, [&below[..], &beside.map(str::to_owned)].concat());
        let listed: Value = serde_json::from_slice(&site[Path::new(&below[1])]).expect("JSON");
        assert_eq!(listed["scenes"][0]["picture"], "assets/v-1/pictures/arena.webp");
        assert_eq!(listed["scenes"].as_array().map(Vec::len), Some(Scene::built_in().len()));
    }
}
