//! Tests of games: joining, input, lost connections, refusals, dialogs and addresses.

use super::*;
use crate::page::address::PendingGame;
use crate::page::event::{Pointer, PointerChange};
use crate::page::storage::Secret;
use crate::view::frame::View;
use crate::world::replica::News;
use crate::world::room_in_page::DemoRequest;
use jostle_protocol::{Refusal, Token};
use jostle_sim::Vec2;
use litemap::LiteMap;

#[test]
fn joining_says_hello_and_remembers_the_seat() {
    let mut browser = Browser::open("/arena", "");
    assert_eq!((browser.app.state(), browser.title()), ("connecting", "Joining"));
    browser.accept("arena");
    assert!(
        matches!(&browser.sent[0], ClientMessage::Hello { appearance, .. } if &*appearance.name == "Ann")
    );
    assert_eq!((browser.app.state(), browser.title()), ("playing", ""));
    let seat = |effect: &Effect| matches!(effect, Effect::StoreSession(key, Some(_)) if key == "jostle.seat.arena");
    assert!(browser.effects.iter().any(seat));
    browser.wait(100);
    assert!(
        browser.app.screen.frame(browser.now_ms, false).is_some()
            && browser.app.picture.world_shown
    );
}

#[test]
fn the_page_wears_the_colour_that_the_room_gave() {
    for (others, color, told) in [(2, 3, false), (3, 4, true), (7, 0, true)] {
        let mut browser = Browser::open("/arena", "");
        browser.accept_beside(others, "arena");
        browser.wait(200);
        assert_eq!(browser.app.visit.own_color, color, "beside {others}");
        let tells = |(_, news): &(usize, News)| matches!(news, News::Recolored(look, 3) if look.color == color);
        assert_eq!(browser.app.visit.news.lines.iter().any(tells), told, "beside {others}");
        browser.say(Event::Navigated(Address { path: "/".into(), ..Address::default() }));
        assert_eq!(browser.app.visit.own_color, 3, "back in the lobby");
    }
}

#[test]
fn the_page_wears_the_colour_of_its_team() {
    let mut browser = Browser::open("/hockey", "");
    browser.accept("hockey");
    browser.wait(200);
    assert_eq!(browser.app.visit.own_color, 0, "the left team's");
    assert!(
        !browser.app.visit.news.lines.iter().any(|(_, news)| matches!(news, News::Recolored(..)))
    );
}

#[test]
fn a_seat_is_reclaimed_after_a_reload() {
    let token = Token([7; limits::TOKEN_BYTES]);
    let session = LiteMap::from_iter([("jostle.seat.arena".to_owned(), token.text())]);
    let mut browser = Browser::open_with("/arena", "", Storage { session, ..Default::default() });
    browser.accept("arena");
    assert!(matches!(&browser.sent[0], ClientMessage::Hello { token: Some(t), .. } if *t == token));
}

#[test]
fn a_seat_of_a_closed_tab_is_taken_by_the_next_one_and_by_no_third() {
    let mut browser = Browser::playing();
    let token = Token([7; limits::TOKEN_BYTES]).text();
    browser.app.ctx.storage.set_secret(Secret::Seat, "arena", Token::parse(&token));
    let key = "jostle.seat.arena".to_owned();
    let done = browser.say(Event::Closing);
    assert!(browser.effects.contains(&Effect::StoreLocal(key.clone(), Some(token.clone()))));
    assert!(has(&done, "Disconnect { leaving: false }"), "{done:?}");
    assert_eq!(browser.app.state(), "reconnecting", "in case the browser shows the page again");

    let local = LiteMap::from_iter([(key.clone(), token.clone())]);
    let mut browser = Browser::open_with("/arena", "", Storage { local, ..Default::default() });
    browser.accept("arena");
    let claims = |message: &ClientMessage| matches!(message, ClientMessage::Hello { token: Some(claim), .. } if claim.text() == token);
    assert!(claims(&browser.sent[0]), "{:?}", browser.sent[0]);
    // The token is removed when the welcome arrives.
    assert!(browser.effects.contains(&Effect::StoreLocal(key.clone(), None)));
    // A tab that was open all along does not claim the seat either.
    let local = LiteMap::from_iter([(key.clone(), token.clone())]);
    let mut open = Browser::open_with("/", "", Storage { local, ..Default::default() });
    open.say(Event::StoredElsewhere(key, None));
    open.say(clicked("go", "arena"));
    open.accept("arena");
    assert!(!claims(&open.sent[0]), "{:?}", open.sent[0]);
}

