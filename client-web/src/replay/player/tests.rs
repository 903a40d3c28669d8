//! Tests that a replay shows a tick identically no matter how it was reached.

use super::*;
use crate::replay::chapters::Chapter;
use crate::world::room_in_page::scripted_input;
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Problem, Record, header};
use jostle_room::Room;

const TICKS: u32 = 700;

/// A game with three scripted players; one joins late and one leaves.
pub(crate) fn records(scene: &str, ticks: u32) -> Vec<Record> {
    let scene = Scene::built_in().into_iter().find(|built_in| built_in.name == scene);
    let scene = Arc::new(scene.expect("a shipped scene"));
    let mut room = Room::new("film", Arc::clone(&scene), 5);
    room.record("test", 0);
    let mut seats = Vec::new();
    for tick in 0..ticks {
        if [0, 1, 300].contains(&tick) {
            let look = Appearance::new("Ann", seats.len() as u8).expect("a name");
            seats.extend(room.join(look, None).map(|welcome| welcome.claim.seat));
        }
        if tick == 500 && seats.len() > 1 {
            room.leave(seats.remove(0));
        }
        for &seat in &seats {
            room.input(seat, tick + 1, scripted_input(&scene, seat, tick));
        }
        room.tick();
    }
    room.stop_recording()
}

fn file(records: &[Record]) -> Vec<u8> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}

fn film(scene: &str) -> ReplayPlayer {
    ReplayPlayer::open(file(&records(scene, TICKS))).expect("a replay")
}

/// Plays at a pace that does not land on whole ticks, and stops at this tick.
fn play_to(film: &mut ReplayPlayer, tick: u32) {
    film.play();
    while film.tick() < tick {
        film.advance(0.0137, || true);
    }
    film.pause();
}

fn assert_same(a: &ReplayPlayer, b: &ReplayPlayer, context: &str) {
    assert_eq!((a.tick(), a.playhead), (b.tick(), b.playhead), "{context}");
    assert_eq!(a.hash(), b.hash(), "{context}");
    for (x, y) in a.replica().bodies().iter().zip(b.replica().bodies()) {
        assert_eq!(x, y, "{context}");
    }
    assert_eq!(a.replica().bodies().len(), b.replica().bodies().len(), "{context}");
    assert_eq!(a.particles().0.digest(), b.particles().0.digest(), "{context}");
    assert_eq!(a.players(), b.players(), "{context}");
    let view = a.still_view([640, 360], 40);
    assert_eq!(view, b.still_view([640, 360], 40), "{context}");
    let (a, b) = (a.frame(view), b.frame(view));
    assert_eq!((a.time, a.particle_lead), (b.time, b.particle_lead), "{context}");
    assert_eq!(a.room.effects, b.room.effects, "{context}");
}

#[test]
fn a_tick_looks_the_same_however_it_was_reached() {
    for (index, scene) in Scene::built_in().iter().enumerate() {
        let scene = scene.name.as_str();
        let recorded = file(&records(scene, TICKS));
        let film = || ReplayPlayer::open(recorded.clone()).expect("a replay");
        let mut played = film();
        played.set_speed(2.0);
        let mut sought = film();
        // Test before and after players join and leave.
        for tick in if index % 2 == 0 { [77, 520] } else { [301, 699] } {
            play_to(&mut played, tick);
            sought.seek(TICKS);
            sought.seek(played.tick());
            assert_same(&played, &sought, &format!("{scene}, tick {}", played.tick()));
            let mut fresh = film();
            fresh.seek(played.tick());
            assert_same(&fresh, &sought, &format!("{scene}, tick {} at once", played.tick()));
        }
    }
}

#[test]
fn one_tick_forward_and_back_changes_nothing() {
    let (mut moved, mut fresh) = (film("arena"), film("arena"));
    moved.seek(400);
    let hash = moved.hash();
    moved.seek(401);
    assert_ne!(moved.hash(), hash);
    moved.seek(400);
    assert_eq!((moved.tick(), moved.hash()), (400, hash));
    fresh.seek(400);
    assert_same(&moved, &fresh, "there and back");
}

