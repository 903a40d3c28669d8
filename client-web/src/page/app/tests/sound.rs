//! Tests of sound: when it starts and pauses, volume, captions, and the cues that become voices.

use super::*;
use crate::page::event::{Pointer, PointerChange};
use crate::sound::cue::Sound;
use crate::sound::mixer::Voice;
use crate::sound::task::{SoundEvent, SoundTask};
use crate::world::room_in_page::scripted_input;
use jostle_protocol::replay::header;
use jostle_room::Room;
use jostle_sim::Vec2;

impl Browser {
    /// The sound player's tasks since the previous call.
    fn sound_tasks(&mut self) -> Vec<SoundTask> {
        let tasks = self.effects.iter().filter_map(|effect| match effect {
            Effect::Sound(task) => Some(task.clone()),
            _ => None,
        });
        let tasks = tasks.collect();
        self.effects.clear();
        tasks
    }

    fn voices(&mut self) -> Vec<Voice> {
        let started = |task| if let SoundTask::Start(voices) = task { voices } else { Vec::new() };
        self.sound_tasks().into_iter().flat_map(started).collect()
    }

    fn says(&mut self, event: SoundEvent) {
        self.say(Event::Sound(event));
    }

    /// Throws packs and waits for their effect.
    fn make_noise(&mut self) {
        for _ in 0..4 {
            let at = Vec2::new(200.0, 150.0);
            for change in [PointerChange::Down, PointerChange::Up] {
                let pressed = change == PointerChange::Down;
                let canvas = Vec2::new(400.0, 300.0);
                let (id, touch, button) = (1, false, 0);
                self.say(Event::Pointer(Pointer {
                    change,
                    id,
                    touch,
                    at,
                    canvas,
                    button,
                    pressed,
                    shift: false,
                    alt: false,
                }));
                self.wait(200);
            }
        }
    }
}

fn wakes(tasks: &[SoundTask]) -> usize {
    tasks.iter().filter(|task| matches!(task, SoundTask::Wake(_))).count()
}

#[test]
fn sound_begins_with_the_click_on_play_and_rests_in_the_lobby() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::FormChanged(form("Ann")));
    browser.press("KeyA", "a");
    browser.click("help");
    browser.wait(400);
    assert_eq!(browser.sound_tasks(), [], "nothing leads into a game yet");
    browser.say(Event::PlayClicked(form("Ann")));
    let tasks = browser.sound_tasks();
    assert!(
        matches!(tasks[..], [SoundTask::Wake(gain)] if (gain - 0.16).abs() < 1e-6),
        "{tasks:?}"
    );
    browser.say(Event::Navigated(Address { path: "/".into(), ..Address::default() }));
    assert_eq!(browser.sound_tasks(), [SoundTask::Rest]);
}

#[test]
fn sound_begins_with_the_first_key_in_a_game_that_a_link_opened() {
    let mut browser = Browser::playing();
    assert_eq!(browser.sound_tasks(), [], "no page may sound before a gesture");
    browser.press("KeyD", "d");
    browser.press("KeyA", "a");
    assert_eq!(wakes(&browser.sound_tasks()), 1);
    browser.says(SoundEvent::Blocked);
    browser.wait(100);
    assert_eq!(wakes(&browser.sound_tasks()), 0);
    browser.press("KeyS", "s");
    assert_eq!(wakes(&browser.sound_tasks()), 1, "the browser waited for another key");
    browser.click("leave");
    assert_eq!(browser.sound_tasks(), [SoundTask::Rest]);
}

#[test]
fn what_happens_is_heard() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    browser.make_noise();
    let voices = browser.voices();
    let has = |sound| voices.iter().any(|voice| voice.sound == sound);
    assert!(has(Sound::Throw), "{voices:?}");
    assert!(has(Sound::Burst) || has(Sound::Rubber), "{voices:?}");
}

#[test]
fn a_hidden_page_is_silent() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    browser.sound_tasks();
    browser.says(SoundEvent::Hidden(true));
    assert_eq!(browser.held(), Buttons(0), "releases may not arrive");
    assert_eq!(browser.sound_tasks(), [SoundTask::Rest]);
    browser.make_noise();
    assert_eq!(browser.sound_tasks(), []);
    browser.says(SoundEvent::Hidden(false));
    assert_eq!(wakes(&browser.sound_tasks()), 1, "it was allowed before");
}

