//! The defaults that the guide to scenes prints are those of the code.

use super::*;
use crate::Scene;

const GUIDE: &str = include_str!("../../../../docs/scenes.md");

/// The table of the guide below this heading, as a scene's own: every field with its default.
fn printed(solver: &str) -> (String, usize) {
    let heading = format!("### `[{solver}]`");
    let section = GUIDE.split(&heading).nth(1).expect("the guide has the section");
    let rows = section.lines().skip_while(|line| !line.starts_with("| `"));
    let fields: Vec<String> = rows
        .take_while(|line| line.starts_with("| `"))
        .map(|line| {
            let cells: Vec<&str> =
                line.split('|').map(|cell| cell.trim().trim_matches('`')).collect();
            format!("{} = {}\n", cells[1], cells[2])
        })
        .collect();
    let head = "title = \"T\"\nsize = [10, 10]\ngroups = [\"platform\"]\npairs = []\n";
    let text = format!("{head}solver = \"{solver}\"\n[{solver}]\n{}", fields.concat());
    (text, fields.len())
}

#[test]
fn the_guide_prints_the_defaults_of_both_solvers() {
    let cases = [
        ("relaxation", Solver::Relaxation(Relaxation::default())),
        ("conjugate", Solver::Conjugate(Conjugate::default())),
    ];
    for (solver, wanted) in cases {
        let (text, count) = printed(solver);
        let unknown = Scene::parse("guide.toml", &format!("{text}unknown = 1\n"));
        let fields = unknown.expect_err("an unknown field").allowed;
        assert_eq!(count, fields.split(", ").count(), "fields of {solver} in the guide");
        let scene = Scene::parse("guide.toml", &text).expect("what the guide prints is allowed");
        assert_eq!(scene.world.solver, Some(wanted), "{text}");
    }
}
