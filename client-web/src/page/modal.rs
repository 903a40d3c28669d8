//! Cards that must be answered: while one is open the focus is in it and the rest of the page is
//! inert; afterwards the focus is where it was. Needs no app: it works when that is broken.

use super::dom;
use crate::layers::{Layer, Layers};
use std::cell::Cell;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

thread_local! {
    static LAYERS: Cell<Layers> = const {
        Cell::new(Layers { help: false, ask: false, notice: false })
    };
    /// What had the focus before the first card.
    static BEFORE: Cell<Option<HtmlElement>> = const { Cell::new(None) };
}

/// The layer that takes keys and clicks.
pub fn top() -> Layer {
    LAYERS.get().top()
}

/// Opens or closes the help.
pub fn set_help(open: bool) {
    dom::show(&dom::by_id("help"), open);
    settle(Layers { help: open, ..LAYERS.get() });
}

/// Opens or closes a question.
pub fn set_ask(open: bool) {
    dom::show(&dom::by_id("ask"), open);
    settle(Layers { ask: open, ..LAYERS.get() });
}

/// Shows or hides the notice; `modal` if it waits for an answer.
pub fn set_notice(shown: bool, modal: bool) {
    let notice: HtmlElement = dom::by_id("notice");
    dom::set(&notice, "aria-modal", if modal { "true" } else { "false" });
    dom::show(&notice, shown);
    settle(Layers { notice: shown && modal, ..LAYERS.get() });
}

fn settle(layers: Layers) {
    let before = LAYERS.replace(layers).top();
    let top = layers.top();
    if before == Layer::Page && top != Layer::Page {
        let focused = dom::document().active_element();
        BEFORE.set(focused.and_then(|element| element.dyn_into().ok()));
    }
    let parts = [
        ("lobby", Layer::Page),
        ("game", Layer::Page),
        ("help", Layer::Help),
        ("ask", Layer::Ask),
        ("notice", Layer::Notice),
    ];
    for (id, layer) in parts {
        let element: HtmlElement = dom::by_id(id);
        let _ = element.toggle_attribute_with_force("inert", layers.is_inert(layer));
    }
    let focused = match top {
        Layer::Page => BEFORE.take(),
        Layer::Help => Some(dom::by_id("help-close")),
        Layer::Ask => Some(dom::by_id("ask-no")),
        Layer::Notice => Some(dom::by_id("notice-button")),
    };
    if let Some(element) = focused {
        let _ = element.focus();
    }
    rescue_focus();
}

/// Gives the focus to the world if nothing that can be seen has it.
pub fn rescue_focus() {
    let lost = dom::document().active_element().is_none_or(|element| {
        let gone = element.closest("[hidden], [inert]").ok().flatten();
        gone.is_some() || element.tag_name() == "BODY"
    });
    if lost {
        let _ = dom::by_id::<HtmlElement>("stage").focus();
    }
}
