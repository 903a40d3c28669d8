//! The editor: opened, played, and left.

use super::*;

fn browser_at(hash: &str, local: &[(&str, &str)]) -> Browser {
    let local = local.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned()));
    let remembered = Remembered { local: local.collect(), ..Default::default() };
    let mut browser = Browser::open_with("/", "", remembered);
    browser.say(Event::Navigated(Address {
        path: "/".to_owned(),
        query: String::new(),
        hash: hash.to_owned(),
    }));
    browser
}

fn text(browser: &Browser) -> String {
    browser.app.edited().expect("the editor").editor.text().to_owned()
}

#[test]
fn a_shipped_scene_is_edited_played_and_edited_again() {
    let mut browser = browser_at("#edit=splash", &[]);
    browser.wait(100);
    assert_eq!(browser.app.state(), "editing");
    let source = text(&browser);
    assert!(browser.app.frame().is_some_and(|frame| !frame.bodies.is_empty()));
    browser.press("KeyE", "e");
    assert_eq!(browser.app.state(), "playing");
    browser.wait(200);
    assert!(browser.app.game().is_some_and(|game| game.replica().is_some()));
    browser.press("KeyE", "e");
    assert_eq!(browser.app.state(), "editing");
    assert_eq!(text(&browser), source);
    browser.click("leave");
    assert_eq!(browser.app.state(), "lobby");
}

#[test]
fn what_is_edited_is_kept_and_comes_back() {
    let mut browser = browser_at("#edit", &[]);
    assert_eq!((browser.app.state(), text(&browser).as_str()), ("editing", ""));
    browser.say(Event::Clicked("edit-place".to_owned(), "block".to_owned()));
    let effects = browser.say(Event::Pulse { hidden: false });
    assert!(has(&effects, "StoreLocal(\"jostle.draft\""), "{effects:?}");
    let kept = text(&browser);
    let again = browser_at("#edit", &[("jostle.draft", &kept)]);
    assert_eq!(text(&again), kept);
    // That of another scene is not taken for this one.
    let other = browser_at("#edit=pile", &[("jostle.draft", &kept)]);
    assert!(text(&other).contains("title = \"Pile\""));
}

#[test]
fn a_text_with_an_error_is_not_played() {
    let mut browser = browser_at("#edit", &[("jostle.draft", "title = 3\n")]);
    browser.wait(100);
    browser.press("KeyE", "e");
    assert_eq!(browser.app.state(), "editing");
    let editor = &browser.app.edited().expect("the editor").editor;
    assert!(editor.said.starts_with("my-scene.toml:1: title: found 3"), "{}", editor.said);
    assert_eq!(editor.error_bytes(), Some(0..9));
}

#[test]
fn a_scene_that_is_played_alone_becomes_one_that_is_edited() {
    let mut browser = browser_at("#alone=pile&seed=7", &[]);
    browser.wait(200);
    let effects = browser.press("KeyE", "e");
    assert!(has(&effects, "PushAddress(\"/#edit=pile\")"), "{effects:?}");
    assert_eq!(browser.app.state(), "editing");
}
