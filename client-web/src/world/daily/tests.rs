//! Tests that every day has a track that can be flown.

use super::*;
use jostle_game::scene::WorstTick;
use jostle_game::{Game, RoundPhase};
use jostle_protocol::Appearance;
use jostle_room::Room;
use jostle_sim::{Aabb, Motion, Vec2};
use std::collections::BTreeSet;
use std::sync::Arc;

/// 2026-11-29.
const DAY: u32 = 20_786;
/// Largest cost of a tick of a guest's scene, milliseconds.
const TICK_MS_MAX: f32 = 4.0;

fn scene(date: u32) -> Scene {
    Scene::parse("track.toml", &track(date)).unwrap_or_else(|error| panic!("{date}: {error}"))
}

#[test]
fn days_have_the_dates_of_the_calendar() {
    let days = [0, 58, 59, 11_016, 11_017, 19_782, DAY, 47_540];
    let dates = [
        19_700_101, 19_700_228, 19_700_301, 20_000_229, 20_000_301, 20_240_229, 20_261_129,
        21_000_228,
    ];
    assert_eq!(days.map(date), dates);
    assert_eq!(written(date(DAY)), "2026-11-29");
}

#[test]
fn a_thousand_days_have_different_tracks_of_bounded_cost() {
    let mut tracks = BTreeSet::new();
    for day in DAY..DAY + 1000 {
        let date = date(day);
        let scene = scene(date);
        assert_eq!((date_of(&scene), in_hash(&hash(date))), (Some(date), Some(date)));
        let worst = WorstTick::of(&scene);
        assert!(worst.ms < TICK_MS_MAX, "{date}: {} ms for {}", worst.ms, worst.field);
        leaves_gaps(&scene);
        tracks.insert(scene.source.split_once('\n').expect("a title").1.to_owned());
    }
    assert_eq!(tracks.len(), 1000);
}

/// Checks that a hero with room on all sides passes every obstacle, wherever moving ones are.
fn leaves_gaps(scene: &Scene) {
    let room = Vec2::new(18.0, 20.0) * 0.5;
    let game = Game::new(Arc::new(scene.clone()), 1);
    let world = game.world();
    let fixed: Vec<Aabb> = game
        .bodies()
        .filter(|body| world.motion(body.id) == Motion::Static)
        .map(|body| {
            let (center, half) = (world.position(body.id), body.shape.half_extent());
            Aabb { low: center - half - room, high: center + half + room }
        })
        .collect();
    let is_free = |at: Vec2| !fixed.iter().any(|body| body.contains(at));
    // A flood over a grid.
    const STEP: usize = 5;
    let mut seen = [[false; 200 / STEP]; 400 / STEP];
    let place = |x: usize, y: usize| Vec2::new((x * STEP) as f32, (y * STEP) as f32);
    let mut open = vec![(9, 6)];
    while let Some((x, y)) = open.pop() {
        let cell = seen.get_mut(x).and_then(|column| column.get_mut(y));
        if let Some(cell) = cell.filter(|cell| !**cell && is_free(place(x, y))) {
            *cell = true;
            open.extend([(x + 1, y), (x.wrapping_sub(1), y), (x, y + 1), (x, y.wrapping_sub(1))]);
        }
    }
    for zone in scene.rules.zones.iter().filter(|zone| !zone.label.is_empty()) {
        let cells = seen.iter().enumerate().flat_map(|(x, column)| {
            column.iter().enumerate().filter(|(_, cell)| **cell).map(move |(y, _)| place(x, y))
        });
        assert!(cells.into_iter().any(|at| zone.holds(at)), "{}: {}", scene.title, zone.name);
    }
}

/// Bots that are far ahead of a person slow down, so that a lap has to do.
#[test]
fn bots_fly_a_lap_of_the_tracks_of_some_days() {
    for day in [DAY, DAY + 1, DAY + 77, DAY + 365, DAY + 700] {
        let scene = Arc::new(scene(date(day)));
        let mut room = Room::filled("track", Arc::clone(&scene), 1, 4);
        let ann = room.join(Appearance::new("Ann", 0).expect("a name"), None).expect("a seat");
        let ann = ann.claim.seat;
        loop {
            room.tick();
            let round = room.game().round().expect("a round");
            let mut bots = round.players.iter().filter(|player| player.seat != ann);
            if round.players.len() == 4 && bots.all(|bot| bot.side.score > 0) {
                break;
            }
            assert_ne!(round.phase, RoundPhase::Over, "{}: {:?}", scene.title, round.players);
        }
    }
}

#[test]
fn a_changed_track_is_no_track_of_the_day() {
    let text = track(20_261_129).replace("goal = 3", "goal = 1");
    let scene = Scene::parse("track.toml", &text).expect("a scene");
    assert_eq!(date_of(&scene), None);
    assert_eq!([in_hash("#daily=x"), in_hash("#daily=99991232"), in_hash("#dail")], [None; 3]);
}
