//! Tests of games played alone, with scenes from the lobby, from links and from files, and with and without a server.

use super::*;
use crate::net::scene_link;
use crate::page::event::Form;
use jostle_game::Input;
use jostle_room::Room;
use proptest::prelude::*;

const YARD: &str = r#"title = "Yard"
size = [320, 180]
tools = ["steer"]
groups = ["hero"]

[hero]
size = [12, 12]
spawns = [[20, 20], [60, 20], [100, 20]]
"#;
const SCENES: &str = r#"{"scenes":[{"name":"splash","title":"Splash","about":"","players_max":16,"heroes":true,"fill":4,"alone":4,"players_min":1,"picture":null}]}"#;

fn at(hash: &str) -> Address {
    Address { path: "/".into(), query: String::new(), hash: hash.to_owned() }
}

/// A page without a server in the folder `/jostle/`, showing its lobby.
fn static_page() -> Browser {
    let startup = Startup { seed: 1, is_static: true, ..Startup::default() };
    let mut browser = Browser { app: App::new(startup), ..Browser::open("/", "") };
    browser.effects.clear();
    let path = "/jostle/".to_owned();
    browser.say(Event::Navigated(Address { path, ..Address::default() }));
    browser.say(Event::Answered(Request::Scenes, Some(SCENES.into())));
    browser
}

fn scene_file(text: &str) -> Event {
    Event::SceneRead("yard.toml".into(), Ok(text.into()))
}

fn bots(browser: &Browser) -> usize {
    browser.app.screen.replica().map_or(0, |replica| replica.room.players().len()) - 1
}

fn hash(browser: &Browser) -> Option<(u32, u64)> {
    let room = browser.app.screen.game()?.connection.room_in_page()?;
    Some((room.tick_count(), room.state_hash()))
}

#[test]
fn a_scene_of_the_lobby_is_played_alone_with_bots_and_again_after_a_reload() {
    for (mut browser, home) in [(Browser::open("/", ""), "/"), (static_page(), "/jostle/")] {
        browser.say(Event::Answered(Request::Scenes, Some(SCENES.into())));
        let done = browser.say(Event::AloneClicked("splash".into(), form("Bea")));
        assert!(has(&done, "FetchScene(\"splash\")"), "{done:?}");
        let hash_part = browser.address.strip_prefix(home).expect("below the lobby").to_owned();
        assert!(hash_part.starts_with("#alone=splash&bots=3&seed="), "{hash_part}");
        browser.wait(1000);
        assert_eq!((browser.app.state(), bots(&browser)), ("playing", 3));
        assert!(browser.app.screen.game().is_some_and(GameScreen::is_alone));
        let first = hash(&browser);

        let mut again = Browser::open("/", "");
        again.say(Event::Navigated(at(&hash_part)));
        again.wait(1000);
        assert_eq!(hash(&again), first);
        browser.click("leave");
        assert_eq!((browser.app.state(), browser.address.as_str()), ("lobby", home));
    }
}

#[test]
fn back_and_forward_continue_a_game_alone() {
    let mut browser = Browser::open("/", "");
    browser.say(scene_file(YARD));
    let address = browser.app.ctx.site.address.clone();
    browser.wait(1000);
    let left = hash(&browser);
    browser.say(Event::Navigated(at("")));
    assert_eq!(browser.app.state(), "lobby");
    browser.wait(1000);
    browser.say(Event::Navigated(address.clone()));
    assert_eq!((browser.app.state(), hash(&browser)), ("playing", left));
    browser.wait(1000);
    assert!(hash(&browser) > left, "it goes on");
    browser.click("leave");
    browser.say(Event::Navigated(address));
    assert!(hash(&browser) < left, "a game that was left starts again");
}

