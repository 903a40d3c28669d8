//! Tests a game's rules, in small scenes made for each test.

mod bodies;
mod budget;
mod games;
mod heroes;
mod packs;
mod plans;
mod players;
mod random;
mod rounds;
mod rules;
mod shipped;
mod showcases;
mod sling;

use crate::roster::Rule;
use crate::scene::BUILT_IN;
use crate::{Buttons, Event, Game, Input, Kind, Scene, Seat, SnapshotBody};
use glam::Vec2;
use jostle_sim::math::max;
use jostle_sim::{BodyId, Shape, Source};
use std::sync::Arc;

/// The pairs (B6) and tools (B5) of the scene `impulse`, with only a floor whose top is at 3.5.
const FLOOR: &str = r#"
title = "Floor"
size = [400, 200]
tools = ["steer", "launch", "dumb", "hold", "agitate", "clear"]
groups = ["hero", "minion", "dumb", "platform", "pack"]
pairs = [
    ["hero", "platform"], ["hero", "minion"], ["hero", "hero"], ["minion", "platform"],
    ["pack", "platform"], ["pack", "minion"], ["dumb", "platform"], ["dumb", "dumb"],
]
limits = { dumb = 250 }

[hero]
spawns = [[60, 30], [100, 30], [140, 30]]

[[bodies]]
kind = "wall"
position = [200, -6.5]
size = [800, 20]
"#;

fn game_of(text: &str) -> Game {
    let scene = Scene::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    Game::new(Arc::new(scene), 7)
}

/// A game of [`FLOOR`] with more entries at its end.
fn floor_with(more: &str) -> Game {
    game_of(&format!("{FLOOR}\n{more}"))
}

fn built_in(name: &str, seed: u64) -> Game {
    let file = format!("{name}.toml");
    let (_, source) = BUILT_IN.iter().find(|(built_in, _)| *built_in == file).expect("a scene");
    Game::new(Arc::new(Scene::parse(&file, source).expect("a good scene")), seed)
}

fn at(x: f32, y: f32) -> Option<Vec2> {
    Some(Vec2::new(x, y))
}

fn input(buttons: &[Buttons], pointer: Option<Vec2>) -> Input {
    Input::new(Buttons(buttons.iter().fold(0, |all, button| all | button.0)), pointer)
}

const FIRST: Seat = Seat(0);

/// Plays a tick with input from the first seat only.
fn play(game: &mut Game, buttons: &[Buttons], pointer: Option<Vec2>) {
    game.tick(&[(FIRST, input(buttons, pointer))]);
}

fn idle(game: &mut Game, ticks: u32) {
    for _ in 0..ticks {
        game.tick(&[]);
    }
}

fn all(game: &Game, kind: Kind) -> Vec<BodyId> {
    game.bodies().filter(|body| body.kind == kind).map(|body| body.id).collect()
}

fn only(game: &Game, kind: Kind) -> BodyId {
    let found = all(game, kind);
    assert_eq!(found.len(), 1, "one {} expected", kind.name());
    found[0]
}

fn hero_of(game: &Game, seat: Seat) -> BodyId {
    let player = game.players().find(|player| player.seat == seat).expect("a seated player");
    player.hero.expect("a hero")
}

/// Root mean square of the speeds of all bodies of one kind.
fn rms_speed(game: &Game, kind: Kind) -> f32 {
    let ids = all(game, kind);
    let sum: f32 = ids.iter().map(|&id| game.world().velocity(id).length_squared()).sum();
    (sum / ids.len() as f32).sqrt()
}

fn deepest(game: &Game) -> f32 {
    game.world().touches().iter().fold(0.0, |most, touch| max(most, touch.depth))
}
