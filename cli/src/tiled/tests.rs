use super::*;
use jostle_game::{Buttons, Game, Input, Seat};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::Arc;

const EXAMPLE: &str = include_str!("../../../docs/examples/tiled/court.tmj");
const PROJECT: &str = include_str!("../../../docs/examples/tiled/jostle.tiled-project");

/// A map of 10 x 5 tiles, each of 8 pixels, with these objects in one layer and additional properties.
fn map(objects: Value, properties: Value) -> Value {
    let mut all = vec![
        json!({ "name": "title", "value": "Map" }),
        json!({ "name": "groups", "value": "[\"ball\", \"wall\"]" }),
    ];
    all.extend(properties.as_array().expect("a list").iter().cloned());
    json!({
        "type": "map", "orientation": "orthogonal", "width": 10, "height": 5, "tilewidth": 8, "tileheight": 8,
        "layers": [{ "type": "objectgroup", "name": "level", "objects": objects }],
        "properties": all,
    })
}

fn of_map(map: &Value) -> Result<Scene, String> {
    let text = import("a/map.tmj", "map", map.to_string().as_bytes());
    let text = text.map_err(|error| error.to_string())?;
    Ok(Scene::parse("map.toml", &text).expect("what was imported is accepted"))
}

/// An object of a class in a group, with additional fields.
fn object(class: &str, more: Value) -> Value {
    let mut object = json!({
        "id": 7, "type": class, "x": 8, "y": 8, "width": 16, "height": 8,
        "properties": [{ "name": "group", "value": "ball" }],
    });
    let fields = object.as_object_mut().expect("an object");
    fields.extend(more.as_object().expect("an object").clone());
    object
}

fn one(class: &str, more: Value) -> Result<Scene, String> {
    of_map(&map(json!([object(class, more)]), json!([])))
}

#[test]
fn the_example_is_imported_and_plays() {
    let text = import("court.tmj", "court", EXAMPLE.as_bytes()).expect("a scene");
    let scene = Scene::parse("court.toml", &text).expect("an accepted scene");
    assert_eq!((scene.size.x, scene.size.y), (160.0, 96.0));
    assert_eq!((scene.bodies.len(), scene.layouts.len(), scene.launchers.len()), (8, 1, 1));
    assert_eq!(scene.hero.as_ref().map(|hero| hero.spawns.len()), Some(2));
    assert!(scene.bodies[4].path.is_some(), "the lift has a path");
    let mut game = Game::new(Arc::new(scene), 1);
    game.join(Seat(0));
    for _ in 0..300 {
        game.tick(&[(Seat(0), Input::new(Buttons(9), None))]);
    }
    assert!(game.world().is_finite());
    assert!(game.bodies().count() > 8 + 12, "marbles, and those of the spout");
}

#[test]
fn the_project_has_the_classes_that_are_imported() {
    let project: Value = serde_json::from_str(PROJECT).expect("JSON");
    let types = project["propertyTypes"].as_array().expect("a list");
    let on_objects = |entry: &&Value| entry["useAs"] == json!(["object"]);
    let offered: BTreeSet<&str> =
        types.iter().filter(on_objects).filter_map(|entry| entry["name"].as_str()).collect();
    let kinds = objects::KINDS.iter().map(|kind| kind.name());
    let known: BTreeSet<&str> =
        kinds.chain(objects::LISTS.iter().map(|(class, _)| *class)).collect();
    assert_eq!(offered, known);
}

#[test]
fn pixels_become_units_and_y_goes_up() {
    let scene = one("wall", json!({})).expect("a scene");
    let body = &scene.bodies[0];
    assert_eq!((scene.size.x, scene.size.y), (10.0, 5.0), "a tile is a unit");
    assert_eq!((body.def.position.x, body.def.position.y), (2.0, 3.5));
    let halves = body.def.shape.half_extent();
    assert_eq!((halves.x, halves.y), (1.0, 0.5));
    let circle = json!({ "ellipse": true, "width": 8, "name": "ball" });
    let scale = json!([{ "name": "pixels_per_unit", "value": 2.0 }]);
    let scene = of_map(&map(json!([object("block", circle)]), scale)).expect("a scene");
    assert_eq!((scene.size.x, scene.bodies[0].def.position.y), (40.0, 14.0));
    assert_eq!(scene.bodies[0].def.shape.half_extent().x, 2.0);
    assert_eq!(scene.bodies[0].name.as_deref(), Some("ball"));
}

#[test]
fn layers_in_groups_move_what_is_in_them() {
    let mut map = map(json!([object("wall", json!({}))]), json!([]));
    let mut inner = map["layers"][0].take();
    inner["offsetx"] = json!(8);
    map["layers"] = json!([
        { "type": "group", "name": "all", "offsety": 8, "layers": [inner] },
        { "type": "tilelayer", "name": "backdrop" },
    ]);
    let body = of_map(&map).expect("a scene").bodies[0].def.position;
    assert_eq!((body.x, body.y), (3.0, 2.5));
}

