//! Tests drag, wind and springs in scene files: parsed values and errors.

use crate::{Game, Scene};
use glam::Vec2;
use jostle_sim::{Drag, ForceSettings, SpringEnd};
use std::sync::Arc;

const SMALL: &str = r#"title = "Small"
size = [100, 50]
groups = ["platform", "block"]
pairs = [["block", "platform"]]
drag = { linear = 0.5, quadratic = 0.25 }
wind = [3, 0]

[[bodies]]
kind = "wall"
name = "ceiling"
position = [50, 48]
size = [100, 4]

[[bodies]]
kind = "block"
name = "bob"
position = [50, 20]
radius = 3
mass = 2

[[bodies]]
kind = "block"
name = "tail"
position = [50, 10]
radius = 3
mass = 2
drag = 0

[[springs]]
body = "bob"
to = "ceiling"
stiffness = 8
damping = 1

[[springs]]
body = "bob"
to = "tail"
length = 5
frequency = 2
damping_ratio = 0.5

[[springs]]
body = "tail"
to = [40, 10]
frequency = 1
"#;

#[test]
fn springs_and_drag_become_those_of_the_world() {
    let scene = Scene::parse("small.toml", SMALL).expect("it is right");
    let settings =
        ForceSettings { wind: Vec2::new(3.0, 0.0), springs_max: 3, ..ForceSettings::default() };
    assert_eq!(scene.world_settings().forces, Some(settings));
    let game = Game::new(Arc::new(scene), 1);
    let world = game.world();
    let springs = world.springs();
    assert_eq!(springs.len(), 3);
    assert_eq!(
        (springs[0].rest_length, springs[0].stiffness, springs[0].damping),
        (28.0, 8.0, 1.0)
    );
    // Two masses of 2 joined by a spring oscillate like a single mass of 1.
    let turn = std::f32::consts::TAU * 2.0;
    assert!((springs[1].stiffness / (turn * turn) - 1.0).abs() < 1e-5);
    assert!((springs[1].damping / turn - 1.0).abs() < 1e-5);
    assert_eq!(springs[1].rest_length, 5.0);
    assert_eq!(springs[2].end, SpringEnd::Point(Vec2::new(40.0, 10.0)));
    assert_eq!((springs[2].rest_length, springs[2].damping), (10.0, 0.0));
    let drags: Vec<Drag> = game.scene().bodies.iter().map(|body| body.def.drag).collect();
    assert_eq!(drags, [Drag::NONE, Drag { linear: 0.5, quadratic: 0.25 }, Drag::NONE]);
}

#[test]
fn a_scene_without_them_has_no_forces() {
    for scene in Scene::built_in() {
        let forces = scene.world.forces.map(|forces| forces.springs_max);
        // The puck and the paddles have drag.
        let expected = match scene.name.as_str() {
            "bridge" => Some(26),
            "euler" => Some(3),
            "hockey" | "pong" => Some(0),
            _ => None,
        };
        assert_eq!(forces, expected, "{}", scene.name);
    }
}

/// Checks that the small scene with one piece replaced is refused, with an error at this line and field.
#[track_caller]
fn refused(from: &str, to: &str, line: usize, field: &str, found: &str, allowed: &str) {
    assert_eq!(SMALL.matches(from).count(), 1, "{from} must be in the scene once");
    let error = Scene::parse("small.toml", &SMALL.replace(from, to)).expect_err(to);
    let seen = (error.line, error.field.as_str(), error.found.as_str(), error.allowed.as_str());
    assert_eq!(seen, (line, field, found, allowed));
}

#[test]
fn errors_name_line_and_field() {
    let names = "one of ceiling, bob, tail";
    refused(
        "quadratic = 0.25",
        "quadratic = -1",
        5,
        "drag.quadratic",
        "-1",
        "a number from 0 to 1000",
    );
    let allowed = "a number from 0 to 1000, or { linear = k, quadratic = q }";
    refused("drag = 0\n", "drag = \"air\"\n", 27, "bodies[2].drag", "\"air\"", allowed);
    refused("\"tail\"\nlength", "\"tall\"\nlength", 37, "springs[1].to", "\"tall\"", names);
    refused(
        "\"bob\"\nto = \"ceiling\"",
        "\"ceiling\"\nto = [1, 1]",
        30,
        "springs[0].body",
        "\"ceiling\"",
        "a spring with a dynamic body at one end",
    );
    refused("to = \"ceiling\"", "to = \"bob\"", 31, "springs[0].to", "\"bob\"", "another body");
    refused("stiffness = 8", "", 29, "springs[0].stiffness", "nothing", "stiffness or frequency");
    refused(
        "damping = 1",
        "frequency = 1",
        33,
        "springs[0].frequency",
        "stiffness and frequency",
        "only one of the two",
    );
    refused(
        "length = 5",
        "length = -5",
        38,
        "springs[1].length",
        "-5",
        "a number from 0 to 4000000",
    );
    let calm = SMALL.replace("drag = { linear = 0.5, quadratic = 0.25 }", "");
    let error = Scene::parse("small.toml", &calm).expect_err("wind without drag");
    assert_eq!((error.line, error.field.as_str()), (6, "wind"));
}
