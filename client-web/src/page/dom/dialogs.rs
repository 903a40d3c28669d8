//! The cards over the page. While one must be answered the focus is in it and the rest of the page is
//! inert; afterwards the focus is where it was.

use crate::browser;
use crate::page::app::App;
use crate::page::dialogs::{Card, Question};
use crate::page::dom;
use crate::page::layers::{Layer, Layers};
use crate::page::strings;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;
use web_sys::HtmlElement;

/// The cards as they were shown last.
#[derive(Default)]
pub struct DialogsView {
    card: Option<Card>,
    question: Option<Question>,
    layers: Layers,
    /// The element that had the focus before the first card.
    before: Option<HtmlElement>,
}

impl DialogsView {
    /// Shows the open cards.
    pub fn show(&mut self, app: &App) {
        let card = app.notice();
        let layers = app.dialogs.layers(card.as_ref());
        if self.card != card {
            match &card {
                Some(card) => fill_card(card),
                None => dom::show(&dom::by_id("notice"), false),
            }
            self.card = card;
        }
        if self.question != app.dialogs.question {
            self.question.clone_from(&app.dialogs.question);
            if let Some(question) = &self.question {
                fill_question(question);
            }
        }
        if self.layers != layers {
            let before = std::mem::replace(&mut self.layers, layers).top();
            dom::show(&dom::by_id("help"), layers.help);
            dom::show(&dom::by_id("ask"), layers.ask);
            self.settle(before);
        }
    }

    fn settle(&mut self, before: Layer) {
        let top = self.layers.top();
        if before == Layer::Page && top != Layer::Page {
            let focused = dom::document().active_element();
            self.before = focused.and_then(|element| element.dyn_into().ok());
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
            let _ = element.toggle_attribute_with_force("inert", self.layers.is_inert(layer));
        }
        let focused = match top {
            Layer::Page => self.before.take(),
            Layer::Help => Some(dom::by_id("help-close")),
            Layer::Ask => Some(dom::by_id("ask-no")),
            Layer::Notice => Some(dom::by_id("notice-button")),
        };
        if let Some(element) = focused {
            let _ = element.focus();
        }
        rescue_focus();
    }
}

/// Gives the focus to the canvas if nothing visible has it.
pub fn rescue_focus() {
    let lost = dom::document().active_element().is_none_or(|element| {
        let gone = element.closest("[hidden], [inert]").ok().flatten();
        gone.is_some() || element.tag_name() == "BODY"
    });
    if lost {
        let _ = dom::by_id::<HtmlElement>("stage").focus();
    }
}

fn fill_card(card: &Card) {
    let Card { notice, text, detail } = card;
    dom::set_text(&dom::by_id("notice-title"), notice.title);
    dom::set_text(&dom::by_id("notice-text"), text.as_deref().unwrap_or(notice.text));
    let line: HtmlElement = dom::by_id("notice-detail");
    dom::set_text(&line, detail);
    dom::show(&line, !detail.is_empty());
    dom::set_text(&dom::by_id("notice-button"), notice.button);
    let other: HtmlElement = dom::by_id("notice-other");
    dom::set_text(&other, notice.other.map_or("", |(label, _)| label));
    dom::show(&other, notice.other.is_some());
    let element: HtmlElement = dom::by_id("notice");
    dom::set(&element, "aria-modal", if notice.passing { "false" } else { "true" });
    dom::show(&element, true);
}

fn fill_question(question: &Question) {
    let title: HtmlElement = dom::by_id("ask-title");
    title.set_text_content(None);
    let (text, yes) = match question {
        Question::Kick(_, who) => {
            let [before, after] = strings::ASK_KICK;
            dom::append(&title, &dom::labelled("span", "", before));
            dom::append(&title, &dom::labelled("bdi", "", &who.name));
            dom::append(&title, &dom::labelled("span", "", after));
            (strings::ABOUT_KICK, strings::DO_KICK)
        }
        Question::CloseRoom => {
            dom::set_text(&title, strings::ASK_CLOSE);
            (strings::ABOUT_CLOSE, strings::DO_CLOSE)
        }
    };
    dom::set_text(&dom::by_id("ask-text"), text);
    dom::set_text(&dom::by_id("ask-yes"), yes);
}

/// The last card there is: the program ended by a mistake of its own. Needs nothing but the document.
pub fn show_crash() {
    let card = Card::from(strings::CRASHED);
    fill_card(&card);
    let _ = dom::root().dataset().set("state", "refused");
    let reload = Closure::once_into_js(|| {
        let _ = browser::window().location().reload();
    });
    let button: HtmlElement = dom::by_id("notice-button");
    button.set_onclick(Some(reload.unchecked_ref()));
    let _ = button.focus();
}
