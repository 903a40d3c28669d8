//! The help: keys and what they do.

use crate::input::action::Action;
use crate::language::{fill as fill_in, say};
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::settings::Settings;
use crate::page::tools;
use jostle_game::{Scene, Tools};

/// Fills the help of a game, and the hint on the stage.
pub fn fill_for_game(keys: &mut List, scene: &Scene, settings: &Settings) {
    let is_touched = dom::is_touched();
    let picks = [Action::Hero, Action::Minion, Action::Platform].map(|action| settings.cap(action));
    let picks = ["hero", "minion", "platform"].into_iter().zip(picks.iter().map(String::as_str));
    let picks: Vec<(&str, &str)> = picks.collect();
    let hint = tools::hint(scene, is_touched).map(|hint| fill_in(hint, &picks));
    dom::text_or_hide("hint", hint.as_deref());
    dom::text_or_hide("help-hint", hint.as_deref());
    // Who has no keys is told of none.
    let told = |(key, does): (&'static str, _)| (say(key).to_owned(), does);
    let touch = tools::TOUCH_HELP.map(told).into_iter().filter(|_| is_touched);
    let caps = tools::caps(scene).into_iter().map(|cap| (settings.key_of(&cap), cap.does));
    let mutes = !scene.tools.contains(Tools::SELECT);
    let chosen =
        tools::CHOSEN_HELP.into_iter().filter(|(action, _)| *action != Action::Mute || mutes);
    let chosen = chosen.map(|(action, does)| (settings.cap(action), does));
    let keys_of_page = caps.chain(chosen).chain(tools::PAGE_HELP.map(told));
    let help = touch.chain(keys_of_page.filter(|_| !is_touched));
    fill(keys, [say("How to play"), say(&scene.about), say("Back to the game")], help);
}

pub fn fill_for_replay(keys: &mut List, scene: &Scene) {
    let texts = [say("Watching a replay"), say(&scene.about), say("Back to the replay")];
    fill(keys, texts, tools::REPLAY_HELP.map(|(key, does)| (say(key).to_owned(), does)));
}

/// A key without a meaning of its own joins the next.
fn fill(keys: &mut List, texts: [&str; 3], help: impl IntoIterator<Item = (String, &'static str)>) {
    for (id, text) in ["help-title", "help-about", "help-close"].into_iter().zip(texts) {
        dom::text(id, text);
    }
    let mut joined = String::new();
    keys.show(help.into_iter().filter_map(|(key, does)| {
        joined = if joined.is_empty() { key } else { format!("{joined} {key}") };
        let key = (!does.is_empty()).then(|| std::mem::take(&mut joined))?;
        Some(Item::new("help-item", &key).text("dt", key).text("dd", say(does)))
    }));
}
