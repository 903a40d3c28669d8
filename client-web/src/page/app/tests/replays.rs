//! Tests of replays: files, fetching, controls and news.

use super::*;
use crate::net::report::Fetched;
use crate::replay::player::ReplayPlayer;
use jostle_protocol::replay::{Record, header};
use jostle_room::Room;

/// Five seconds of a game with one player.
pub fn records() -> Vec<Record> {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
    let mut room = Room::new("x", Arc::new(scene.expect("the arena")), 3);
    room.record("test", 0);
    room.join(Appearance { name: "Ada".into(), color: 1 }, None).expect("a seat");
    for _ in 0..300 {
        room.tick();
    }
    room.stop_recording()
}

pub fn file(records: &[Record]) -> Vec<u8> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}

fn replay() -> Vec<u8> {
    file(&records())
}

pub fn watching() -> Browser {
    watching_file(replay())
}

pub fn watching_file(bytes: Vec<u8>) -> Browser {
    let mut browser = Browser::open("/", "");
    browser.say(Event::ReplayRead("game.jostle".into(), Ok(bytes)));
    assert_eq!((browser.app.state(), browser.address.as_str()), ("replay", "/#file"));
    browser
}

fn player(browser: &Browser) -> &ReplayPlayer {
    &browser.app.screen.replay().expect("a replay").player
}

#[test]
fn a_replay_plays_pauses_and_seeks() {
    let mut browser = watching();
    browser.wait(400);
    assert!(player(&browser).playing && player(&browser).tick() > 10);
    assert!(has(&browser.press("Space", " "), "PreventDefault"));
    assert!(!player(&browser).playing);
    for (letter, tick) in [("Home", 0), (".", 1), (",", 0), ("ArrowRight", 60), ("End", 300)] {
        browser.press(letter, letter);
        // The tests' clock is frozen, so a single frame has all the time it needs.
        browser.wait(40);
        assert_eq!(player(&browser).tick(), tick, "{letter}");
    }
    browser.say(Event::SeekChosen(30));
    browser.wait(40);
    assert_eq!(player(&browser).tick(), 30);
    browser.press("ArrowUp", "ArrowUp");
    assert_eq!(player(&browser).speed, 2.0);
    browser.press("Digit1", "1");
    assert!(player(&browser).followed.is_some());
    browser.press("Digit1", "1");
    assert_eq!(player(&browser).followed, None);
    let focused = Key { focus: Focus::Field, ..key("Home", "Home") };
    assert!(!has(&browser.say(Event::KeyDown(focused)), "PreventDefault"), "the slider's key");
}

#[test]
fn a_still_replay_is_not_drawn_again() {
    let mut browser = watching();
    browser.press("Space", " ");
    browser.wait(100);
    assert!(browser.app.screen.frame(browser.now_ms, false).is_none());
    browser.press("F2", "F2");
    assert!(browser.app.screen.frame(browser.now_ms, false).is_some());
    browser.say(Event::Drawn(true));
    browser.say(Event::ContextLost);
    assert!(browser.app.screen.frame(browser.now_ms, false).is_some(), "what was drawn is gone");
}

#[test]
fn a_bad_file_is_explained_and_the_current_replay_stays() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::ReplayRead("cat.gif".into(), Ok(b"GIF89a".to_vec())));
    assert_eq!(browser.app.state(), "refused");
    assert!(browser.app.notice().is_some_and(|card| card.detail.contains("byte 0")));
    browser.click("notice-other");
    assert_eq!(browser.app.state(), "lobby");

    let mut browser = watching();
    browser.say(Event::ReplayRead("cat.gif".into(), Ok(b"GIF89a".to_vec())));
    assert_eq!((browser.app.state(), browser.app.top()), ("replay", Layer::Notice));
    browser.click("notice-other");
    assert_eq!((browser.app.state(), browser.title()), ("replay", ""));
}

#[test]
fn a_fetched_replay_is_shown_unless_the_player_has_left() {
    let mut browser = Browser::open("/replay/arena-1", "");
    assert_eq!(browser.title(), strings::FETCHING.title);
    browser.say(Event::ReplayFetched(api::replay_file("other"), Fetched::Bytes(replay())));
    assert_eq!(browser.app.state(), "connecting", "not the one that is awaited");
    browser.say(Event::ReplayFetched(api::replay_file("arena-1"), Fetched::Refused(404)));
    assert_eq!((browser.app.state(), browser.title()), ("refused", strings::NO_SUCH_REPLAY.title));
    browser.say(Event::ReplayFetched(api::replay_file("arena-1"), Fetched::Bytes(replay())));
    assert_eq!(browser.app.state(), "refused", "too late");

    let mut browser = Browser::open("/replay/arena-1", "");
    browser.say(Event::ReplayFetched(api::replay_file("arena-1"), Fetched::Nothing));
    assert!(has(&browser.click("notice"), "FetchReplay"), "asks again");
    browser.say(Event::ReplayFetched(api::replay_file("arena-1"), Fetched::Bytes(replay())));
    assert_eq!(browser.app.state(), "replay");
    assert_eq!(
        browser.app.screen.replay().and_then(|replay| replay.name.as_deref()),
        Some("arena-1")
    );
}