#[test]
fn back_and_forward_keep_the_seat() {
    let mut browser = Browser::playing();
    let key = "jostle.seat.arena".to_owned();
    let token = Token([7; limits::TOKEN_BYTES]);
    browser.app.ctx.storage.set_secret(Secret::Seat, "arena", Some(token));
    let at = |path: &str| Address { path: path.into(), ..Address::default() };
    let done = browser.say(Event::Navigated(at("/")));
    assert!(has(&done, "Disconnect { leaving: false }"), "{done:?}");
    assert_eq!(browser.app.state(), "lobby");
    assert!(!browser.effects.contains(&Effect::StoreSession(key, None)));
    browser.say(Event::Navigated(at("/arena")));
    browser.accept("arena");
    let claim = browser.sent.iter().rev().find_map(|message| match message {
        ClientMessage::Hello { token, .. } => Some(*token),
        _ => None,
    });
    assert_eq!(claim, Some(Some(token)));
    let done = browser.say(clicked("leave", ""));
    assert!(has(&done, "Disconnect { leaving: true }"), "{done:?}");
}

#[test]
fn a_socket_that_never_opens_though_the_server_answers_is_explained() {
    let mut browser = Browser::open("/arena", "");
    for _ in 0..4 {
        let done = browser.socket(SocketEvent::Closed { code: 1006 });
        assert!(has(&done, "Request(Rooms)"), "{done:?}");
        browser.wait(9000);
    }
    assert_eq!(browser.app.notice(), Some(strings::connecting(4)));
    browser.say(Event::Answered(Request::Rooms, None));
    assert_eq!(browser.app.notice(), Some(strings::connecting(4)), "no answer to that either");
    browser.say(Event::Answered(Request::Rooms, Some("{\"rooms\":[]}".into())));
    assert_eq!(browser.app.notice(), Some(strings::NO_SOCKET));
    browser.accept("arena");
    assert_eq!(browser.app.state(), "playing");
}

#[test]
fn keys_are_held_until_they_go_up_and_leave_at_once() {
    let mut browser = Browser::playing();
    let done = browser.press("KeyD", "d");
    assert!(has(&done, "PreventDefault") && has(&done, "Send"), "{done:?}");
    assert_eq!((browser.held(), browser.last_sent()), (Buttons::RIGHT, Some(Buttons::RIGHT)));
    let repeated = browser.say(Event::KeyDown(Key { repeat: true, ..key("KeyD", "d") }));
    assert!(has(&repeated, "PreventDefault") && !has(&repeated, "Send"));
    browser.wait(60);
    browser.say(Event::KeyUp(key("KeyD", "d")));
    assert_eq!((browser.held(), browser.last_sent()), (Buttons(0), Some(Buttons(0))));
    assert!(!has(&browser.press("KeyQ", "q"), "PreventDefault"), "a key without a meaning");
}

#[test]
fn keys_of_fields_buttons_and_the_system_are_left_alone() {
    let mut browser = Browser::playing();
    browser.say(Event::KeyDown(Key { focus: Focus::Field, ..key("KeyD", "d") }));
    let space = browser.say(Event::KeyDown(Key { focus: Focus::Button, ..key("Space", " ") }));
    assert!(space.is_empty() && browser.held() == Buttons(0));
    browser.say(Event::KeyDown(Key { focus: Focus::Field, ..key("F3", "F3") }));
    assert!(browser.app.panels.figures, "no field has a use for F3");
    browser.press("KeyD", "d");
    browser.say(Event::KeyDown(Key { modified: true, ..key("KeyR", "r") }));
    assert_eq!(browser.held(), Buttons(0), "the system may take the release");
}

