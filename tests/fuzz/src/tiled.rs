//! Properties of maps from the Tiled editor.

use jostle_cli::tiled::import;
use jostle_game::Scene;

/// Checks a map: importing it must yield a valid scene, or an error that is a single line about the file.
pub fn tiled_map(bytes: &[u8]) {
    match import("fuzz.tmj", "fuzz", bytes) {
        Ok(text) => drop(Scene::parse("fuzz.toml", &text).expect("an accepted scene")),
        Err(error) => {
            let sentence = error.to_string();
            assert!(
                sentence.starts_with("fuzz.tmj: ") && sentence.contains("; allowed: "),
                "{sentence}"
            );
        }
    }
}
