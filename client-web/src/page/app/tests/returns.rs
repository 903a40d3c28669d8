//! Tests of what brings players back: own bests, the server's best runs, the track of the day, and streaks.

use super::*;
use crate::page::panels;
use crate::page::view::View;
use crate::world::daily;

/// A dash to the right, in which the time counts.
const DASH: &str = r#"title = "Dash"
size = [100, 60]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero"]
[round]
goal = 1
time = 60
pause = 2
countdown = 0
[hero]
size = [4, 4]
spawns = [[10, 30], [10, 40]]
[[zones]]
name = "post"
area = [[80, 0], [100, 60]]
[[rules]]
enter = "post"
score = 1
"#;
const SCENES: &str = r#"{"scenes":[
    {"name":"race","title":"Race","about":"","players_max":16,"heroes":true,"fill":4,"alone":4,"players_min":1,"category":"games","picture":"/r.webp"},
    {"name":"hill","title":"Hill","about":"","players_max":8,"heroes":true,"players_min":1,"category":"games","picture":null}]}"#;
const RECORDS: &str = r#"{"kept":true,"scenes":[{"scene":"race","measure":"time","records":[
    {"name":"race-01","ticks":3600,"points":3,"begin":180,"seat":0,"players":["Bea"]}]}]}"#;
const TOP: &str = r#"{"kept":true,"scenes":[{"scene":"race","measure":"time","records":[
    {"name":"race-01","ticks":3600,"points":3,"begin":180,"seat":0,"players":["Bea"]},
    {"name":"race-02","ticks":3660,"points":3,"begin":180,"seat":0,"players":["Ann"]}]}]}"#;
/// 2026-11-29, half past nine.
const NOW_S: fn() -> f64 = || 20_786.0 * 86_400.0 + 34_200.0;

/// A page in a room on a server that plays [`DASH`].
fn dashing() -> Browser {
    let mut browser = Browser::open("/dash", "");
    let scene = Scene::parse("dash.toml", DASH).unwrap_or_else(|error| panic!("{error}"));
    browser.room = Some(RoomInPage::new(Arc::new(scene), 1, 0, false));
    browser.socket(SocketEvent::Opened);
    browser.deliver();
    browser
}

/// Waits, dashes to the post, and returns the sentence about the result after it.
fn dash(browser: &mut Browser, wait_ms: u32) -> String {
    let is_over =
        |browser: &Browser| browser.app.screen.game().is_some_and(GameScreen::is_round_over);
    while is_over(browser) || browser.app.screen.replica().is_none() {
        browser.wait(20);
    }
    browser.wait(wait_ms);
    browser.press("KeyD", "d");
    while !is_over(browser) {
        browser.wait(20);
    }
    browser.say(Event::KeyUp(key("KeyD", "d")));
    let said = panels::OF_FRAMES.iter().map(|panel| panel(&browser.app));
    let said: Vec<View> = said.filter(|view| view.name == "record").collect();
    said[0].text_of("#result-own").expect("a sentence").to_owned()
}

#[test]
fn the_own_best_is_told_after_a_round_and_stays() {
    let mut browser = dashing();
    let first = dash(&mut browser, 2000);
    assert!(first.starts_with("Your best: 0:0"), "{first}");
    let faster = dash(&mut browser, 500);
    assert!(faster.starts_with("Your best: 0:0") && faster.contains(", \u{2212}"), "{faster}");
    let best = browser.stored("jostle.bests").expect("a best");
    assert!(best.starts_with("dash t") && best.lines().count() == 1, "{best}");
    let slower = dash(&mut browser, 2000);
    assert!(slower.contains(", +") && slower.contains("Your best: 0:0"), "{slower}");
    assert_eq!(browser.stored("jostle.bests"), Some(best.clone()));
    // Storage that takes nothing changes nothing until the tab closes.
    let mut blocked = dashing();
    dash(&mut blocked, 2000);
    *blocked.store.borrow_mut() = LiteMap::new();
    let faster = dash(&mut blocked, 500);
    assert!(faster.contains(", \u{2212}"), "{faster}");
}

fn lobby() -> Browser {
    let mut browser = Browser::open("/", "");
    browser.app.ctx.unix_s = NOW_S;
    browser.say(Event::Answered(Request::Scenes, Some(SCENES.into())));
    browser
}

fn view(browser: &Browser) -> View {
    panels::lobby::view(&browser.app, NOW_S())
}

fn card(browser: &Browser, name: &str) -> View {
    let view = view(browser);
    let cards = view.items_of("#game-list").expect("cards").to_vec();
    cards.into_iter().find(|card| card.key == name).expect("a card")
}