#[test]
fn a_tap_on_a_modifier_leaves_the_other_keys_held() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    for name in ["Control", "Alt", "AltGraph"] {
        browser.say(Event::KeyDown(Key { modified: true, ..key(name, name) }));
        let repeated = Key { modified: true, repeat: true, ..key("KeyD", "d") };
        assert!(has(&browser.say(Event::KeyDown(repeated)), "PreventDefault"), "no bookmark");
        browser.say(Event::KeyUp(key(name, name)));
        assert_eq!(browser.held(), Buttons::RIGHT, "{name}");
    }
    browser.say(Event::KeyDown(Key { modified: true, ..key("MetaLeft", "Meta") }));
    assert_eq!(browser.held(), Buttons(0), "macOS swallows the release");
    browser.say(Event::KeyDown(Key { repeat: true, ..key("KeyD", "d") }));
    assert_eq!(browser.held(), Buttons::RIGHT, "the key is still down");
    browser.say(Event::KeyDown(Key { repeat: true, ..key("KeyZ", "z") }));
    assert_eq!(browser.held(), Buttons::RIGHT, "only steering resumes");
}

#[test]
fn a_page_that_loses_the_focus_releases_everything() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    browser.say(Event::Pointer(pointer(PointerChange::Down, Vec2::new(400.0, 300.0))));
    assert_eq!(browser.held(), Buttons(Buttons::RIGHT.0 | Buttons::FIRE.0));
    browser.wait(60);
    browser.say(Event::FocusLost);
    assert_eq!((browser.held(), browser.last_sent()), (Buttons(0), Some(Buttons(0))));
}

fn pointer(change: PointerChange, at: Vec2) -> Pointer {
    let pressed = change == PointerChange::Down;
    let canvas = Vec2::new(400.0, 300.0);
    let (shift, alt) = (false, false);
    Pointer { change, id: 1, touch: false, at, canvas, button: 0, pressed, shift, alt }
}

#[test]
fn the_mouse_points_at_the_same_place_of_the_world() {
    let mut browser = Browser::playing();
    browser.say(Event::Pointer(pointer(PointerChange::Moved, Vec2::new(200.0, 150.0))));
    let game = browser.app.screen.game().expect("a game");
    let View { center, .. } = *game.view();
    let seen = game.input.controls.pointer(game.view()).expect("a pointer");
    assert!((seen - center).length() < 1e-3, "{seen:?} is not the middle, {center:?}");
    browser.say(Event::Pointer(pointer(PointerChange::Left, Vec2::ZERO)));
    let game = browser.app.screen.game().expect("a game");
    assert_eq!(game.input.controls.pointer(game.view()), None);
}

#[test]
fn a_thumb_steers_and_a_finger_uses_the_armed_tool() {
    let mut browser = Browser::playing();
    let finger = |change, id, at| Pointer { touch: true, id, ..pointer(change, at) };
    let corner = Vec2::new(60.0, 250.0);
    browser.say(Event::Pointer(finger(PointerChange::Down, 1, corner)));
    assert_eq!(stick(&browser), Some((corner, Vec2::ZERO)));
    browser.say(Event::Pointer(finger(PointerChange::Moved, 1, corner + Vec2::X * 40.0)));
    assert_eq!(browser.held(), Buttons::RIGHT);
    browser.say(Event::ToolArmed(Buttons::MAKE));
    browser.say(Event::Pointer(finger(PointerChange::Down, 2, Vec2::new(300.0, 100.0))));
    assert_eq!(browser.held(), Buttons(Buttons::RIGHT.0 | Buttons::MAKE.0));
    browser.say(Event::Pointer(finger(PointerChange::Up, 1, corner)));
    assert_eq!((browser.held(), stick(&browser)), (Buttons::MAKE, None));
}