#[test]
fn the_picture_stays_until_a_seek_has_arrived() {
    let mut film = film("arena");
    film.seek(200);
    let (bodies, particles) = (film.replica().bodies().to_vec(), film.particles().0.digest());
    film.aim(600);
    let mut slices = 0;
    while film.is_seeking() {
        assert_eq!(film.replica().bodies(), bodies);
        assert_eq!((film.tick(), film.particles().0.digest()), (200, particles));
        assert_eq!(film.hash(), None);
        let (mut left, before) = (10, film.progress());
        film.work(|| {
            left -= 1;
            left >= 0
        });
        assert!(!film.is_seeking() || film.progress() > before);
        slices += 1;
    }
    assert!(slices > 20, "{slices} slices");
    assert_eq!(film.tick(), 600);
}

#[test]
fn a_dragged_slider_ends_at_its_last_position() {
    let mut film = film("arena");
    film.play();
    for tick in [600, 20, 450, 333] {
        film.aim(tick);
        assert_eq!(film.goal(), tick);
        let mut once = true;
        film.work(|| std::mem::take(&mut once));
    }
    film.work(|| true);
    assert_eq!((film.tick(), film.playing), (333, true), "and plays on from there");
}

#[test]
fn without_enough_time_it_plays_slower_and_does_not_jump() {
    let mut film = film("arena");
    film.set_speed(8.0);
    film.play();
    let mut left = 5;
    film.advance(0.25, || {
        left -= 1;
        left >= 0
    });
    assert_eq!((film.tick(), film.playhead), (5, 5.0));
    assert!(film.playing);
}

#[test]
fn every_tick_is_compared_and_the_end_says_so() {
    let mut film = film("impulse");
    film.play();
    while film.playing {
        film.advance(0.1, || true);
    }
    assert!(film.is_at_end() && film.checks.all_equal());
    assert_eq!(film.checks.agrees_until(), TICKS);
    film.play();
    film.work(|| true);
    assert_eq!(film.tick(), 0, "again from the start");
}

#[test]
fn unwatched_ticks_are_compared_in_spare_time() {
    let mut film = film("arena");
    film.look_ahead(|| true);
    assert!(film.checks.all_equal());
    assert_eq!(film.tick(), 0);
    let joins = |&&(_, chapter): &&(u32, Chapter)| matches!(chapter, Chapter::Join);
    let known = film.chapters.known;
    let joined: Vec<u32> = known.iter().filter(joins).map(|&(tick, _)| tick).collect();
    assert_eq!(joined, [1, 2, 301]);
    assert!(known.contains(&(501, Chapter::Leave)));
}

#[test]
fn goals_and_rounds_are_chapters_and_can_be_skipped_to() {
    let mut film = ReplayPlayer::open(file(&records("hill", 2400))).expect("a replay");
    film.look_ahead(|| true);
    let of_game = film.chapters.known.iter().filter(|(_, chapter)| chapter.is_of_game());
    let known: Vec<(u32, Chapter)> = of_game.copied().collect();
    assert_eq!(known.first(), Some(&(181, Chapter::Round)), "{known:?}");
    let goals: Vec<u32> = known[1..].iter().map(|&(tick, _)| tick).collect();
    // Three players move up and down the hill. The points that one of them scores in a row count as one goal.
    let held = goals.first().copied().expect("nobody held the hill");
    for (forwards, wanted) in [(true, 61), (true, held - 120), (false, 61)] {
        film.skip_to_goal(forwards);
        film.work(|| true);
        assert_eq!(film.tick(), wanted, "two seconds before the round, or the goal");
    }
}

