//! Tests of the editor: opening, playing and leaving it.

use super::*;
use crate::editor::palette::Make;
use crate::editor::templates;
use crate::editor::update::EditorEvent;
use crate::page::drafts::Draft;
use crate::page::event::{Pointer, PointerChange};
use crate::page::qr_code;
use jostle_sim::Vec2;

fn browser_at(hash: &str, local: &[(&str, &str)]) -> Browser {
    let local = local.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned()));
    let storage = Storage { local: local.collect(), ..Default::default() };
    let mut browser = Browser::open_with("/", "", storage);
    browser.say(Event::Navigated(Address {
        path: "/".to_owned(),
        query: String::new(),
        hash: hash.to_owned(),
    }));
    browser
}

fn text(browser: &Browser) -> String {
    browser.app.screen.edited().expect("the editor").editor.text().to_owned()
}

#[test]
fn a_shipped_scene_is_edited_played_and_edited_again() {
    let mut browser = browser_at("#edit=splash", &[]);
    browser.wait(100);
    assert_eq!(browser.app.state(), "editing");
    let source = text(&browser);
    assert!(
        browser
            .app
            .screen
            .frame(browser.app.ctx.now_ms, browser.app.settings.calm)
            .is_some_and(|frame| !frame.room.bodies.is_empty())
    );
    browser.press("KeyE", "e");
    assert_eq!(browser.app.state(), "playing");
    browser.wait(200);
    assert!(browser.app.screen.game().is_some_and(|game| game.replica().is_some()));
    browser.press("KeyE", "e");
    assert_eq!(browser.app.state(), "editing");
    assert_eq!(text(&browser), source);
    browser.click("leave");
    assert_eq!(browser.app.state(), "lobby");
}

#[test]
fn what_is_edited_is_kept_and_comes_back() {
    let mut browser = browser_at("#edit", &[]);
    assert_eq!((browser.app.state(), text(&browser).as_str()), ("editing", templates::EMPTY));
    browser.say(PULSE);
    assert_eq!(browser.stored("jostle.draft"), None, "nothing was done yet");
    browser.say(clicked("edit-place", "block"));
    browser.say(PULSE);
    let kept = text(&browser);
    assert_eq!(browser.stored("jostle.draft").as_ref(), Some(&kept));
    let again = browser_at("#edit", &[("jostle.draft", &kept)]);
    assert_eq!(text(&again), kept);
    // The draft of another scene is not used for this one.
    let other = browser_at("#edit=pile", &[("jostle.draft", &kept)]);
    assert!(text(&other).contains("title = \"Pile\""));
    // Each built-in scene has a separate draft.
    let mut pile =
        browser_at("#edit=pile", &[("jostle.draft", &kept), ("jostle.draft.pile", "size = 3")]);
    assert_eq!(text(&pile), "size = 3");
    pile.say(clicked("edit-place", "block"));
    pile.say(PULSE);
    assert_eq!(pile.stored("jostle.draft.pile"), Some(text(&pile)));
    // An empty text removes the draft, so the built-in scene is edited again.
    type_text(&mut pile, "");
    assert_eq!(pile.stored("jostle.draft.pile"), None);
}

#[test]
fn new_begins_with_a_template_and_is_undone() {
    let mut browser = browser_at("#edit", &[("jostle.draft", SCENE)]);
    browser.wait(100);
    for (name, template) in templates::ALL {
        browser.say(clicked("edit-new", name));
        assert_eq!(text(&browser), template);
        browser.click("edit-undo");
        assert_eq!(text(&browser), SCENE);
    }
    browser.say(clicked("edit-new", "nonsense"));
    // Escape on a button is left to the browser, which closes the menu.
    for (focus, is_ours) in [(Focus::Button, false), (Focus::Elsewhere, true)] {
        let effects = browser.say(Event::KeyDown(Key { focus, ..key("Escape", "Escape") }));
        assert_eq!(has(&effects, "PreventDefault"), is_ours);
    }
    assert_eq!(text(&browser), SCENE);
}