#[test]
fn a_refusal_is_explained_and_its_button_tries_again() {
    let mut browser = Browser::playing();
    browser.server_says(&ServerMessage::Refused { refusal: Refusal::Flood });
    let expected = strings::refused(Refusal::Flood).expect("a notice");
    assert_eq!((browser.app.state(), browser.title()), ("refused", expected.title));
    assert!(!has(&browser.socket(SocketEvent::Closed { code: 4006 }), "Connect"));
    browser.wait(20_000);
    assert_eq!(browser.app.state(), "refused", "it does not come back by itself");
    let again = browser.click("notice");
    assert!(has(&again, "Connect"), "{again:?}");
    assert_eq!(browser.app.state(), "connecting");
}

#[test]
fn a_lost_connection_is_retried_until_it_is_back() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    let session = browser.session;
    browser.socket(SocketEvent::Closed { code: 1006 });
    assert_eq!(
        (browser.app.state(), browser.title()),
        ("reconnecting", strings::RECONNECTING.title)
    );
    assert_eq!(browser.held(), Buttons(0));
    assert!(
        browser
            .app
            .screen
            .frame(browser.app.ctx.now_ms, browser.app.settings.calm)
            .is_some_and(|frame| frame.dimmed),
        "still on view"
    );
    browser.wait(600);
    assert!(browser.session > session, "a new socket");
    browser.accept("arena");
    assert_eq!(browser.app.state(), "playing");
    let stale = Event::Socket(session, SocketEvent::Closed { code: 1006 });
    browser.say(stale);
    assert_eq!(browser.app.state(), "playing", "old sockets are ignored");
}

#[test]
fn the_network_is_used_as_soon_as_it_is_back() {
    let mut browser = Browser::playing();
    for _ in 0..8 {
        browser.socket(SocketEvent::Closed { code: 1006 });
        browser.wait(9000);
    }
    browser.socket(SocketEvent::Closed { code: 1006 });
    let session = browser.session;
    browser.say(Event::Online);
    browser.say(Event::Pulse { hidden: true });
    assert!(browser.session > session);
}

#[test]
fn a_silent_server_is_disconnected() {
    let mut browser = Browser::playing();
    browser.room = None;
    browser.now_ms += 6001.0;
    // Inputs sent now would go to a socket from which no one reads.
    let pulse =
        |browser: &mut Browser| browser.app.update(browser.now_ms, Event::Pulse { hidden: false });
    assert_eq!(pulse(&mut browser), []);
    let done = pulse(&mut browser);
    assert!(done.contains(&Effect::Disconnect { leaving: false }), "{done:?}");
    assert_eq!(browser.app.state(), "reconnecting");
}

#[test]
fn a_page_that_stood_still_keeps_its_socket() {
    let mut browser = Browser::playing();
    for _ in 0..3 {
        browser.now_ms += 60_000.0;
        let done = browser.say(Event::Pulse { hidden: false });
        assert!(!has(&done, "Disconnect"), "{done:?}");
        browser.server_says(&ServerMessage::Pong { stamp: 0, tick: 0 });
        let done = browser.say(Event::Pulse { hidden: false });
        assert!(!has(&done, "Disconnect"), "{done:?}");
    }
    assert_eq!(browser.app.state(), "playing");
}

#[test]
fn a_server_that_closes_is_announced_and_waited_for() {
    for (keeps_room, card) in [(false, strings::RESTARTING), (true, strings::BACK_SOON)] {
        let mut browser = Browser::playing();
        browser.server_says(&ServerMessage::Draining { seconds: 2, keeps_room });
        assert!(
            browser.app.screen.game().is_some_and(|game| game
                .connection
                .status
                .closing_ms
                .is_some())
        );
        browser.socket(SocketEvent::Closed { code: 1006 });
        assert_eq!((browser.app.state(), browser.title()), ("reconnecting", card.title));
    }
}

#[test]
fn a_kicked_player_is_notified_and_known_by_the_seat_afterwards() {
    let mut browser = Browser::playing();
    let done = browser.server_says(&ServerMessage::Refused { refusal: Refusal::Kicked });
    assert!(!has(&done, "StoreSession"), "{done:?}");
    browser.wait(1000);
    assert_eq!(browser.app.state(), "refused");
    browser.click("notice");
    assert_eq!((browser.app.state(), browser.address.as_str()), ("lobby", "/"));
}

