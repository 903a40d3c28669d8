//! The help: keys and what they do.

use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::tools;
use jostle_game::{Scene, Tools};

/// Fills the help of a game, and the hint on the stage.
pub fn fill_for_game(keys: &mut List, scene: &Scene) {
    let is_touched = dom::is_touched();
    let hint = tools::hint(scene, is_touched);
    dom::text_or_hide("hint", hint);
    dom::text_or_hide("help-hint", hint);
    // Who has no keys is told of none.
    let touch = tools::TOUCH_HELP.into_iter().filter(|_| is_touched);
    let caps = tools::caps(scene).into_iter().map(|cap| (cap.key, cap.does));
    let mute = Some(tools::MUTE_HELP).filter(|_| !scene.tools.contains(Tools::SELECT));
    let keys_of_page = caps.chain(mute).chain(tools::PAGE_HELP).filter(|_| !is_touched);
    let help = touch.chain(keys_of_page);
    fill(keys, ["How to play", &scene.about, "Back to the game"], help);
}

pub fn fill_for_replay(keys: &mut List, scene: &Scene) {
    let texts = ["Watching a replay", &scene.about, "Back to the replay"];
    fill(keys, texts, tools::REPLAY_HELP);
}

/// A key without a meaning of its own joins the next.
fn fill(
    keys: &mut List,
    texts: [&str; 3],
    help: impl IntoIterator<Item = (&'static str, &'static str)>,
) {
    for (id, text) in ["help-title", "help-about", "help-close"].into_iter().zip(texts) {
        dom::text(id, text);
    }
    let mut joined = String::new();
    keys.show(help.into_iter().filter_map(|(key, does)| {
        joined = if joined.is_empty() { key.to_owned() } else { format!("{joined} {key}") };
        let key = (!does.is_empty()).then(|| std::mem::take(&mut joined))?;
        Some(Item::new("help-item", &key).text("dt", key).text("dd", does))
    }));
}
