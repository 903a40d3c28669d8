//! Tests of the lobby: lists, the name form, and rooms that open or are refused.

use super::*;

const ROOMS: &str = r#"{"rooms":[{"code":"abc","scene":"arena","title":"Arena","players":2,"connected":1,"players_max":8}]}"#;

#[test]
fn the_lobby_asks_for_its_lists_and_asks_again() {
    let mut browser = Browser::open("/", "");
    assert_eq!((browser.app.state(), browser.title()), ("lobby", ""));
    for request in [Request::Rooms, Request::Scenes, Request::Replays] {
        assert!(browser.effects.contains(&Effect::Request(request.clone())), "{request:?}");
    }
    browser.say(Event::Answered(Request::Rooms, Some(ROOMS.into())));
    assert_eq!(browser.app.lobby.rooms.len(), 1);
    browser.now_ms = 3100.0;
    assert!(!has(&browser.say(Event::Pulse { hidden: true }), "Request"), "the page is hidden");
    let asked = browser.say(Event::Pulse { hidden: false });
    assert!(has(&asked, "Request(Rooms)") && !has(&asked, "Request(Replays)"), "{asked:?}");
    browser.say(Event::Answered(Request::Rooms, None));
    assert_eq!(browser.app.lobby.note.text, strings::UNANSWERED);
    assert_eq!(browser.app.lobby.rooms.len(), 1, "the old list stays");
    browser.say(Event::Answered(Request::Rooms, Some(ROOMS.into())));
    assert_eq!(browser.app.lobby.note.text, "");
}

#[test]
fn play_joins_the_liveliest_room_or_opens_one() {
    let mut browser = Browser::open("/", "");
    let asked = browser.say(Event::PlayClicked(form("Bea")));
    assert!(has(&asked, "Open { scene: \"splash\", private: false"), "{asked:?}");
    assert!(browser.app.lobby.busy);
    let again = browser.say(Event::PlayClicked(form("Bea")));
    assert!(!has(&again, "Open {"), "one room is enough");
    let opened = r#"{"code":"xyz","host_key":"000102030405060708090a0b0c0d0e0f"}"#;
    let request = Request::Open { scene: "splash".into(), private: false, after: None };
    let entered = browser.say(Event::Answered(request, Some(opened.into())));
    assert!(has(&entered, "Connect { path: \"/xyz\""), "{entered:?}");
    assert_eq!((browser.address.as_str(), browser.app.state()), ("/xyz", "connecting"));

    let mut browser = Browser::open("/", "");
    browser.say(Event::Answered(Request::Rooms, Some(ROOMS.into())));
    browser.say(Event::PlayClicked(form("Bea")));
    assert_eq!(browser.address, "/abc");
}

#[test]
fn a_scene_is_opened_in_a_private_room_by_its_own_button() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::Answered(Request::Rooms, Some(ROOMS.into())));
    let asked =
        browser.say(Event::SceneClicked("splash".into(), Form { private: true, ..form("Bea") }));
    assert!(has(&asked, "Open { scene: \"splash\", private: true"), "{asked:?}");
    assert_eq!(browser.address, "/");
}

#[test]
fn a_scene_is_not_opened_under_a_name_that_cannot_be_used() {
    let mut browser = Browser::open("/", "");
    let asked = browser.say(Event::SceneClicked("pile".into(), form("  ")));
    assert!(!has(&asked, "Open {"), "{asked:?}");
    assert!(browser.app.lobby.name_invalid && browser.app.lobby.note.bad);
}

#[test]
fn a_name_that_cannot_be_used_is_explained_and_joins_nothing() {
    let mut browser = Browser::open("/", "");
    let asked = browser.say(Event::PlayClicked(form("  ")));
    assert!(!has(&asked, "Request") && !has(&asked, "StoreLocal"), "{asked:?}");
    assert!(browser.app.lobby.name_invalid && browser.app.lobby.note.bad);
    assert_eq!(browser.app.visit.own_color, 5, "the colour is worn all the same");
    let stored = browser.say(Event::FormChanged(form("Bea")));
    assert!(has(&stored, "\"jostle.name\", Some(\"Bea\")"), "{stored:?}");
    assert!(!browser.app.lobby.name_invalid && browser.app.lobby.note.text.is_empty());
}

#[test]
fn a_server_that_refuses_a_room_says_why_in_the_lobby() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::SceneClicked("pile".into(), form("Bea")));
    let request = Request::Open { scene: "pile".into(), private: false, after: None };
    browser.say(Event::Answered(request.clone(), Some(r#"{"error":"full"}"#.into())));
    assert_eq!((browser.app.lobby.note.text.as_str(), browser.app.lobby.busy), ("full", false));
    browser.say(Event::Answered(request, None));
    assert_eq!(browser.app.lobby.note.text, "Can't reach the server. Check your connection.");
    assert_eq!(browser.app.state(), "lobby");
}

#[test]
fn a_new_visitor_gets_a_name_that_is_remembered() {
    let browser = Browser::open_with("/", "", Storage::default());
    let name = &browser.app.appearance.name;
    assert!(name.contains(' '), "{name}");
    assert!(
        browser.effects.contains(&Effect::StoreLocal("jostle.name".into(), Some(name.to_string())))
    );
}

#[test]
fn settings_of_one_tab_reach_the_others_and_are_not_undone_by_them() {
    use crate::page::event::SettingsEvent;
    use crate::sound::task::SoundEvent;
    let mut a = Browser::open("/", "");
    let mut b = a.beside("");
    b.say(Event::Sound(SoundEvent::VolumeChosen(90)));
    b.say(Event::Settings(SettingsEvent::Calm(true)));
    b.say(Event::PredictionChosen(false));
    b.say(Event::FormChanged(form("Bea")));
    // A tab that has not been notified writes only the values that it changed itself.
    a.say(Event::Sound(SoundEvent::CaptionsChosen(true)));
    a.say(Event::Settings(SettingsEvent::DeadZone(30)));
    for (key, value) in [("volume", "90"), ("captions", "1"), ("calm", "1"), ("name", "Bea")] {
        assert_eq!(a.stored(&format!("jostle.{key}")).as_deref(), Some(value), "{key}");
    }
    let screen = a.app.visit.number;
    for key in ["volume", "calm", "predict", "name", "color"] {
        a.hear(&format!("jostle.{key}"));
    }
    assert_eq!((a.app.sound.volume, a.app.settings.calm, a.app.ctx.predicts), (90, true, false));
    assert_eq!((&*a.app.appearance.name, a.app.visit.own_color), ("Bea", 5));
    assert!(a.app.visit.number > screen, "the form is filled again");
    assert_eq!(a.app.settings.pad.dead_zone, 30, "its own choice stays");
}
