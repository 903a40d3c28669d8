//! Finds scenes by their names on the command line.

use crate::output::{Failure, OrFail};
use jostle_game::Scene;
use jostle_game::scene::line_at;
use jostle_server::files::read_regular;
use jostle_server::limits::SETTINGS_FILE_BYTES_MAX;
use std::path::Path;

/// The scene with this name, which is a built-in one or the path of a TOML file.
pub fn scene_named(name: &str) -> Result<Scene, Failure> {
    let mut scenes = Scene::built_in();
    if let Some(index) = scenes.iter().position(|scene| scene.name == name) {
        return Ok(scenes.swap_remove(index));
    }
    if !Path::new(name).exists() {
        let names: Vec<_> = scenes.iter().map(|scene| scene.name.as_str()).collect();
        let allowed = names.join(", ");
        let text = format!("scene: found {name:?}; allowed: {allowed}, or the path of a TOML file");
        return Err(Failure::Usage(text));
    }
    scene_file(Path::new(name))
}

/// Reads and checks a scene file.
pub fn scene_file(path: &Path) -> Result<Scene, Failure> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).or_usage(&file)?;
    parsed(&file, bytes)
}

/// Like [`scene_file`], for a file that was found in a directory and may contain anything.
pub fn found_scene_file(path: &Path) -> Result<Scene, Failure> {
    let file = path.display().to_string();
    let bytes = read_regular(path, SETTINGS_FILE_BYTES_MAX).or_usage(&file)?;
    parsed(&file, bytes)
}

fn parsed(file: &str, bytes: Vec<u8>) -> Result<Scene, Failure> {
    let source = text_of(file, bytes)?;
    Scene::parse(file, &source).map_err(|error| Failure::Check(error.to_string()))
}

/// Decodes the text of a hand-written file. The error names the first line that is not valid text.
pub fn text_of(file: &str, bytes: Vec<u8>) -> Result<String, Failure> {
    String::from_utf8(bytes).map_err(|error| {
        let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
        let found = "found bytes that are not UTF-8; allowed: UTF-8 text";
        Failure::Check(format!("{file}:{line}: file: {found}"))
    })
}
