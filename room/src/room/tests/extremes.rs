//! Tests of scenes at the limits of their fields. Both solvers keep every number finite, and clients decode the
//! snapshots unchanged.

use super::{Client, Room, look};
use jostle_game::Scene;
use jostle_game::scene::{
    EXTENT_MIN, GRAVITY_MAX, MASS_MAX, MASS_MIN, QUANTUM_MIN, SIZE_MAX, SPEED_MAX,
};
use std::sync::Arc;

/// Two seconds.
const TICKS: u32 = 120;

/// A floor and two bodies above it, the first of which may be extreme.
fn scene(solver: &str, top: &str, body: &str, other: &str) -> Scene {
    let text = format!(
        r#"
title = "Extreme"
size = [100, 100]
solver = "{solver}"
groups = ["platform", "block"]
pairs = [["platform", "block"], ["block", "block"]]
{top}
[[bodies]]
kind = "wall"
position = [50, -10]
size = [300, 20]

[[bodies]]
kind = "block"
{body}

[[bodies]]
kind = "block"
{other}
"#
    );
    Scene::parse("extreme.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// Plays a scene and checks every tick. A client compares its snapshots with the room's.
fn play(scene: Scene) {
    let mut room = Room::new("oak", Arc::new(scene), 7);
    room.join(look("Ann"), None).expect("a seat");
    let mut client = Client::default();
    for tick in 0..TICKS {
        room.tick();
        let world = room.game().world();
        assert!(world.is_finite(), "tick {tick}");
        assert!(world.departed().quarantined.is_empty(), "tick {tick}");
        client.receive(&mut room);
    }
}

/// Uses both solvers, with the extreme body below and above the other one.
fn play_all(top: &str, traits: &str) {
    play_both(top, traits, "size = [4, 4]");
}

fn play_both(top: &str, traits: &str, others: &str) {
    for solver in ["relaxation", "conjugate"] {
        for heights in [[5, 12], [12, 5]] {
            let body = format!("position = [50, {}]\n{traits}", heights[0]);
            let other = format!("position = [50, {}]\n{others}", heights[1]);
            play(scene(solver, top, &body, &other));
        }
    }
}

#[test]
fn masses_at_both_ends() {
    play_all("", &format!("size = [4, 4]\nmass = {MASS_MIN:?}"));
    play_all("", &format!("size = [4, 4]\nmass = {MASS_MAX:?}"));
    let light = format!("position = [50, 5]\nradius = 2\nmass = {MASS_MIN:?}");
    let heavy = format!("position = [50, 12]\nradius = 2\nmass = {MASS_MAX:?}");
    // The conjugate solver refuses such a light body and such a heavy one in the same scene.
    play(scene("relaxation", "", &light, &heavy));
    play(scene("relaxation", "", &heavy, &light));
}

#[test]
fn sizes_at_both_ends() {
    let fine = format!("quantum = {QUANTUM_MIN:?}\nkill_zone = [[-100, -100], [200, 200]]");
    play_all(&fine, &format!("radius = {EXTENT_MIN:?}"));
    play_all(&fine, &format!("size = [{EXTENT_MIN:?}, {EXTENT_MIN:?}]"));
    let wide = "quantum = 0.125\nkill_zone = [[-2e6, -2e6], [2e6, 2e6]]";
    let size = SIZE_MAX;
    for shape in [format!("radius = {size:?}"), format!("size = [{size:?}, {size:?}]")] {
        for solver in ["relaxation", "conjugate"] {
            let body = format!("position = [50, {:?}]\n{shape}", 1.5 * size);
            play(scene(solver, wide, &body, "position = [50, 5]\nsize = [4, 4]"));
        }
    }
}

#[test]
fn speeds_and_gravity_at_both_ends() {
    let fast = format!("speed_max = {SPEED_MAX:?}");
    for way in [[1.0, 0.0], [0.0, -1.0], [-0.6, 0.8]] {
        let [x, y] = way.map(|part| part * SPEED_MAX);
        play_all(&fast, &format!("radius = 0.5\nvelocity = [{x:?}, {y:?}]"));
    }
    for pull in [-GRAVITY_MAX, 0.0, GRAVITY_MAX] {
        play_all(&format!("gravity = [{pull:?}, {pull:?}]\n{fast}"), "size = [4, 4]");
    }
}

#[test]
fn materials_at_both_ends() {
    for restitution in [0, 1] {
        for friction in [0, 10] {
            let stuff = format!("restitution = {restitution}\nfriction = {friction}");
            play_both(
                "",
                &format!("radius = 2\nvelocity = [30, -80]\n{stuff}"),
                &format!("size = [4, 4]\n{stuff}"),
            );
        }
    }
}

#[test]
fn positions_beyond_the_range_of_messages_are_refused() {
    let parse = |quantum: &str, zone: &str| {
        let text = format!(
            "title = \"Far\"\nsize = [100, 100]\nquantum = {quantum}\nkill_zone = {zone}\n\
             groups = [\"platform\"]\n"
        );
        Scene::parse("far.toml", &text)
    };
    let far = "[[-2e6, -2e6], [2e6, 2e6]]";
    let error = parse("0.015625", far).expect_err("2e6 is beyond 2^24 quanta");
    assert_eq!((error.field.as_str(), error.line), ("kill_zone", 4));
    assert_eq!(error.found, "a kill zone that reaches to 2000000");
    assert!(error.allowed.starts_with("at most 262144: 16777216 quanta of 0.015625"), "{error}");
    parse("0.125", far).expect("within the range");
    parse("0.015625", "[[-262144, -100], [262144, 262144]]").expect("the very end");
}
