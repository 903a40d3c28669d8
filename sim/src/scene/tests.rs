use super::*;
use proptest::prelude::*;

const SMALL: &str = r#"title = "Small"
size = [100, 50]
groups = ["platform", "block"]
pairs = [["block", "platform"]]

[[bodies]]
kind = "wall"
position = [50, 0]
size = [100, 4]

[[bodies]]
kind = "block"
position = [50, 20]
radius = 3
"#;

/// Line, field and a word of what is found, for the small scene with one line replaced.
fn refusal(from: &str, to: &str) -> (usize, String, String) {
    assert!(SMALL.contains(from), "{from} is not in the scene");
    let error = Scene::parse("small.toml", &SMALL.replacen(from, to, 1)).expect_err(to);
    assert_eq!(error.file, "small.toml");
    assert!(!error.allowed.is_empty(), "{to}: nothing is said to be allowed");
    (error.line, error.field, error.found)
}

fn refused(from: &str, to: &str, line: usize, field: &str, found: &str) {
    let (at, path, said) = refusal(from, to);
    assert_eq!((at, path.as_str(), said.as_str()), (line, field, found), "for {to}");
}

#[test]
fn every_shipped_scene_parses() {
    for (file, source) in BUILT_IN {
        if let Err(error) = Scene::parse(file, source) {
            panic!("{error}");
        }
    }
    assert_eq!(Scene::built_in()[0].name, "arena");
}