/// A file that takes several steps to read, because it contains large records that the replay player ignores.
fn long_replay() -> Vec<u8> {
    let mut bytes = replay();
    let end = Record::last_tick(&bytes).map(|_| bytes.len() - END_RECORD_BYTES);
    let notes = Record::Host(vec![7; 1 << 20]).seal();
    bytes.splice(end.expect("an end")..end.expect("an end"), notes.repeat(8));
    bytes
}

/// Size of the final record: its frame, a tick of two bytes and a hash.
const END_RECORD_BYTES: usize = 9 + 2 + 8;

/// A clock that advances by more than a frame's time budget with every reading.
fn hasty_clock() -> f64 {
    use std::cell::Cell;
    thread_local!(static NOW: Cell<f64> = const { Cell::new(0.0) });
    NOW.set(NOW.get() + 100.0);
    NOW.get()
}

#[test]
fn a_long_replay_is_read_in_slices_and_the_page_says_how_far_it_is() {
    for watched in [false, true] {
        let mut browser = if watched { watching() } else { Browser::open("/", "") };
        browser.app.ctx.clock = hasty_clock;
        browser.say(Event::ReplayRead("long.jostle".into(), Ok(long_replay())));
        let mut seen = vec![String::new()];
        while let Some(card) = browser.app.notice() {
            assert_eq!(
                (card.title, browser.app.state()),
                ("Loading the replay", if watched { "replay" } else { "connecting" })
            );
            assert_ne!(seen.last(), Some(&card.detail), "each frame reads on");
            seen.push(card.detail);
            browser.wait(20);
        }
        assert!(seen.len() > 6, "{seen:?}");
        let file = browser.app.screen.replay().map(|replay| replay.file.as_str());
        assert_eq!((browser.app.state(), file), ("replay", Some("long.jostle")));
    }
}

#[test]
fn leaving_ends_the_reading_of_a_replay() {
    let mut browser = Browser::open("/", "");
    browser.app.ctx.clock = hasty_clock;
    browser.say(Event::ReplayRead("long.jostle".into(), Ok(long_replay())));
    assert_eq!(browser.app.state(), "connecting");
    browser.click("notice");
    browser.wait(400);
    assert_eq!(browser.app.state(), "lobby");
}

#[test]
fn a_file_does_not_end_a_game() {
    let mut browser = Browser::playing();
    assert!(has(&browser.say(Event::FileDragged), "OfferDrop(false)"));
    browser.say(Event::ReplayRead("game.jostle".into(), Ok(replay())));
    assert_eq!(browser.app.state(), "playing");
}

#[test]
fn replay_news_is_shown_unless_it_was_skipped() {
    let mut browser = watching();
    browser.wait(200);
    assert_eq!(browser.app.visit.news.lines.len(), 1, "Ada joined");
    browser.press("Space", " ");
    browser.say(Event::SeekChosen(0));
    browser.wait(40);
    browser.say(Event::SeekChosen(299));
    browser.wait(40);
    assert_eq!(browser.app.visit.news.lines.len(), 1);
}

#[test]
fn a_replay_of_a_scene_that_takes_seconds_a_tick_is_paused() {
    fn slow_clock() -> f64 {
        use std::cell::Cell;
        thread_local!(static NOW: Cell<f64> = const { Cell::new(0.0) });
        NOW.set(NOW.get() + 3000.0);
        NOW.get()
    }
    let mut browser = watching();
    browser.wait(100);
    browser.app.ctx.clock = slow_clock;
    browser.wait(40);
    assert_eq!(browser.title(), "Paused");
    let paused = player(&browser).tick();
    browser.wait(400);
    assert_eq!(player(&browser).tick(), paused);
    browser.app.ctx.clock = || 0.0;
    browser.click("notice-other");
    browser.wait(400);
    assert!(browser.title().is_empty() && player(&browser).tick() > paused);
}