#[test]
fn the_end_of_a_round_is_shown_once_more_and_the_game_goes_on_meanwhile() {
    let mut browser = Browser::open("/", "");
    let race = format!(
        "{YARD}\n[round]\ntask = \"Wait\"\ntime = 5\ngoal = 9\ncountdown = 0\npause = 5\nat_time = \"win\"\n"
    );
    browser.say(scene_file(&race));
    browser.wait(4000);
    assert!(!browser.app.screen.game().is_some_and(GameScreen::has_highlights));
    browser.wait(2000);
    assert!(browser.app.screen.game().is_some_and(GameScreen::is_round_over));
    browser.say(clicked("highlights", ""));
    browser.wait(100);
    let displays = |browser: &Browser| {
        let replicas = [browser.app.screen.pictured_replica(), browser.app.screen.replica()];
        replicas.map(|replica| replica.map_or(0.0, |replica| replica.room.display))
    };
    let [shown, live] = displays(&browser);
    assert!(shown + 120.0 < live, "{shown} {live}");
    let copy = |browser: &Browser| {
        browser
            .app
            .screen
            .frame(browser.app.ctx.now_ms, browser.app.settings.calm)
            .map(|frame| frame.copy)
    };
    let shown_copy = copy(&browser);
    browser.say(Event::KeyDown(key("Escape", "Escape")));
    browser.wait(20);
    let [shown, live] = displays(&browser);
    assert_eq!(shown, live, "Esc ends it");
    assert_ne!(copy(&browser), shown_copy);
    browser.say(clicked("highlights", ""));
    browser.wait(6000);
    let [shown, live] = displays(&browser);
    assert_eq!(shown, live, "it ends with the result");
}

#[test]
fn highlights_begin_by_themselves_once_and_the_result_stays() {
    for calm in [false, true] {
        let mut browser = Browser::open("/", "");
        browser.app.settings.calm = calm;
        let yard = format!(
            "{YARD}\n[round]\ntask = \"Wait\"\ntime = 5\ncountdown = 0\npause = 60\nat_time = \"win\"\n"
        );
        browser.say(scene_file(&yard));
        let how = |browser: &Browser| {
            let view = crate::page::panels::round::highlights(&browser.app);
            view.attribute_of("", "data-highlights").flatten().map(str::to_owned)
        };
        browser.wait(7000);
        assert_eq!(how(&browser), None, "the result comes first");
        browser.wait(3500);
        let auto = (!calm).then(|| "auto".to_owned());
        assert_eq!(how(&browser), auto, "calm: {calm}");
        browser.say(clicked("highlights", ""));
        assert_eq!(how(&browser), Some("yes".to_owned()), "asked for");
        browser.wait(10_000);
        assert_eq!(how(&browser), None, "once is enough");
    }
}

#[test]
fn the_address_says_how_many_bots_play() {
    for (hash, expected) in [
        ("#alone=splash", 3),
        ("#alone=splash&bots=0", 0),
        ("#alone=splash&bots=60000", 15),
        ("#alone=splash&bots=-1&seed=x", 3),
        ("#alone=flags", 3),
        ("#alone=flags&bots=0", 1),
        ("#alone=arena", 3),
        ("#alone=herd", 0),
        ("#alone=bounds&bots=5", 0),
    ] {
        let mut browser = Browser::open("/", "");
        browser.say(Event::Navigated(at(hash)));
        browser.wait(400);
        assert_eq!((browser.app.state(), bots(&browser)), ("playing", expected), "{hash}");
    }
    let mut browser = Browser::open("/", "");
    browser.say(Event::Answered(Request::Scenes, Some(SCENES.into())));
    let alone = Form { bots: false, ..form("Bea") };
    browser.say(Event::AloneClicked("splash".into(), alone));
    assert!(browser.address.starts_with("/#alone=splash&bots=0&"), "{}", browser.address);
}

#[test]
fn a_scene_link_is_played_and_asks_for_nothing() {
    let mut browser = Browser::open("/", "");
    let link = format!("#scene={}", scene_link::encode(YARD));
    let done = browser.say(Event::Navigated(at(&link)));
    assert!(!has(&done, "Fetch") && !has(&done, "Request"), "{done:?}");
    browser.wait(400);
    let title = browser.app.screen.replica().map(|replica| replica.room.scene.title.clone());
    assert_eq!((browser.app.state(), title.as_deref()), ("playing", Some("Yard")));
    browser.say(Event::Navigated(at(&format!("{link}&bots=2"))));
    browser.wait(400);
    assert_eq!(bots(&browser), 2);
}

