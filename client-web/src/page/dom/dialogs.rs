//! The cards over the page. While one must be answered the focus is in it and the rest of the page is
//! inert; afterwards the focus is where it was.

use crate::browser;
use crate::language::{around, say};
use crate::page::app::App;
use crate::page::dialogs::{Card, Question};
use crate::page::dom;
use crate::page::dom::patch::rescue_focus;
use crate::page::layers::{Layer, Layers};
use crate::page::qr_code;
use crate::page::strings;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;
use web_sys::{Element, HtmlElement};

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
    /// Fills the open cards again: the language is another.
    pub fn retell(&mut self) {
        self.card.iter().for_each(fill_card);
        self.question.iter().for_each(fill_question);
    }

    /// Shows the open cards.
    pub fn show(&mut self, app: &App) {
        let card = app.notice();
        let layers = app.dialogs.layers(card.as_ref());
        if self.card != card {
            dom::show("notice", card.is_some());
            card.iter().for_each(fill_card);
            self.card = card;
        }
        if self.question != app.dialogs.question {
            self.question.clone_from(&app.dialogs.question);
            self.question.iter().for_each(fill_question);
        }
        if self.layers != layers {
            let before = std::mem::replace(&mut self.layers, layers).top();
            dom::show("settings", layers.settings);
            dom::show("ask", layers.ask);
            self.settle(before);
        }
    }

    fn settle(&mut self, before: Layer) {
        let top = self.layers.top();
        if before == Layer::Page && top != Layer::Page {
            let focused = dom::document().active_element();
            self.before = focused.and_then(|element| element.dyn_into().ok());
        }
        for (id, layer) in [
            ("lobby", Layer::Page),
            ("game", Layer::Page),
            ("editor", Layer::Page),
            ("help", Layer::Help),
            ("settings", Layer::Settings),
            ("ask", Layer::Ask),
            ("notice", Layer::Notice),
        ] {
            dom::set(&dom::html(id), "inert", self.layers.is_inert(layer).then_some(""));
        }
        let focused = match top {
            Layer::Page => self.before.take(),
            Layer::Help => Some(dom::html("help-close")),
            Layer::Settings => Some(dom::html("language")),
            Layer::Ask => Some(dom::html("ask-no")),
            Layer::Notice => Some(dom::html("notice-button")),
        };
        if let Some(element) = focused {
            let _ = element.focus();
        }
        rescue_focus();
    }
}

fn fill_card(card: &Card) {
    dom::text("notice-title", say(card.title));
    dom::text("notice-text", say(&card.text));
    dom::text_or_hide("notice-detail", Some(&*card.detail).filter(|detail| !detail.is_empty()));
    dom::text("notice-button", say(card.button));
    dom::text_or_hide("notice-other", card.other.map(|(label, _)| say(label)));
    let code = card.code.as_deref().and_then(qr_code::draw);
    dom::show("notice-code", code.is_some());
    if let (Some(code), Some(svg)) = (code, dom::query::<Element>("#notice-code svg")) {
        dom::set(&svg, "viewBox", Some(&format!("0 0 {0} {0}", code.side)));
        let path = svg.first_element_child().expect("a path in it");
        dom::set(&path, "d", Some(&code.path));
    }
    let modal = if card.passing { "false" } else { "true" };
    dom::set(&dom::html("notice"), "aria-modal", Some(modal));
}

fn fill_question(question: &Question) {
    let (before, after) = around("Remove {player}?");
    let (title, text, yes) = match question {
        Question::Kick(_, who) => (
            [before, &*who.name, after],
            say("They'll be removed, and no one new can join from their network for five minutes."),
            say("Remove"),
        ),
        Question::CloseRoom => (
            [say("Close this room?"), "", ""],
            say("Everyone, including you, will be sent out, and the link will stop working."),
            say("Close room"),
        ),
    };
    for (id, part) in ["ask-before", "ask-name", "ask-after"].into_iter().zip(title) {
        dom::text(id, part);
    }
    dom::text("ask-text", text);
    dom::text("ask-yes", yes);
}

/// The last card there is: the program ended by a mistake of its own. Needs nothing but the document.
pub fn show_crash() {
    fill_card(&strings::CRASHED);
    dom::show("notice", true);
    dom::set(&dom::root(), "data-state", Some("refused"));
    let reload = Closure::once_into_js(|| {
        let _ = browser::window().location().reload();
    });
    let button = dom::html("notice-button");
    button.set_onclick(Some(reload.unchecked_ref()));
    let _ = button.focus();
}
