//! Draws the scenes of a directory into another one, without a window, and lists them there in `scenes.json`:
//! `cargo run -p jostle-picture --example gallery -- assets/gallery target/gallery`.

#[path = "../picture/cast.rs"]
mod cast;
#[path = "../picture/studio.rs"]
mod studio;

use jostle_client_web::net::scene_link;
use jostle_game::Scene;
use jostle_picture::Headless;
use serde_json::json;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// The moment that the pictures show, in ticks: some seconds after the countdown.
const TICKS: u32 = 540;

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [from, to] = &given[..] else {
        return Err("give a directory of scenes and one for pictures".into());
    };
    let mut paths = fs::read_dir(from)?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>, std::io::Error>>()?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    let mut headless = Headless::open()?;
    let drawn = paths.iter().map(|path| draw(&mut headless, path, to));
    let drawn = drawn.collect::<Result<Vec<_>, _>>()?;
    fs::write(to.join("scenes.json"), serde_json::to_vec(&drawn)?)?;
    Ok(())
}

/// Draws a scene; returns what a page shows of it, and the end of the link that opens it.
fn draw(
    headless: &mut Headless,
    path: &Path,
    to: &Path,
) -> Result<serde_json::Value, Box<dyn Error>> {
    let scene = Scene::parse(&path.display().to_string(), &fs::read_to_string(path)?)?;
    let Scene { name, title, about, players_max, .. } = scene.clone();
    let link = [scene_link::HASH, &scene_link::encode(&scene.source)].concat();
    let bytes = studio::draw(headless, scene, TICKS, None, &to.join(format!("{name}.webp")))?;
    println!("{name}: {bytes} bytes, by {}", headless.adapter);
    Ok(json!({
        "name": name, "title": title, "about": about, "players_max": players_max, "link": link,
    }))
}