#[test]
fn a_piece_that_is_clicked_in_the_palette_comes_into_the_middle() {
    let mut browser = browser_at("#edit", &[]);
    browser.wait(100);
    let take = |browser: &mut Browser| {
        browser.say(Event::Edited(EditorEvent::Taken(Make::Ball, 7)));
        pointed(browser, PointerChange::Moved, 7, true, [-40.0, 300.0]);
    };
    take(&mut browser);
    pointed(&mut browser, PointerChange::Up, 7, true, [-40.0, 300.0]);
    assert!(text(&browser).contains("position = [160, 90]\nradius = 4"));
    browser.click("edit-undo");
    // A piece that was over the picture and went back is not placed.
    take(&mut browser);
    pointed(&mut browser, PointerChange::Moved, 7, true, [300.0, 300.0]);
    assert!(text(&browser).contains("radius = 4"));
    for change in [PointerChange::Moved, PointerChange::Up] {
        pointed(&mut browser, change, 7, true, [-40.0, 300.0]);
    }
    assert_eq!(text(&browser), templates::EMPTY);
}

/// The number of bodies in the picture.
fn pictured(browser: &mut Browser) -> usize {
    browser.wait(20);
    let frame = browser.app.screen.frame(browser.app.ctx.now_ms, true).expect("a frame");
    frame.room.bodies.len()
}

#[test]
fn the_picture_follows_the_text_down_to_nothing() {
    let mut browser = browser_at("#edit", &[("jostle.draft", "# Mine.\n")]);
    assert_eq!(pictured(&mut browser), 0);
    browser.say(clicked("edit-place", "ball"));
    assert_eq!(pictured(&mut browser), 4, "a ball in a room of three walls");
    browser.click("edit-undo");
    assert_eq!(pictured(&mut browser), 0);
    browser.click("edit-redo");
    assert_eq!(pictured(&mut browser), 4);
    type_text(&mut browser, "size = ");
    assert_eq!(pictured(&mut browser), 4, "the last scene, while the text has an error");
    type_text(&mut browser, "");
    assert_eq!(pictured(&mut browser), 0);
    browser.say(clicked("edit-new", "splash"));
    assert!(pictured(&mut browser) > 4);
}

#[test]
fn a_scene_without_a_floor_says_so_when_a_hero_falls() {
    let (walls, floor) = (templates::EMPTY.rfind("\n[[bodies]]"), templates::EMPTY);
    let floorless = &floor[..floor.find("# The floor").expect("it has one")];
    for (text, falls) in [(floorless, true), (&floor[..walls.expect("a wall")], false)] {
        let mut browser = browser_at("#edit", &[("jostle.draft", text)]);
        browser.wait(100);
        browser.press("KeyE", "e");
        let told = |browser: &Browser| {
            let panels = crate::page::panels::OF_FRAMES.map(|panel| panel(&browser.app));
            panels
                .iter()
                .filter_map(|panel| panel.text_of("#told"))
                .any(|told| told.contains("no floor"))
        };
        assert!(!told(&browser));
        let fell = (0..60).any(|_| {
            browser.wait(200);
            told(&browser)
        });
        assert_eq!(fell, falls);
    }
}

const PULSE: Event = Event::Pulse { hidden: false };

/// Types a text and lets the page store it.
fn type_text(browser: &mut Browser, text: &str) {
    browser.say(Event::Edited(EditorEvent::Typed(text.to_owned())));
    browser.say(PULSE);
}