#[test]
fn m_mutes_except_where_it_selects_a_minion() {
    let mut browser = Browser::playing();
    browser.press("KeyM", "m");
    assert!(!browser.app.sound.is_on());
    assert_eq!(wakes(&browser.sound_tasks()), 0, "there is nothing to play");
    browser.press("KeyD", "d");
    browser.make_noise();
    assert_eq!(browser.voices(), []);
    browser.press("KeyM", "M");
    assert!(browser.app.sound.is_on());
    assert_eq!(wakes(&browser.sound_tasks()), 1);

    let mut browser = Browser::open("/bounds", "");
    browser.accept("bounds");
    browser.wait(200);
    browser.press("KeyM", "m");
    assert!(browser.app.sound.is_on());
    assert!(browser.held().contains(Buttons::PICK_MINION));
}

#[test]
fn volume_mute_and_captions_are_remembered() {
    let mut browser = Browser::playing();
    assert_eq!((browser.app.sound.volume, browser.app.sound.captioned), (40, false));
    browser.press("KeyD", "d");
    browser.says(SoundEvent::VolumeChosen(70));
    let tasks = browser.sound_tasks();
    assert!(
        matches!(tasks[..], [_, SoundTask::Gain(gain)] if (gain - 0.49).abs() < 1e-6),
        "{tasks:?}"
    );
    browser.says(SoundEvent::CaptionsChosen(true));
    browser.says(SoundEvent::MuteChosen(true));
    let local = browser.store.borrow().clone();
    let next = Browser::open_with("/", "", Storage { local, ..Default::default() });
    let desk = &next.app.sound;
    assert_eq!((desk.volume, desk.muted, desk.captioned), (70, true, true));

    let nonsense = [("jostle.volume".to_owned(), "200".to_owned())].into_iter().collect();
    let next = Browser::open_with("/", "", Storage { local: nonsense, ..Default::default() });
    assert_eq!((next.app.sound.volume, next.app.sound.muted), (40, false));
}

#[test]
fn captions_need_no_sound() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    browser.says(SoundEvent::Missing);
    assert!(!browser.app.sound.is_on());
    browser.make_noise();
    assert!(browser.app.sound.captions.lines.is_empty(), "they are off at first");
    browser.says(SoundEvent::CaptionsChosen(true));
    browser.make_noise();
    assert!(!browser.app.sound.captions.lines.is_empty());
    assert_eq!(browser.voices(), []);
}

#[test]
fn the_panels_of_sound_and_network_take_turns() {
    let mut browser = Browser::playing();
    browser.click("sound");
    assert!(browser.app.panels.sound);
    browser.press("F4", "F4");
    assert!(browser.app.panels.network && !browser.app.panels.sound);
    browser.click("sound");
    assert!(!browser.app.panels.network && browser.app.panels.sound);
    browser.click("sound");
    assert!(!browser.app.panels.sound);
}

/// A half-minute replay from the arena with busy players.
fn replay() -> Vec<u8> {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
    let scene = Arc::new(scene.expect("the arena"));
    let mut room = Room::new("x", Arc::clone(&scene), 3);
    room.record("test", 0);
    let look = Appearance { name: "Ada".into(), color: 1 };
    let seat = room.join(look, None).expect("a seat").claim.seat;
    for tick in 0..1800 {
        room.input(seat, tick + 1, scripted_input(&scene, seat, tick));
        room.tick();
    }
    let mut bytes = header();
    room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}

#[test]
fn a_replay_is_heard_only_while_it_plays_in_real_time() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::ReplayRead("game.jostle".into(), Ok(replay())));
    browser.press("F2", "F2");
    browser.wait(4000);
    assert!(browser.voices().len() > 5);

    browser.say(Event::SpeedChosen(4.0));
    browser.wait(1000);
    assert_eq!(browser.voices(), [], "in fast motion");
    browser.say(Event::SpeedChosen(0.5));
    browser.wait(2000);
    assert_eq!(browser.voices(), [], "in slow motion");
    browser.say(Event::SpeedChosen(1.0));
    browser.press("Space", " ");
    for _ in 0..60 {
        browser.press(".", ".");
        browser.wait(40);
    }
    assert_eq!(browser.voices(), [], "tick by tick");
    browser.say(Event::SeekChosen(900));
    browser.wait(400);
    assert_eq!(browser.voices(), [], "while it is sought");
    browser.press("Space", " ");
    browser.wait(4000);
    assert!(browser.voices().len() > 5, "it plays on");
    browser.press("m", "m");
    assert!(!browser.app.sound.is_on());
}
