//! The reference of scene files, docs/scenes.md: its examples parse, and it names every field.

use super::fields_of_the_top_level;
use crate::Scene;
use crate::scene::Tools;

const REFERENCE: &str = include_str!("../../../../docs/scenes.md");

/// The blocks of a kind of code in the reference.
fn reference_blocks(language: &str) -> Vec<&'static str> {
    let opening = format!("```{language}\n");
    let blocks = REFERENCE.split(opening.as_str()).skip(1);
    blocks.map(|rest| rest.split("```").next().expect("a closed block")).collect()
}

#[test]
fn the_references_example_parses_and_its_error_is_true() {
    let examples = reference_blocks("toml");
    let (whole, wall, launcher, sling, game) = match examples[..] {
        [whole, wall, launcher, sling, game] => (whole, wall, launcher, sling, game),
        _ => panic!("{} examples", examples.len()),
    };
    let with_wall = Scene::parse("yard.toml", &format!("{whole}\n{wall}"));
    assert_eq!(with_wall.unwrap_or_else(|error| panic!("{error}")).layouts.len(), 2);
    let yard = Scene::parse("yard.toml", whole).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((yard.layouts.len(), yard.emitters.len()), (1, 1));
    let launching = Scene::parse("yard.toml", &format!("{whole}\n{launcher}"));
    assert_eq!(launching.unwrap_or_else(|error| panic!("{error}")).launchers.len(), 1);
    let range = Scene::parse("range.toml", sling).unwrap_or_else(|error| panic!("{error}"));
    assert!(range.sling.is_some());
    let push = Scene::parse("push.toml", game).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((push.rules.zones.len(), push.rules.rules.len()), (1, 1));
    let wrong = whole.replace("radius = 5", "radius = -3");
    let error = Scene::parse("my-yard.toml", &wrong).expect_err("a negative radius");
    assert!(REFERENCE.contains(&error.to_string()), "{error}");
}

#[test]
fn the_reference_names_every_field_of_the_top_level() {
    for field in fields_of_the_top_level() {
        let forms = [
            format!("`{field}`"),
            format!("`[{field}]`"),
            format!("`[[{field}]]`"),
            format!("`[{field}."),
        ];
        assert!(forms.iter().any(|form| REFERENCE.contains(form)), "{field} is not documented");
    }
    for (tool, _) in Tools::NAMES {
        assert!(REFERENCE.contains(&format!("| `{tool}` |")), "{tool} is not documented");
    }
}
