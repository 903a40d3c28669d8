//! The card in the middle of the page: what happened, what to do, one button.

use super::app;
use super::dom;
use crate::words::{self, Notice, Way};
use std::cell::Cell;
use web_sys::{Event, HtmlElement};

thread_local! {
    static SHOWN: Cell<Option<Notice>> = const { Cell::new(None) };
}

/// Listens to the card's button.
pub fn listen() {
    dom::listen(&dom::by_id::<HtmlElement>("notice-button"), "click", |_: Event| {
        match SHOWN.get().map(|notice| notice.way) {
            Some(Way::Lobby) => app::leave(),
            Some(Way::Reload) => {
                let _ = dom::window().location().reload();
            }
            Some(Way::Again) => {
                app::with(|app| app.take_way(Way::Again));
            }
            None => {}
        }
    });
}

/// Shows a card, unless it is on already.
pub fn show(notice: &Notice) {
    if crashed() || SHOWN.replace(Some(*notice)) == Some(*notice) {
        return;
    }
    dom::set_text(&dom::by_id("notice-title"), notice.title);
    dom::set_text(&dom::by_id("notice-text"), notice.text);
    let button: HtmlElement = dom::by_id("notice-button");
    dom::set_text(&button, notice.button);
    dom::show(&dom::by_id("notice"), true);
    if !notice.passing {
        let _ = button.focus();
    }
}

/// Takes the card away.
pub fn hide() {
    if !crashed() && SHOWN.replace(None).is_some() {
        dom::show(&dom::by_id("notice"), false);
        let _ = dom::by_id::<HtmlElement>("stage").focus();
    }
}

/// The last card there is.
fn crashed() -> bool {
    SHOWN.get() == Some(words::CRASHED)
}

/// Whether a card is on.
pub fn is_shown() -> bool {
    SHOWN.get().is_some()
}
