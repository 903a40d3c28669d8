//! Maps of the Tiled editor.

use jostle_cli::tiled::import;
use jostle_game::Scene;

/// A map: an import yields a valid scene, and an error is one line about the file.
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