#[test]
fn two_tabs_of_one_scene_never_overwrite_each_others_draft() {
    for (hash, key, second) in
        [("#edit", "jostle.draft", "my-scene-2"), ("#edit=pile", "jostle.draft.pile", "pile-2")]
    {
        for hears in [true, false] {
            let mut a = browser_at(hash, &[(key, "title = \"Old\"")]);
            let mut b = a.beside(hash);
            type_text(&mut b, "title = \"An hour of work\"");
            if hears {
                a.hear(key);
                assert_eq!(a.title(), strings::OTHER_DRAFT.title, "the tab notices");
            }
            type_text(&mut a, "title = \"Old!\"");
            assert_eq!(a.stored(key).as_deref(), Some("title = \"An hour of work\""));
            let second_key = format!("jostle.draft.{second}");
            assert_eq!(a.stored(&second_key).as_deref(), Some("title = \"Old!\""));
            // The tab reports this and continues with the second draft.
            assert_eq!(a.address, format!("/#edit={second}"));
            assert_eq!(a.title(), strings::second_draft("").title);
            type_text(&mut a, "title = \"Older\"");
            assert_eq!(a.stored(&second_key).as_deref(), Some("title = \"Older\""));
            b.hear(&second_key);
            type_text(&mut b, "title = \"More work\"");
            assert_eq!(a.stored(key).as_deref(), Some("title = \"More work\""));
            assert_eq!(text(&a.beside(&format!("#edit={second}"))), "title = \"Older\"");
        }
    }
}

#[test]
fn a_draft_that_the_browser_does_not_take_is_told_and_offered_again() {
    let mut browser = browser_at("#edit", &[]);
    type_text(&mut browser, "size = 1");
    let refuse = |browser: &mut Browser| {
        let (text, base) = (Some("size = 2".to_owned()), Some("size = 1".to_owned()));
        let draft = Draft { origin: None, text, base };
        browser.say(Event::DraftKept(draft, None));
        std::mem::take(&mut browser.app.screen.edited_mut().expect("the editor").editor.said)
    };
    assert!(refuse(&mut browser).contains("save it as a file"));
    assert_eq!(refuse(&mut browser), "", "once");
    browser.store.borrow_mut().remove("jostle.draft");
    browser.say(PULSE);
    assert_eq!(browser.stored("jostle.draft").as_deref(), Some("size = 1"), "offered again");
    assert!(refuse(&mut browser).contains("save it as a file"), "taken meanwhile");
}

#[test]
fn a_tab_can_take_over_the_draft_of_another_and_undo_that() {
    let mut a = browser_at("#edit", &[("jostle.draft", "size = 1")]);
    let mut b = a.beside("#edit");
    type_text(&mut b, "size = 2");
    a.hear("jostle.draft");
    a.click("notice");
    assert_eq!((a.title(), text(&a).as_str()), ("", "size = 2"));
    type_text(&mut a, "size = 3");
    assert_eq!(a.stored("jostle.draft").as_deref(), Some("size = 3"));
    a.say(Event::Edited(EditorEvent::Undone));
    a.say(Event::Edited(EditorEvent::Undone));
    assert_eq!(text(&a), "size = 1");
    // A change made just before closing is stored too.
    b.say(Event::Edited(EditorEvent::Typed("size = 4".to_owned())));
    b.say(Event::Closing);
    assert_eq!(b.stored("jostle.draft").as_deref(), Some("size = 3"));
    assert_eq!(b.stored("jostle.draft.my-scene-2").as_deref(), Some("size = 4"));
}

#[test]
fn a_scene_that_is_played_or_linked_is_not_edited_over_an_earlier_draft() {
    let mut browser = browser_at("#alone=pile", &[("jostle.draft.pile", "size = 1")]);
    browser.wait(200);
    browser.press("KeyE", "e");
    assert_eq!(browser.title(), strings::OTHER_DRAFT.title);
    type_text(&mut browser, "size = 2");
    assert_eq!(browser.stored("jostle.draft.pile").as_deref(), Some("size = 1"));
    assert_eq!(browser.stored("jostle.draft.pile-2").as_deref(), Some("size = 2"));
}

