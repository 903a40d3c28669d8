//! The help dialog, which lists keys and their actions.

use crate::input::action::Action;
use crate::language::{fill, say};
use crate::page::app::App;
use crate::page::game::GameScreen;
use crate::page::settings::Settings;
use crate::page::tools;
use crate::page::view::{Text, View};
use jostle_game::{Scene, Tools};

pub fn view(app: &App) -> View {
    let view = View::panel("help").show("#help", app.visit.dialogs.help);
    if !app.visit.dialogs.help {
        return view;
    }
    let game = app.screen.game().and_then(|game| game.replica());
    let watches = app.screen.game().is_some_and(GameScreen::watches);
    let (title, scene, close, hint, keys) = match (game, app.screen.replay()) {
        (Some(replica), _) => {
            let (scene, settings) = (&replica.room.scene, &app.settings);
            let (hint, keys) = (hint(scene, settings), of_game(scene, settings, watches));
            (say("How to play"), scene, say("Back to the game"), hint, keys)
        }
        (_, Some(replay)) => {
            let keys = tools::REPLAY_HELP.map(|(key, does)| (say(key).to_owned(), does));
            let close = say("Back to the replay");
            (say("Watching a replay"), replay.player.scene(), close, None, keys.to_vec())
        }
        _ => return view,
    };
    // A key without a description is joined with the next key.
    let mut joined = String::new();
    let entries = keys.into_iter().filter_map(|(key, does)| {
        joined = if joined.is_empty() { key } else { format!("{joined} {key}") };
        let key = (!does.is_empty()).then(|| std::mem::take(&mut joined))?;
        Some(View::item("help-item", &key).text("dt", key).text("dd", say(does)))
    });
    view.list("#help-keys", entries)
        .text("#help-title", title)
        .text("#help-about", say(&scene.about).to_owned())
        .text_or_hide("#help-hint", hint)
        .text("#help-close", close)
}

/// A line that explains the scene.
pub fn hint(scene: &Scene, settings: &Settings) -> Option<Text> {
    let picks = [Action::Hero, Action::Minion, Action::Platform].map(|action| settings.cap(action));
    let [hero, minion, platform] = picks.each_ref().map(String::as_str);
    let picks = [("hero", hero), ("minion", minion), ("platform", platform)];
    tools::hint(scene, settings.touched).map(|hint| fill(hint, &picks).into())
}

fn of_game(scene: &Scene, settings: &Settings, watches: bool) -> Vec<(String, &'static str)> {
    // On touch screens, the help does not mention keys.
    let told = |(key, does): (&'static str, _)| (say(key).to_owned(), does);
    if settings.touched {
        return tools::touch_help(scene).map(told).collect();
    }
    if watches {
        return tools::WATCH_HELP.into_iter().chain(tools::PAGE_HELP).map(told).collect();
    }
    let caps = tools::caps(scene).into_iter().map(|cap| (settings.key_of(&cap), cap.does));
    let steers = scene.tools.contains(Tools::STEER);
    let steering = steers.then_some(tools::STEER_HELP).map(told);
    let mutes = !scene.tools.contains(Tools::SELECT);
    let chosen =
        tools::CHOSEN_HELP.into_iter().filter(|(action, _)| *action != Action::Mute || mutes);
    let chosen = chosen.map(|(action, does)| (settings.cap(action), does));
    caps.chain(steering).chain(chosen).chain(tools::PAGE_HELP.map(told)).collect()
}