#[test]
fn a_scene_file_is_played_and_its_link_stands_in_the_address() {
    let mut browser = static_page();
    assert!(has(&browser.say(Event::FileDragged), "OfferDrop(true)"));
    browser.say(scene_file(YARD));
    browser.wait(400);
    assert_eq!(browser.app.state(), "playing");
    let link = browser.address.strip_prefix("/jostle/#scene=").expect("a link");
    assert_eq!(scene_link::decode(link).as_deref(), Ok(YARD));

    // A changed file replaces the game.
    assert!(has(&browser.say(Event::FileDragged), "OfferDrop(true)"));
    browser.say(scene_file(&YARD.replace("Yard", "Court")));
    browser.wait(40);
    let title =
        |browser: &Browser| browser.app.screen.replica().map(|r| r.room.scene.title.clone());
    assert_eq!(title(&browser).as_deref(), Some("Court"));
    // An invalid file does not.
    browser.say(scene_file(&YARD.replace("320", "-3")));
    assert_eq!((browser.app.state(), browser.title()), ("playing", "The scene has an error"));
    browser.click("notice-other");
    assert_eq!((browser.title(), title(&browser).as_deref()), ("", Some("Court")));
}

#[test]
fn a_scene_file_does_not_end_a_game_on_a_server() {
    let mut browser = Browser::playing();
    browser.say(scene_file(YARD));
    assert_eq!(browser.address, "/arena");
}

#[test]
fn a_wrong_scene_is_explained_as_the_command_line_does() {
    let wrong = YARD.replace("320", "-3");
    let expected = |file| Scene::parse(file, &wrong).expect_err("a wrong size").to_string();
    let mut browser = Browser::open("/", "");
    browser.say(scene_file(&wrong));
    let detail = |browser: &Browser| browser.app.notice().map(|card| card.detail);
    assert_eq!(detail(&browser), Some(expected("yard.toml")));
    browser.say(Event::Navigated(at(&format!("#scene={}", scene_link::encode(&wrong)))));
    assert_eq!(detail(&browser), Some(expected("scene.toml")));
    browser.say(Event::SceneRead("yard.toml".into(), Ok(b"title = 1\n\xff".to_vec())));
    let expected = "yard.toml:2: file: found bytes that are not UTF-8; allowed: UTF-8 text";
    assert_eq!(detail(&browser).as_deref(), Some(expected));
}

#[test]
fn a_replay_is_opened_by_its_address() {
    let mut browser = static_page();
    let path = "/jostle/".to_owned();
    let hash = "#replay=games/a.jostle?x=1&y=2".to_owned();
    let done = browser.say(Event::Navigated(Address { path, hash, ..Address::default() }));
    assert!(has(&done, "FetchReplay(\"games/a.jostle?x=1&y=2\")"), "{done:?}");
    browser.say(Event::ReplayFetched("games/a.jostle?x=1&y=2".into(), Fetched::Refused(404)));
    assert_eq!(browser.title(), strings::NO_SUCH_REPLAY.title);
    browser.click("notice");
    assert_eq!((browser.app.state(), browser.address.as_str()), ("lobby", "/jostle/"));
}

#[test]
fn a_page_without_a_server_asks_for_nothing_but_its_scenes() {
    let mut browser = static_page();
    browser.wait(20_000);
    let asked = |effect: &&Effect| matches!(effect, Effect::Request(_) | Effect::Connect { .. });
    let asked: Vec<_> = browser.effects.iter().filter(asked).collect();
    assert_eq!(asked, [&Effect::Request(Request::Scenes)]);
    browser.say(Event::PlayClicked(form("Bea")));
    assert!(browser.address.starts_with("/jostle/#alone=splash"), "{}", browser.address);
    browser.say(Event::Navigated(Address { path: "/jostle/room".into(), ..Address::default() }));
    assert_eq!(browser.app.state(), "lobby");

    let mut browser = static_page();
    browser.app.lobby.scenes.clear();
    browser.say(Event::Answered(Request::Scenes, None));
    assert_eq!(browser.app.lobby.note.text, strings::NO_SCENES);
}

/// A clock that advances by seconds with every reading, as if each tick took that long.
fn slow_clock() -> f64 {
    use std::cell::Cell;
    thread_local!(static NOW: Cell<f64> = const { Cell::new(0.0) });
    NOW.set(NOW.get() + 3000.0);
    NOW.get()
}