#[test]
fn an_invalid_token_is_replaced_silently() {
    let mut browser = Browser::playing();
    browser.server_says(&ServerMessage::Refused { refusal: Refusal::BadToken });
    let session = browser.session;
    browser.say(Event::Pulse { hidden: false });
    assert!(browser.session > session && browser.title().is_empty());
}

#[test]
fn a_hello_that_came_too_late_is_said_again() {
    let mut browser = Browser::playing();
    let first = browser.session;
    browser.server_says(&ServerMessage::Refused { refusal: Refusal::BadHello });
    browser.wait(3000);
    assert!(browser.session > first && browser.app.state() != "refused");
}

#[test]
fn an_unreadable_message_only_closes_the_socket() {
    let mut browser = Browser::playing();
    let done = browser.socket(SocketEvent::Message(vec![255, 255]));
    assert!(has(&done, "Warn") && has(&done, "Disconnect { leaving: false }"), "{done:?}");
    assert_eq!(browser.app.state(), "reconnecting");
}

#[test]
fn leaving_gives_the_seat_up() {
    let mut browser = Browser::playing();
    let done = browser.click("leave");
    assert!(has(&done, "Disconnect { leaving: true }"), "{done:?}");
    assert!(has(&done, "StoreSession(\"jostle.seat.arena\", None)"), "{done:?}");
    assert_eq!((browser.app.state(), browser.address.as_str()), ("lobby", "/"));
}

#[test]
fn addresses_select_screens() {
    let mut browser = Browser::open("/", "");
    for (path, query, state, effect) in [
        ("/abc", "", "connecting", "Connect { path: \"/abc\""),
        ("/Impulse/", "", "connecting", "Connect { path: \"/Impulse\""),
        ("/replay/arena-1", "", "connecting", "FetchReplay(\"/replays/arena-1.jostle\")"),
        ("/", "?demo=pile", "playing", "FetchScene(\"pile\")"),
        ("/", "?demo=nosuch", "refused", "FetchScene(\"nosuch\")"),
        ("/index.html", "", "lobby", "Request(Rooms)"),
    ] {
        let (path, query, hash) = (path.to_owned(), query.to_owned(), String::new());
        let address = Address { path, query, hash };
        let done = browser.say(Event::Navigated(address.clone()));
        browser.say(Event::Frame(Some(CANVAS)));
        assert_eq!(browser.app.state(), state, "{address:?}");
        assert!(effect.is_empty() || has(&done, effect), "{address:?}: {done:?}");
    }
}

#[test]
fn a_demo_that_cannot_start_says_why() {
    let mut browser = Browser::open("/", "?demo=../arena");
    assert!(!browser.effects.iter().any(|effect| matches!(effect, Effect::FetchScene(_))));
    assert_eq!(browser.app.state(), "refused");
    let awaits_arena = || {
        Screen::FetchingScene(PendingGame::Demo(DemoRequest::parse("?demo=arena").expect("one")))
    };
    let broken = Fetched::Bytes(b"title".to_vec());
    for fetched in [Fetched::Nothing, Fetched::Refused(404), broken] {
        browser.app.screen = awaits_arena();
        browser.app.visit.dialogs.card = None;
        browser.say(Event::SceneFetched("arena".into(), fetched));
        let title = browser.app.visit.dialogs.card.as_ref().map(|card| card.title);
        assert_eq!(title, Some("Couldn't load the scene"));
    }
}

#[test]
fn a_scene_that_comes_late_starts_no_demo() {
    let mut browser = Browser::open("/", "?demo=arena&ticks=30");
    let game = browser
        .app
        .screen
        .game()
        .and_then(|game| Some(game.connection.room_in_page()?.state_hash()));
    assert!(game.is_some());
    assert!(browser.effects.iter().any(|effect| matches!(effect, Effect::FocusStage)));
    browser.say(scene_fetched("pile"));
    assert_eq!(
        browser
            .app
            .screen
            .game()
            .and_then(|game| Some(game.connection.room_in_page()?.state_hash())),
        game,
        "not the one awaited"
    );
    browser.say(Event::Navigated(Address { path: "/".into(), ..Address::default() }));
    browser.say(scene_fetched("arena"));
    assert_eq!(browser.app.state(), "lobby");
}