#[test]
fn an_error_names_the_layer_the_object_and_the_field() {
    let place = "a/map.tmj: layer \"level\", object 7";
    let corner = |x: f64, y: f64| json!({ "x": x, "y": y });
    let triangle = [corner(0.0, 0.0), corner(8.0, 0.0), corner(0.0, 8.0)];
    let bow_tie = [corner(0.0, 0.0), corner(8.0, 8.0), corner(8.0, 0.0), corner(0.0, 8.0)];
    let group = json!({ "name": "group", "value": "ball" });
    for (class, more, expected) in [
        ("", json!({}), "class: found none; allowed: one of wall, platform, "),
        ("door", json!({}), "class: found \"door\"; allowed: one of wall, "),
        ("wall", json!({ "rotation": 30 }), "rotation: found 30 degrees; allowed: 0: "),
        (
            "wall",
            json!({ "polygon": triangle }),
            "polygon: found a polygon of 3 corners; allowed: ",
        ),
        ("wall", json!({ "polygon": bow_tie }), "polygon: found a polygon of 4 corners; allowed: "),
        (
            "",
            json!({ "template": "ball.tj" }),
            "template: found an instance of a template; allowed: objects of the map ",
        ),
        ("wall", json!({ "gid": 3 }), "shape: found a tile; allowed: a rectangle, "),
        (
            "block",
            json!({ "ellipse": true }),
            "ellipse: found an ellipse of 16 x 8; allowed: a circle",
        ),
        ("launcher", json!({}), "shape: found a rectangle; allowed: a point"),
        ("zone", json!({ "polyline": triangle }), "shape: found a polyline; allowed: a rectangle"),
        (
            "block",
            json!({ "properties": [group, { "name": "mass", "value": -1 }] }),
            "mass: found -1; allowed: a number from ",
        ),
        (
            "block",
            json!({ "properties": [group, { "name": "colour", "value": 1 }] }),
            "colour: found an unknown field; allowed: the fields ",
        ),
        (
            "block",
            json!({ "properties": [group, { "name": "mass", "value": { "a": 1 } }] }),
            "mass: found {\"a\":1}; allowed: a number, ",
        ),
    ] {
        let error = one(class, more).expect_err("an error");
        let expected = format!("{place}: {expected}");
        assert!(error.starts_with(&expected), "{error}\n{expected}");
    }
    let named = one("wall", json!({ "name": "left", "rotation": 1 })).expect_err("an error");
    assert!(named.starts_with(&format!("{place} (\"left\"): rotation")), "{named}");
}

#[test]
fn whole_turns_are_no_rotation() {
    for rotation in [360.0, -360.0, 720.0, 1e-6, 359.999_999] {
        let body = one("wall", json!({ "rotation": rotation })).expect("a scene").bodies[0].def;
        assert_eq!((body.position.x, body.position.y), (2.0, 3.5), "{rotation}");
    }
}

#[test]
fn what_is_hidden_is_left_out() {
    let hidden = json!({ "visible": false, "type": "a guide" });
    let objects = json!([object("wall", json!({})), object("wall", hidden)]);
    let mut map = map(objects, json!([]));
    let guides = json!({ "type": "objectgroup", "objects": [object("guide", json!({}))] });
    let layers = map["layers"].as_array_mut().expect("a list");
    let mut layer = guides.clone();
    layer["visible"] = json!(false);
    layers.push(layer);
    layers.push(json!({ "type": "group", "visible": false, "layers": [guides] }));
    assert_eq!(of_map(&map).expect("a scene").bodies.len(), 1);
}

#[test]
fn a_byte_order_mark_is_skipped_and_other_formats_are_named() {
    let marked = [b"\xef\xbb\xbf", EXAMPLE.as_bytes()].concat();
    import("court.tmj", "court", &marked).expect("a scene");
    for (bytes, found) in [
        (&b"\xef\xbb\xbf<?xml version=\"1.0\"?>"[..], "XML, as in .tmx files"),
        (b"(function(name,data){ })", "a script, as in .js files"),
        (b"return {", "a script, as in .lua files"),
        (b"\xff\xfe{\0", "text in UTF-16"),
        (b"\x1f\x8b\x08", "a compressed file"),
    ] {
        let error = import("a.tmj", "a", bytes).expect_err("an error").to_string();
        let expected = format!("a.tmj: file: found {found}; allowed: a map saved as JSON ");
        assert!(error.starts_with(&expected), "{error}");
    }
}

#[test]
fn an_error_of_the_map_names_its_property() {
    let error = |change: &dyn Fn(&mut Value)| {
        let mut map = map(json!([]), json!([{ "name": "limits.players", "value": 1000 }]));
        change(&mut map);
        of_map(&map).expect_err("an error")
    };
    let starts = |error: String, with: &str| assert!(error.starts_with(with), "{error}");
    starts(error(&|_| {}), "a/map.tmj: limits.players: found 1000; allowed: a whole number from ");
    starts(error(&|map| map["infinite"] = json!(true)), "a/map.tmj: infinite: found true; allowed");
    starts(error(&|map| map["tilewidth"] = json!(9)), "a/map.tmj: pixels_per_unit: found none, ");
    starts(
        error(&|map| map["orientation"] = json!("isometric")),
        "a/map.tmj: orientation: found \"isometric\"; allowed: \"orthogonal\"",
    );
    let text = import("a/map.tmj", "map", b"{").expect_err("no JSON").to_string();
    starts(text, "a/map.tmj: file: found EOF");
}
