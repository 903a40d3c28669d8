//! Tests what a page shows when something happens in a round: the podium, the best of the round, and a held picture.

use super::*;
use crate::page::view::View;

/// A yard without controls, in which whoever stands on the spawn with this number scores once a second.
fn yard(spawn: usize) -> Event {
    let x = 20 + 40 * spawn;
    let text = format!(
        r#"title = "Yard"
size = [320, 180]
gravity = [0, 0]
tools = []
groups = ["hero"]

[hero]
size = [12, 12]
spawns = [[20, 20], [60, 20], [100, 20], [140, 20]]

[round]
task = "Stand there"
time = 6
countdown = 0
pause = 30
fill = 4

[[zones]]
name = "spot"
area = [[{}, 10], [{}, 30]]
take = 0.2

[[rules]]
every = 1
score = 1
to = "spot"
"#,
        x - 8,
        x + 8
    );
    Event::SceneRead("yard.toml".into(), Ok(text.into()))
}

#[test]
fn the_result_has_a_podium_and_says_who_won_or_lost() {
    for (spawn, title, mood) in [(0, "You won!", "won"), (1, "You lost", "lost")] {
        let mut browser = Browser::open("/", "");
        browser.say(yard(spawn));
        browser.wait(7000);
        assert!(browser.is_shown("#result"), "spawn {spawn}");
        assert_eq!(browser.text_at("#result-title"), title);
        let round = browser.panel("round");
        assert_eq!(round.attribute_of("#result", "data-mood"), Some(Some(mood)));
        let places: Vec<_> = browser.entries("#podium").iter().map(place).collect();
        assert_eq!(places, ["1", "2", "3"]);
        assert_eq!(browser.entries("#result-sides").len(), 1, "the fourth is listed below");
    }
}

fn place(entry: &View) -> String {
    entry.attribute_of("", "data-place").flatten().expect("a place").to_owned()
}

#[test]
fn the_end_holds_the_picture_but_never_a_calm_one() {
    let mut browser = Browser::open("/", "");
    browser.say(yard(0));
    browser.wait(200);
    let mut held = 0;
    for _ in 0..400 {
        browser.wait(20);
        let frame = |calm| browser.app.screen.frame(browser.app.ctx.now_ms, calm).is_some();
        assert!(frame(true), "a calm picture goes on");
        held += u32::from(!frame(false) && browser.is_shown("#result"));
    }
    assert!((5..=13).contains(&held), "{held} frames of 20 ms");
}