#[test]
fn a_frozen_demo_counts_once_it_is_drawn() {
    let mut browser = Browser::open("/", "?demo=arena&ticks=30&bots=2");
    assert_eq!((browser.app.state(), browser.app.visit.own_color), ("connecting", 0));
    browser.say(Event::Frame(Some(CANVAS)));
    let hash = browser
        .app
        .screen
        .game()
        .and_then(|game| Some(game.connection.room_in_page()?.state_hash()));
    browser.say(Event::Drawn(true));
    assert_eq!(browser.app.state(), "frozen");
    browser.wait(200);
    assert_eq!(
        browser
            .app
            .screen
            .game()
            .and_then(|game| Some(game.connection.room_in_page()?.state_hash())),
        hash,
        "it stands still"
    );
    assert_eq!(browser.app.picture.frozen_hud, Some(false));
}

#[test]
fn the_help_opens_over_the_game_and_takes_its_keys() {
    let mut browser = Browser::playing();
    browser.press("KeyD", "d");
    browser.press("Slash", "?");
    assert_eq!((browser.app.top(), browser.held()), (Layer::Help, Buttons(0)));
    assert!(!has(&browser.press("KeyD", "d"), "PreventDefault"));
    browser.press("Escape", "Escape");
    assert_eq!(browser.app.top(), Layer::Page);
}

#[test]
fn a_lost_drawing_context_is_reported_unless_it_returns_soon() {
    let mut browser = Browser::playing();
    assert!(has(&browser.say(Event::ContextLost), "DropGraphics"));
    assert_eq!(browser.title(), "");
    browser.wait(5200);
    assert_eq!(browser.title(), strings::GRAPHICS_LOST.title);
    browser.say(Event::ContextRestored);
    assert_eq!(browser.title(), "");
    // A drawing failure does not end the game, and drawing can still recover.
    let done = browser.say(Event::GraphicsFailed);
    assert_eq!((browser.app.state(), browser.title()), ("unsupported", strings::NO_WEBGL2.title));
    assert!(!has(&done, "Disconnect"), "{done:?}");
    browser.wait(400);
    browser.say(Event::ContextRestored);
    assert_eq!((browser.app.state(), browser.title()), ("playing", ""));
}

#[test]
fn the_copy_button_shows_its_result_for_a_moment() {
    let mut browser = Browser::playing();
    assert!(has(&browser.click("copy"), "CopyAddress"));
    assert!(has(&browser.say(Event::Copied(true)), "After(1500, CopyShown)"));
    assert_eq!(browser.app.visit.copied, Some(true));
    browser.say(Event::CopyShown);
    assert_eq!(browser.app.visit.copied, None);
}

#[test]
fn prediction_and_simulated_networks_are_chosen_in_the_panel() {
    let mut browser = Browser::playing();
    let predicts = |browser: &Browser| {
        let membership = browser.app.screen.game().and_then(|game| game.membership.as_ref());
        membership.is_some_and(|membership| membership.predictor.is_some())
    };
    assert!(predicts(&browser));
    let done = browser.say(Event::PredictionChosen(false));
    assert!(!predicts(&browser) && has(&done, "\"jostle.predict\", Some(\"0\")"), "{done:?}");
    let bad = NetworkConditions { trip_ms: 150.0, jitter_ms: 30.0, stalls: false };
    browser.say(Event::ConditionsChosen(bad));
    assert!(browser.effects.contains(&Effect::SetConditions(bad)));
    browser.press("F4", "F4");
    assert!(browser.app.panels.network);
    browser.click("leave");
    assert!(!browser.app.panels.network, "the panel belongs to the game");
    assert_eq!(browser.app.conditions, bad, "the network does not");

    let asked = Browser::open("/", "?lag=300,100,stalls&predict=0");
    assert!(asked.app.conditions.stalls && !asked.app.ctx.predicts);
}

fn stick(browser: &Browser) -> Option<(Vec2, Vec2)> {
    browser.app.screen.game().expect("a game").input.fingers.stick()
}