#[test]
fn ticks_played_ahead_are_reached_sooner() {
    let file = file(&records("arena", 1400));
    let way = |mut film: ReplayPlayer| {
        film.aim(1350);
        let mut ticks = 0;
        film.work(|| {
            ticks += 1;
            true
        });
        assert_eq!(film.tick(), 1350);
        (ticks, film.hash())
    };
    let open = || ReplayPlayer::open(file.clone()).expect("a replay");
    let (far, hash) = way(open());
    let mut looked = open();
    looked.look_ahead(|| true);
    let (near, same) = way(looked);
    assert_eq!((far, near, same), (1350, 150, hash));
}

#[test]
fn a_wrong_hash_is_found_at_its_tick() {
    let mut records = records("impulse", TICKS);
    for record in &mut records {
        if let Record::Ticks(block) = record
            && (block.first..=block.last()).contains(&345)
        {
            block.ticks[(345 - block.first) as usize].hash ^= 1;
        }
    }
    let mut film = ReplayPlayer::open(file(&records)).expect("a replay");
    film.seek(344);
    assert_eq!(film.checks.differs_at, None);
    film.seek(TICKS);
    assert_eq!(film.checks.differs_at, Some(345));
    assert_eq!(film.checks.agrees_until(), 344);
    film.seek(0);
    assert_eq!(film.checks.differs_at, Some(345), "it stays");
}

#[test]
fn truncated_files_play_as_far_as_they_go() {
    let mut bytes = file(&records("arena", TICKS));
    bytes.truncate(bytes.len() - 40);
    let mut film = ReplayPlayer::open(bytes).expect("the start is there");
    let Ending::Cut(error) = film.ending() else { panic!("it was cut") };
    assert_eq!(error.problem, Problem::CutOff);
    assert_eq!(film.last_tick(), 600);
    film.seek(u32::MAX);
    assert_eq!((film.tick(), film.checks.all_equal()), (600, true));
}

#[test]
fn other_files_are_refused_with_a_position_and_advice() {
    let whole = file(&records("arena", 10));
    let refused = |bytes: Vec<u8>| ReplayPlayer::open(bytes).err().expect("refused");
    let error = refused(b"GIF89a".to_vec());
    assert_eq!(
        (error.title_and_advice().0, error.to_string().as_str()),
        ("Not a replay", "byte 0: this is not a replay")
    );
    let mut other = whole.clone();
    other[8] = 9;
    assert_eq!(refused(other).title_and_advice().0, "Unsupported version");
    let mut damaged = whole.clone();
    damaged[40] ^= 1;
    let error = refused(damaged);
    assert_eq!(error.title_and_advice().0, "Damaged replay");
    assert!(error.to_string().starts_with("byte 10: "), "{error}");
    assert!(ReplayPlayer::open(whole).is_ok());
}

#[test]
fn a_replay_that_cannot_go_on_ends_there() {
    let mut records = records("arena", TICKS);
    for record in &mut records {
        if let Record::Ticks(block) = record
            && block.first == 301
        {
            let again = jostle_protocol::replay::Change::Leave(Seat(9));
            block.ticks[20].changes.push(again);
        }
    }
    let mut film = ReplayPlayer::open(file(&records)).expect("a replay");
    film.seek(600);
    assert_eq!((film.tick(), film.last_tick()), (320, 320));
    assert!(film.trouble().is_some_and(|error| error.to_string().contains("tick 321")));
    film.seek(100);
    film.play();
    while film.playing {
        film.advance(0.1, || true);
    }
    assert_eq!(film.tick(), 320);
}

#[test]
fn a_followed_player_is_in_the_middle() {
    let mut film = film("arena");
    film.seek(420);
    let whole = film.still_view([1280, 720], 0);
    let seat = film.players()[1].seat;
    film.follow(Some(seat));
    let near = film.still_view([1280, 720], 0);
    assert!(near.height < whole.height);
    let (hero, _) = film.followed_hero().expect("a hero");
    let at = near.to_pixel(hero);
    assert!((0.0..1280.0).contains(&at.x) && (0.0..720.0).contains(&at.y), "{at}");
}
