//! The settings dialog: language, reduced motion, full screen, keys, gamepad.

use crate::input::action::Action;
use crate::page::app::App;
use crate::page::page_action::PageAction;
use crate::page::settings::Choice;
use crate::page::settings::Settings;
use crate::page::strings;
use crate::page::view::{Set, View, word};

pub fn view(app: &App) -> View {
    let settings = &app.settings;
    let view = View::panel("settings").show("#settings", app.visit.dialogs.settings);
    if !app.visit.dialogs.settings {
        return view;
    }
    let has_seat = app.screen.game().is_some_and(|game| !game.watches());
    let view = view
        .show("#own-look", has_seat)
        .set("#own-name", Set::Typed(app.appearance.name.to_string().into()))
        .set("#own-colors", Set::Choice(app.appearance.color.to_string().into()));
    let keys = Action::ALL.into_iter().map(|action| {
        let is_asked = settings.choice == Some(Choice::Key(action));
        entry(action, PageAction::ChooseKey, settings.cap(action), is_asked)
    });
    let view = view
        .list("#key-list", keys)
        .set("#language", Set::Value(settings.language.clone().into()))
        .set("#calm-on", Set::Checked(settings.calm))
        .set("#full-on", Set::Checked(settings.is_full))
        .text("#settings-note", settings.note.clone())
        .show("#pad-none", !settings.has_pad)
        .show("#pad-choices", settings.has_pad);
    if settings.has_pad { pad(view, settings) } else { view }
}

fn pad(view: View, settings: &Settings) -> View {
    let played = Action::ALL.into_iter().filter(|action| *action != Action::Edit);
    let buttons = played.map(|action| {
        let button = settings.pad.button(action).map_or("\u{2013}", strings::pad_button);
        let is_asked = settings.choice == Some(Choice::Button(action));
        entry(action, PageAction::ChooseButton, button.to_owned(), is_asked)
    });
    let zone = settings.pad.dead_zone;
    view.list("#pad-list", buttons)
        .set("#dead-zone", Set::Value(zone.to_string().into()))
        .text("#zone-shown", strings::percent(zone))
}

/// An action with its key or button.
fn entry(action: Action, asks: PageAction, cap: String, is_asked: bool) -> View {
    let cap = if is_asked { "\u{2026}".to_owned() } else { cap };
    View::item("binding-item", action.id())
        .with("button", "data-action", asks.name())
        .with("button", "data-value", action.id())
        .with("button", "aria-pressed", word(is_asked))
        .text("button span", strings::action(action))
        .text("kbd", cap)
}