#[test]
fn a_card_shows_the_own_best_and_the_best_runs_with_the_own_rank() {
    let mut browser = lobby();
    assert_eq!(card(&browser, "race").text_of(".alone"), Some("Play alone with 3 bots"));
    assert_eq!(view(&browser).attribute_of("#counts", "hidden"), Some(Some("")));
    browser.say(Event::Answered(Request::Records, Some(RECORDS.into())));
    browser.app.ctx.storage.keep("jostle.bests", "hill t60\nrace t3660\n");
    assert_eq!(view(&browser).attribute_of("#counts", "hidden"), Some(None));
    let race = card(&browser, "race");
    let alone = race.text_of(".alone");
    assert_eq!(alone, Some("Play alone with 3 bots: your time counts"));
    assert_eq!(race.text_of(".own"), Some("Your best: 1:01.0"));
    assert_eq!(race.items_of(".runs").map(<[View]>::len), Some(0));
    assert_eq!(card(&browser, "hill").text_of(".own"), Some("Your best: 0:01.0"));

    let asked = browser.say(clicked("records", "race"));
    assert!(has(&asked, "BestRuns(\"race\")"), "{asked:?}");
    assert_eq!(
        Request::BestRuns("race".into()).target(),
        ("GET", "/api/records?scene=race".to_owned())
    );
    browser.say(Event::Answered(Request::BestRuns("race".into()), Some(TOP.into())));
    let race = card(&browser, "race");
    assert_eq!(race.text_of(".own"), Some("Your best: 1:01.0 \u{b7} You are number 2"));
    let runs = race.items_of(".runs").expect("runs");
    let texts: Vec<_> = runs.iter().map(|run| [run.text_of("bdi"), run.text_of("b")]).collect();
    assert_eq!(texts, [[Some("Bea"), Some("1:00.0")], [Some("Ann"), Some("1:01.0")]]);
    assert_eq!(runs[1].attribute_of("", "class"), Some(Some("own")));
    assert!(!has(&browser.say(clicked("records", "race")), "BestRuns"), "it closes");
    assert_eq!(card(&browser, "race").items_of(".runs").map(<[View]>::len), Some(0));
}

#[test]
fn the_track_of_the_day_is_played_alone_and_in_rooms() {
    let mut browser = lobby();
    let today = card(&browser, daily::CARD);
    assert_eq!(today.text_of("strong"), Some("Track of the day"));
    assert!(today.text_of(".about").is_some_and(|about| about.starts_with("2026-11-29: ")));
    browser.say(Event::AloneClicked(daily::CARD.into(), form("Bea")));
    assert_eq!(browser.address, "/#daily=20261129");
    browser.wait(400);
    let scene = |browser: &Browser| browser.app.screen.replica().map(|it| it.room.scene.clone());
    let alone = scene(&browser).expect("a game");
    assert_eq!((browser.app.state(), daily::date_of(&alone)), ("playing", Some(20_261_129)));
    assert_eq!(browser.app.screen.replica().map(|it| it.room.players().len()), Some(4));
    browser.click("leave");

    let asked = browser.say(Event::SceneClicked(daily::CARD.into(), form("Bea")));
    assert!(has(&asked, "OpenGuest(") && asked.iter().any(|it| it.contains("2026-11-29")));
    let opened = r#"{"code":"xyz","host_key":"000102030405060708090a0b0c0d0e0f"}"#;
    let request = Request::OpenGuest(daily::track(20_261_129));
    browser.say(Event::Answered(request, Some(opened.into())));
    assert_eq!(browser.address, "/xyz");

    let mut browser = lobby();
    browser.app.ctx.storage.keep("jostle.bests", "track-20261128 t60\ntrack-20261129 t120\n");
    assert_eq!(card(&browser, daily::CARD).text_of(".own"), Some("Your best: 0:02.0"));
    browser.app.ctx.unix_s = || NOW_S() - 86_400.0;
    assert_eq!(card(&browser, daily::CARD).text_of(".own"), Some("Your best: 0:01.0"));
}

#[test]
fn days_in_a_row_are_counted_and_told_in_the_lobby() {
    let mut browser = dashing();
    browser.app.ctx.unix_s = NOW_S;
    browser.wait(400);
    assert_eq!(browser.stored("jostle.streak").as_deref(), Some("20786 1 0"));
    let streak = |browser: &Browser| view(browser).text_of("#streak").map(str::to_owned);
    assert_eq!(streak(&browser).as_deref(), Some(""));
    browser.app.ctx.unix_s = || NOW_S() + 86_400.0;
    browser.wait(400);
    assert_eq!(streak(&browser).as_deref(), Some("2 days in a row"));
    browser.app.ctx.storage.keep("jostle.streak", "20787 2 3");
    assert_eq!(streak(&browser).as_deref(), Some("2 days in a row \u{b7} 3 wins in a row"));
    browser.app.ctx.unix_s = || NOW_S() + 3.0 * 86_400.0;
    assert_eq!(streak(&browser).as_deref(), Some("3 wins in a row"), "a day was missed");
    browser.wait(400);
    assert_eq!(browser.stored("jostle.streak").as_deref(), Some("20789 1 3"));
}

#[test]
fn a_race_shows_its_clock_place_and_laps() {
    let mut browser = Browser::open("/race", "");
    browser.accept_beside(3, "race");
    let race = |browser: &Browser| {
        let mut views = panels::OF_FRAMES.iter().map(|panel| panel(&browser.app));
        let view = views.find(|view| view.name == "race").expect("a panel");
        let is_shown = view.attribute_of("#race", "hidden") == Some(None);
        let text = |at| view.text_of(at).unwrap_or_default().to_owned();
        (is_shown, [text("#race-clock"), text("#race-place"), text("#race-laps")])
    };
    browser.wait(1000);
    assert!(!race(&browser).0, "the countdown");
    browser.wait(5000);
    let (is_shown, [clock, place, laps]) = race(&browser);
    assert!(is_shown && clock.starts_with("0:0") && clock != "0:00.0", "{clock}");
    assert_eq!((&*place, &*laps), ("Place 1 of 4", "Lap 1 of 3"));
    assert_eq!(browser.app.screen.replica().map(|it| it.room.players().len()), Some(4));
}