#[test]
fn a_tick_that_takes_seconds_pauses_the_game_until_the_player_decides() {
    let mut browser = Browser::open("/", "");
    browser.say(scene_file(YARD));
    browser.wait(200);
    browser.app.ctx.clock = slow_clock;
    browser.wait(40);
    let card = browser.app.notice().expect("a card");
    assert_eq!((card.title, card.button), ("Paused", "Back to the lobby"));
    let paused = hash(&browser);
    browser.wait(400);
    assert_eq!(hash(&browser), paused, "it stands still");
    browser.app.ctx.clock = || 0.0;
    browser.click("notice-other");
    browser.wait(400);
    assert_eq!(browser.title(), "");
    assert!(hash(&browser).map(|(tick, _)| tick) > paused.map(|(tick, _)| tick));
    // After editing, the card leads back to the editor.
    browser.press("KeyE", "e");
    browser.press("KeyE", "e");
    browser.app.ctx.clock = slow_clock;
    browser.wait(40);
    browser.click("notice");
    assert_eq!((browser.app.state(), browser.title()), ("editing", ""));
}

#[test]
fn a_heavy_scene_of_a_stranger_is_played_after_a_question() {
    let balls = "[[layouts]]\nkind = \"block\"\ngroup = \"hero\"\ncount = 4000\nradius = 1\n\
                 area = [[5, 5], [315, 175]]\nrestitution = 0.9\n";
    let heavy = format!("solver = \"conjugate\"\n{YARD}\n{balls}{balls}");
    let link = format!("#scene={}", scene_link::encode(&heavy));
    let asks = |browser: &Browser| browser.title() == "This scene is heavy";
    let mut browser = Browser::open("/", "");
    browser.say(Event::Navigated(at(&link)));
    assert!(asks(&browser) && browser.app.screen.game().is_none());
    let detail = browser.app.notice().map(|card| card.detail).unwrap_or_default();
    assert!(detail.contains("layouts[1].count"), "{detail}");
    browser.click("notice-other");
    assert_eq!((browser.app.state(), browser.address.as_str()), ("lobby", "/"));

    browser.say(scene_file(&heavy));
    assert!(asks(&browser) && browser.app.screen.game().is_none());
    browser.click("notice");
    assert!(browser.app.screen.game().is_some_and(GameScreen::is_alone) && !asks(&browser));
    // The editor asks only once.
    browser.wait(20);
    browser.press("KeyE", "e");
    browser.press("KeyE", "e");
    assert!(asks(&browser) && browser.app.state() == "editing");
    browser.click("notice");
    assert!(browser.app.screen.game().is_some());
    browser.wait(20);
    browser.press("KeyE", "e");
    browser.press("KeyE", "e");
    assert!(browser.app.screen.game().is_some() && !asks(&browser));
}

#[test]
fn no_shipped_scene_is_heavy() {
    for scene in Scene::built_in() {
        let mut browser = Browser::open("/", "");
        let link = format!("#scene={}", scene_link::encode(&scene.source));
        browser.say(Event::Navigated(at(&link)));
        assert_ne!(browser.title(), "This scene is heavy", "{}", scene.name);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn any_address_shows_something(
        word in "(alone=|scene=|replay=|bots=|file)?",
        rest in "([a-zA-Z0-9_=&%/.-]{0,40}|\\PC{0,20})",
    ) {
        let mut browser = Browser::open("/", "");
        browser.say(Event::Navigated(at(&format!("#{word}{rest}"))));
        browser.say(Event::Frame(Some(CANVAS)));
        prop_assert!(["lobby", "playing", "connecting", "refused"].contains(&browser.app.state()));
    }
}

/// An idle player's page sends no input changes, but sends often enough for the player not to count as away.
#[test]
fn a_game_alone_is_that_of_a_room_elsewhere() {
    for (name, bots) in [("arena", 2), ("splash", 3), ("flags", 5)] {
        let mut browser = Browser::open("/", "");
        browser.say(Event::Navigated(at(&format!("#alone={name}&bots={bots}&seed=7"))));
        browser.wait(6000);
        let (tick, hash) = hash(&browser).expect("a game");
        let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
        let mut room = Room::filled("x", Arc::new(scene.expect("shipped")), 7, bots + 1);
        let joined = room.join(Appearance { name: "Ada".into(), color: 1 }, None);
        let seat = joined.expect("a seat").claim.seat;
        for tick in 0..tick {
            room.input(seat, tick + 1, Input::default());
            room.tick();
        }
        assert_eq!((tick > 300, room.game().hash()), (true, hash), "{name}");
    }
}