#[test]
fn a_text_with_an_error_is_not_played() {
    let mut browser = browser_at("#edit", &[("jostle.draft", "title = 3\n")]);
    browser.wait(100);
    browser.press("KeyE", "e");
    assert_eq!(browser.app.state(), "editing");
    let editor = &browser.app.screen.edited().expect("the editor").editor;
    assert!(editor.said.starts_with("my-scene.toml:1: title: found 3"), "{}", editor.said);
    assert_eq!(editor.doc.error_bytes(), Some(0..9));
}

#[test]
fn a_scene_that_is_played_alone_becomes_one_that_is_edited() {
    let mut browser = browser_at("#alone=pile&seed=7", &[]);
    browser.wait(200);
    let effects = browser.press("KeyE", "e");
    assert!(has(&effects, "PushAddress(\"/#edit=pile\")"), "{effects:?}");
    assert_eq!(browser.app.state(), "editing");
}

/// A minimal valid scene.
const SCENE: &str = "title = \"Mine\"\nsize = [100, 100]\ngroups = [\"wall\"]\n";

fn open_room(browser: &mut Browser) -> Request {
    browser.click("edit-room");
    let asked = browser.effects.iter().rev().find_map(|effect| match effect {
        Effect::Request(request @ Request::OpenGuest(_)) => Some(request.clone()),
        _ => None,
    });
    asked.expect("the server was asked for a room")
}

