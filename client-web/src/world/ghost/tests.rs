//! Tests that a ghost is where its hero was at the same time after the start of the round.

use super::*;
use jostle_game::{Buttons, Input};
use jostle_protocol::Appearance;
use jostle_protocol::replay::header;
use jostle_room::Room;

fn race() -> Arc<Scene> {
    let mut scenes = Scene::built_in().into_iter();
    Arc::new(scenes.find(|scene| scene.name == "race").expect("a shipped scene"))
}

/// The replay of a race in which the only player flies to the right, and the hero's position after each tick.
fn flight(ticks: u32) -> (Vec<u8>, Vec<Vec2>) {
    let mut room = Room::filled("alone", race(), 1, 1);
    room.record("test", 0);
    let look = Appearance::new("Ann", 5).expect("a name");
    let seat = room.join(look, None).expect("a seat").claim.seat;
    let (mut bytes, mut places) = (header(), vec![Vec2::ZERO]);
    for seq in 1..=ticks {
        room.input(seat, seq, Input::new(Buttons::RIGHT, None));
        room.tick();
        room.take_records().iter().for_each(|record| bytes.extend(record.seal()));
        let hero = room.game().players().next().and_then(|player| player.hero);
        places.push(room.game().world().position(hero.expect("a hero")));
    }
    room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
    (bytes, places)
}

fn wish(begin: u32) -> GhostWish {
    GhostWish { number: 0xab, begin, seat: Seat(0) }
}

fn round(phase: RoundPhase, since: u32) -> RoundInfo {
    RoundInfo { phase, since, ..RoundInfo::default() }
}

#[test]
fn a_ghost_keeps_step_with_the_round() {
    let (bytes, places) = flight(400);
    let mut ghost = Ghost::new(bytes, wish(180), &race()).expect("a ghost");
    let mut at = |phase, since, display| {
        ghost.advance(Some(&round(phase, since)), display, || true);
        ghost.shown.map(|hero| hero.center)
    };
    // The ghost waits at the start, however long the countdown takes.
    assert_eq!(at(RoundPhase::Countdown, 0, 20.0), Some(places[180]));
    assert_eq!(at(RoundPhase::Countdown, 0, 999.0), Some(places[180]));
    // The player's round began 1000 ticks into the game.
    assert_eq!(at(RoundPhase::Running, 1000, 1000.0), Some(places[180]));
    assert_eq!(at(RoundPhase::Running, 1000, 1060.0), Some(places[240]));
    assert!(places[240].x > places[180].x);
    let between = at(RoundPhase::Running, 1000, 1060.5).expect("a place");
    assert!((between - (places[240] + places[241]) * 0.5).length() < 1e-3);
    // When the player's round is over, the ghost continues to the end of its replay and stays there.
    assert_eq!(at(RoundPhase::Over, 1100, 1110.0), Some(places[290]));
    assert_eq!(at(RoundPhase::Over, 1100, 9999.0), Some(places[400]));
    // In the next round, the ghost starts over from the beginning.
    assert_eq!(at(RoundPhase::Countdown, 2000, 2001.0), Some(places[180]));
    assert_eq!(at(RoundPhase::Running, 2180, 2190.0), Some(places[190]));
}

#[test]
fn a_ghost_is_not_seen_on_its_way_to_the_start() {
    let (bytes, places) = flight(400);
    let mut ghost = Ghost::new(bytes, wish(300), &race()).expect("a ghost");
    let mut frames = 0;
    while ghost.shown.is_none() {
        let mut left = 50;
        ghost.advance(None, 0.0, || {
            left -= 1;
            left >= 0
        });
        frames += 1;
    }
    assert_eq!((frames, ghost.shown.map(|hero| hero.center)), (6, Some(places[300])));
    assert_eq!(ghost.shown.and_then(|hero| hero.color), Some(5));
}

#[test]
fn a_replay_of_another_scene_or_too_short_a_one_has_no_ghost() {
    let (bytes, _) = flight(200);
    let other = Scene::built_in().into_iter().find(|scene| scene.name == "hill");
    assert!(Ghost::new(bytes.clone(), wish(180), &other.expect("a shipped scene")).is_none());
    assert!(Ghost::new(bytes.clone(), wish(200), &race()).is_none());
    assert!(Ghost::new(bytes[..40].to_vec(), wish(180), &race()).is_none());
    assert!(Ghost::new(bytes, wish(180), &race()).is_some());
}

#[test]
fn an_address_names_a_ghost() {
    let ghost = GhostWish::parse("00000000000000ab.180.0").expect("a ghost");
    assert_eq!(ghost, wish(180));
    assert_eq!(ghost.file("race"), "/records/race-00000000000000ab.jostle");
    for bad in ["", "ab", "ab.180", "xy.180.0", "ab.-1.0", "ab.1.70000", "../../x.1.1"] {
        assert_eq!(GhostWish::parse(bad), None, "{bad}");
    }
}
