//! The card in the middle of the page: what happened, what to do, one button or two.

use super::app;
use super::{dom, files, modal};
use crate::api;
use crate::words::{self, Notice, Way};
use std::cell::Cell;
use web_sys::{Event, HtmlElement};

thread_local! {
    static SHOWN: Cell<Option<Notice>> = const { Cell::new(None) };
}

/// Listens to the card's buttons.
pub fn listen() {
    dom::listen(&dom::by_id::<HtmlElement>("notice-button"), "click", |_: Event| {
        take(SHOWN.get().map(|notice| notice.way));
    });
    dom::listen(&dom::by_id::<HtmlElement>("notice-other"), "click", |_: Event| {
        take(SHOWN.get().and_then(|notice| notice.other).map(|(_, way)| way));
    });
}

fn take(way: Option<Way>) {
    match way {
        Some(Way::Lobby) => app::leave(),
        Some(Way::Arena) => app::enter(api::FIRST_SCENE),
        Some(Way::Reload) => {
            let _ = dom::window().location().reload();
        }
        Some(Way::File) => files::choose(),
        Some(way @ (Way::Again | Way::Stay | Way::Refetch)) => {
            app::with(|app| app.take_way(way));
        }
        None => {}
    }
}

/// Shows a card, unless it is on already.
pub fn show(notice: &Notice) {
    if SHOWN.get() != Some(*notice) {
        show_saying(notice, notice.text, "");
    }
}

/// Shows a card with a text of its own, and a line about what exactly was found.
pub fn show_saying(notice: &Notice, text: &str, detail: &str) {
    if crashed() {
        return;
    }
    SHOWN.set(Some(*notice));
    dom::set_text(&dom::by_id("notice-title"), notice.title);
    dom::set_text(&dom::by_id("notice-text"), text);
    let line: HtmlElement = dom::by_id("notice-detail");
    dom::set_text(&line, detail);
    dom::show(&line, !detail.is_empty());
    let button: HtmlElement = dom::by_id("notice-button");
    dom::set_text(&button, notice.button);
    let other: HtmlElement = dom::by_id("notice-other");
    dom::set_text(&other, notice.other.map_or("", |(label, _)| label));
    dom::show(&other, notice.other.is_some());
    modal::set_notice(true, !notice.passing);
}

/// Takes the card away.
pub fn hide() {
    if !crashed() && SHOWN.replace(None).is_some() {
        modal::set_notice(false, false);
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