#[test]
fn a_room_with_the_edited_scene_is_opened_and_entered_as_its_host() {
    let mut browser = browser_at("#edit", &[("jostle.draft", SCENE)]);
    browser.wait(100);
    let request = open_room(&mut browser);
    assert_eq!(request, Request::OpenGuest(SCENE.to_owned()));
    let answer = format!(r#"{{"code":"fox","host_key":"{}"}}"#, "ab".repeat(16));
    let effects = browser.say(Event::Answered(request, Some(answer)));
    assert!(has(&effects, "StoreSession(\"jostle.host.fox\""), "{effects:?}");
    assert_eq!(browser.address, "/fox");
    assert!(browser.app.screen.game().is_some_and(|game| game.connection.code == "fox"));
}

#[test]
fn a_refusal_of_the_server_is_an_error_of_the_text_until_that_changes() {
    let mut browser = browser_at("#edit", &[("jostle.draft", SCENE)]);
    browser.wait(100);
    let request = open_room(&mut browser);
    let answer = r#"{"error":"guest.toml:2: size: found","line":2,"field":"size","found":"[100, 100]","allowed":"less"}"#;
    browser.press("KeyE", "e");
    browser.say(Event::Answered(request, Some(answer.to_owned())));
    assert_eq!(browser.app.state(), "editing", "the error is shown where it is");
    let editor = &browser.app.screen.edited().expect("the editor").editor;
    let shown = editor.doc.problem().expect("an error").to_string();
    assert_eq!(shown, "my-scene.toml:2: size: found [100, 100]; allowed: less");
    assert_eq!(editor.doc.error_bytes().map(|at| &SCENE[at]), Some("size = [100, 100]"));
    browser.say(Event::Edited(EditorEvent::Typed(format!("{SCENE}\n"))));
    assert!(
        browser.app.screen.edited().is_some_and(|screen| screen.editor.doc.problem().is_none())
    );
}

#[test]
fn a_room_that_is_not_opened_for_another_reason_is_a_card() {
    let mut browser = browser_at("#edit", &[("jostle.draft", SCENE)]);
    browser.wait(100);
    for (answer, detail) in [
        (Some(r#"{"error":"this server plays no scenes of guests"}"#), "plays no scenes of guests"),
        (None, "Can't reach the server"),
    ] {
        let request = open_room(&mut browser);
        browser.say(Event::Answered(request, answer.map(str::to_owned)));
        let card = browser.app.notice().expect("a card");
        assert!(card.detail.contains(detail), "{}", card.detail);
        browser.click("notice");
        assert_eq!((browser.app.state(), browser.app.notice()), ("editing", None));
    }
}

#[test]
fn a_text_with_an_error_gets_no_room_and_an_answer_that_comes_late_leads_nowhere() {
    let mut browser = browser_at("#edit", &[("jostle.draft", "title = 3\n")]);
    browser.wait(100);
    let count = browser.effects.len();
    browser.click("edit-room");
    assert!(matches!(browser.effects[count..], [Effect::FocusText(0)]));
    browser.say(Event::Edited(EditorEvent::Typed(SCENE.to_owned())));
    let request = open_room(&mut browser);
    browser.click("leave");
    let answer = format!(r#"{{"code":"fox","host_key":"{}"}}"#, "ab".repeat(16));
    browser.say(Event::Answered(request, Some(answer)));
    assert_eq!((browser.app.state(), &*browser.address), ("lobby", "/"));
}

fn at_link(text: &str) -> Browser {
    browser_at(&format!("#scene={}", crate::net::scene_link::encode(text)), &[])
}

#[test]
fn a_linked_scene_with_an_error_is_edited_where_that_is() {
    let wrong = format!("{SCENE}gravity = \"down\"\n");
    let mut browser = at_link(&wrong);
    let card = browser.app.notice().expect("a card");
    assert_eq!(
        (card.button, card.other.map(|(label, _)| label)),
        ("Edit", Some("Back to the lobby"))
    );
    assert!(card.detail.starts_with("scene.toml:4: gravity: found"), "{}", card.detail);
    let count = browser.effects.len();
    browser.click("notice");
    assert_eq!((browser.app.state(), browser.app.notice()), ("editing", None));
    assert_eq!(text(&browser), wrong);
    let last = browser.effects[count..].last();
    assert!(matches!(last, Some(Effect::FocusText(at)) if wrong[*at..].starts_with("gravity")));
    assert_eq!(browser.address, "/#edit");
}

#[test]
fn the_link_of_what_is_on_is_shown_as_a_code_until_escape() {
    let mut browser = Browser::open("/fox", "");
    browser.accept("arena");
    browser.click("qr-code");
    let card = browser.app.notice().expect("a card");
    let code_of = |link: &str| qr_code::draw(&format!("http://play.example{link}")).map(Arc::new);
    assert_eq!(card.code, code_of("/fox"));
    browser.press("Escape", "Escape");
    assert_eq!(browser.app.notice(), None);
    // In the editor the QR code contains the scene's link, unless that is too long.
    let mut browser = browser_at("#edit", &[("jostle.draft", SCENE)]);
    browser.click("qr-code");
    let screen = browser.app.screen.edited().expect("the editor");
    let link = browser.app.ctx.site.scene_link(screen.editor.text());
    assert!(link.starts_with("/#scene="), "{link}");
    assert_eq!(browser.app.notice().expect("a card").code, code_of(&link));
    let mut rng = jostle_sim::Rng::new(1, 0);
    let noise = (0..3000).map(|_| char::from(33 + rng.below(94) as u8)).collect();
    browser.say(Event::Edited(EditorEvent::Typed(noise)));
    browser.click("qr-code");
    let card = browser.app.notice().expect("a card");
    assert_eq!(card.code, None);
    assert!(card.text.contains("too long"), "{}", card.text);
}

/// A pointer event from a finger or a mouse's middle button.
fn pointed(browser: &mut Browser, change: PointerChange, id: i32, touch: bool, at: [f32; 2]) {
    let pointer = Pointer {
        change,
        id,
        touch,
        at: Vec2::from(at),
        canvas: Vec2::new(800.0, 600.0),
        button: if touch { 0 } else { 1 },
        pressed: true,
        shift: false,
        alt: false,
    };
    browser.say(Event::Pointer(pointer));
}

/// The world position of a point on the canvas.
fn world_at(browser: &mut Browser, at: [f32; 2]) -> Vec2 {
    browser.wait(50);
    let screen = browser.app.screen.edit_screen().expect("the editor");
    screen.view().to_world(Vec2::from(at))
}

#[test]
fn the_wheel_zooms_at_the_pointer_and_back_to_the_whole_scene() {
    let mut browser = browser_at("#edit=splash", &[]);
    let [whole, before] = [[400.0, 300.0], [500.0, 200.0]].map(|at| world_at(&mut browser, at));
    let effects = browser.say(Event::Wheel(Vec2::new(500.0, 200.0), -600.0));
    assert!(has(&effects, "PreventDefault"));
    assert!((world_at(&mut browser, [500.0, 200.0]) - before).length() < 0.01);
    let height =
        |browser: &Browser| browser.app.screen.edit_screen().map(|screen| screen.view().height);
    let near = height(&browser).expect("a view");
    // The middle button drags the point under it.
    pointed(&mut browser, PointerChange::Down, 1, false, [500.0, 200.0]);
    pointed(&mut browser, PointerChange::Moved, 1, false, [450.0, 260.0]);
    pointed(&mut browser, PointerChange::Up, 1, false, [450.0, 260.0]);
    assert!((world_at(&mut browser, [450.0, 260.0]) - before).length() < 0.01);
    let selected =
        |browser: &Browser| browser.app.screen.edited().map(|s| s.editor.selection.len());
    assert_eq!(selected(&browser), Some(0));
    browser.say(Event::Wheel(Vec2::new(10.0, 10.0), 6000.0));
    assert!((world_at(&mut browser, [400.0, 300.0]) - whole).length() < 0.01);
    assert!(height(&browser).is_some_and(|far| (far / near - 4.0).abs() < 0.01));
}

#[test]
fn two_fingers_zoom_and_one_on_a_piece_drags_it() {
    let mut browser = browser_at("#edit", &[("jostle.draft", SCENE)]);
    let before = world_at(&mut browser, [400.0, 300.0]);
    pointed(&mut browser, PointerChange::Down, 1, true, [380.0, 300.0]);
    pointed(&mut browser, PointerChange::Down, 2, true, [420.0, 300.0]);
    pointed(&mut browser, PointerChange::Moved, 1, true, [360.0, 320.0]);
    pointed(&mut browser, PointerChange::Moved, 2, true, [440.0, 320.0]);
    assert!((world_at(&mut browser, [400.0, 320.0]) - before).length() < 0.01);
    let unit = (world_at(&mut browser, [401.0, 320.0]) - before).x;
    pointed(&mut browser, PointerChange::Up, 1, true, [360.0, 320.0]);
    pointed(&mut browser, PointerChange::Up, 2, true, [440.0, 320.0]);
    browser.say(Event::Wheel(Vec2::ZERO, 9000.0));
    let whole = world_at(&mut browser, [401.0, 300.0]) - world_at(&mut browser, [400.0, 300.0]);
    assert!((whole.x / unit - 2.0).abs() < 0.01, "twice as large");
    // A finger that holds a piece keeps it, even if a second finger touches down.
    browser.say(clicked("edit-place", "block"));
    let place = world_at(&mut browser, [400.0, 300.0]);
    for (change, id, at) in [
        (PointerChange::Down, 1, [400.0, 300.0]),
        (PointerChange::Down, 2, [700.0, 100.0]),
        (PointerChange::Moved, 1, [460.0, 300.0]),
        (PointerChange::Up, 1, [460.0, 300.0]),
    ] {
        pointed(&mut browser, change, id, true, at);
    }
    assert!((world_at(&mut browser, [400.0, 300.0]) - place).length() < 0.01);
    let editor = &browser.app.screen.edited().expect("the editor").editor;
    let at = editor.selected().next().and_then(|piece| piece.center()).expect("a piece");
    assert!(at.x > place.x + 1.0, "{at}");
}
