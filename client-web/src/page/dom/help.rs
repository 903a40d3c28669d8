//! The help: keys and what they do.

use crate::page::dom;
use crate::page::tools;
use crate::replay::player::ReplayPlayer;
use jostle_game::Scene;
use web_sys::HtmlElement;

/// Fills the help of a game, and the hint on the stage.
pub fn fill_for_game(scene: &Scene) {
    let hint = tools::hint(scene, dom::is_touched());
    for id in ["hint", "help-hint"] {
        let line: HtmlElement = dom::by_id(id);
        dom::set_text(&line, hint.unwrap_or_default());
        dom::show(&line, hint.is_some());
    }
    let touch = tools::TOUCH_HELP.into_iter().filter(|_| dom::is_touched());
    let keys = tools::caps(scene).into_iter().map(|cap| (cap.key, cap.does));
    let keys = touch.chain(keys).chain(tools::PAGE_HELP);
    fill("How to play", &scene.about, "Back to the game", keys);
}

/// Fills the help of a replay.
pub fn fill_for_replay(player: &ReplayPlayer) {
    let about = &player.scene().about;
    fill("Watching a replay", about, "Back to the replay", tools::REPLAY_HELP);
}

/// A key without a meaning of its own joins the next.
fn fill(
    title: &str,
    about: &str,
    back: &str,
    keys: impl IntoIterator<Item = (&'static str, &'static str)>,
) {
    dom::set_text(&dom::by_id("help-title"), title);
    dom::set_text(&dom::by_id("help-about"), about);
    dom::set_text(&dom::by_id("help-close"), back);
    let list: HtmlElement = dom::by_id("help-keys");
    list.set_text_content(None);
    let mut joined = String::new();
    for (key, does) in keys {
        joined = if joined.is_empty() { key.to_owned() } else { format!("{joined} {key}") };
        if !does.is_empty() {
            dom::append(&list, &dom::labelled("dt", "", &joined));
            dom::append(&list, &dom::labelled("dd", "", does));
            joined.clear();
        }
    }
}
