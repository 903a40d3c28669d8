//! `cargo xtask gallery`: checks the scenes in `assets/gallery`, lets bots play each for a minute, draws them and writes
//! a page that shows them.

use crate::packages;
use crate::shell::{cargo, in_path, output_of, root, run, say, target_dir};
use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const GALLERY: &str = "assets/gallery";
/// The page up to its list of scenes.
const HEAD: &str = include_str!("gallery/head.html");

/// A scene as listed by the program that draws it.
#[derive(Deserialize)]
struct Exhibit {
    name: String,
    title: String,
    about: String,
    players_max: u16,
    /// The end of the address that opens the scene in a page of Jostle.
    link: String,
}

/// Checks and draws all scenes. `page` is the address of the page that plays them; `keeps` puts the pictures next to the
/// scenes, where servers find them.
pub fn gallery(page: &str, keeps: bool) -> Result<()> {
    let (from, out) = (root().join(GALLERY), target_dir().join("gallery"));
    check(&scenes(&from)?)?;
    provide_drawing()?;
    fs::create_dir_all(&out).with_context(|| format!("cannot make {}", out.display()))?;
    say("gallery", "draw the scenes");
    let mut draw = cargo(&["run", "--quiet", "--package", "jostle-picture"]);
    run(draw.args(["--example", "gallery", "--"]).args([&from, &out]))?;
    let listed = fs::read(out.join("scenes.json")).context("the list of scenes")?;
    let exhibits: Vec<Exhibit> = serde_json::from_slice(&listed).context("the list of scenes")?;
    for Exhibit { name, .. } in &exhibits {
        let [scene, picture] = [format!("{name}.toml"), format!("{name}.webp")];
        copy(&from.join(&scene), &out.join(&scene))?;
        if keeps {
            copy(&out.join(&picture), &from.join(&picture))?;
        }
    }
    let shown = out.join("index.html");
    fs::write(&shown, document(&exhibits, page))?;
    say("gallery", &format!("{} scenes in {}", exhibits.len(), shown.display()));
    Ok(())
}

/// The paths of all scene files, sorted.
fn scenes(from: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(from).with_context(|| format!("cannot list {}", from.display()))?;
    let paths = entries.map(|entry| Ok(entry?.path()));
    let mut paths = paths.collect::<Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    Ok(paths)
}

/// Checks, plans and rehearses each scene. A failure names all scenes that have one; the commands have said why.
fn check(scenes: &[PathBuf]) -> Result<()> {
    run(&mut cargo(&["build", "--package", "jostle-cli", "--bin", "jostle"]))?;
    let program = target_dir().join("debug/jostle");
    let mut wrong = Vec::new();
    for path in scenes {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        say("gallery", &format!("check, plan and rehearse {name}"));
        let fails = |command: &str| {
            output_of(Command::new(&program).args(["scene", command]).arg(path)).map(|said| {
                let last =
                    said.lines().filter(|line| line.contains("worst tick") || command == "try");
                last.for_each(|line| println!("    {}", line.trim()));
            })
        };
        if ["check", "plan", "try"].into_iter().any(|command| fails(command).is_err()) {
            wrong.push(name);
        }
    }
    ensure!(wrong.is_empty(), "something is wrong with {}", wrong.join(", "));
    Ok(())
}

/// Makes sure that pictures can be drawn and compressed.
fn provide_drawing() -> Result<()> {
    let drivers = "mesa-vulkan-drivers";
    let missing = [(drivers, packages::has(drivers)), ("webp", in_path("cwebp"))];
    let missing: Vec<&str> = missing.iter().filter(|(_, is)| !is).map(|(name, _)| *name).collect();
    packages::provide("the gallery's pictures (Mesa's Vulkan driver, cwebp)", &missing)
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::copy(from, to).with_context(|| format!("cannot copy {}", from.display()))?;
    Ok(())
}

/// The page: a card for each scene. Pictures are fetched as they are scrolled to.
fn document(exhibits: &[Exhibit], page: &str) -> String {
    let mut text = HEAD.to_owned();
    for Exhibit { name, title, about, players_max, link } in exhibits {
        let [page, title, about] = [page, title, about].map(escaped);
        text += &format!(
            "<li>\n<a href=\"{page}{link}&amp;bots=3\"><img src=\"{name}.webp\" alt=\"\" width=\"640\" height=\"360\" \
             loading=\"lazy\"><strong>{title}</strong></a>\n<p>{about}</p>\n<p>Up to {players_max} players · \
             <a href=\"{name}.toml\">scene file</a></p>\n</li>\n"
        );
    }
    text + "</ul>\n"
}

/// Text for HTML, also within an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_links_to_each_scene_and_escapes_its_texts() {
        let exhibit = Exhibit {
            name: "yard".into(),
            title: "<Yard> & \"co\"".into(),
            about: "A <b>.".into(),
            players_max: 8,
            link: "#scene=abc".into(),
        };
        let page = document(&[exhibit], "../static/");
        assert!(page.starts_with("<!doctype html>") && page.ends_with("</ul>\n"));
        assert!(page.contains("<a href=\"../static/#scene=abc&amp;bots=3\">"), "{page}");
        assert!(page.contains("&lt;Yard> &amp; &quot;co&quot;") && !page.contains("<b>"), "{page}");
        assert!(page.contains("src=\"yard.webp\"") && page.contains("loading=\"lazy\""), "{page}");
    }
}
