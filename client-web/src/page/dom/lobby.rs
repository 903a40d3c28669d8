//! The DOM side of the lobby: its form, pictures that load when visible, and the hero in the wordmark.

use crate::page::dom;
use crate::page::event::{Event, Form};
use crate::page::lobby::Lobby;
use crate::page::name;
use crate::page::panels::lobby::FOLDED;
use crate::page::queue::Events;
use jostle_protocol::Appearance;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement, HtmlInputElement, InputEvent, MouseEvent, PointerEvent};

/// Fills the form with the player's name and colour.
pub fn fill_form(player: &Appearance) {
    dom::by_id::<HtmlInputElement>("name").set_value(&player.name);
    let colors = format!("#colors input[value='{}']", player.color);
    if let Some(radio) = dom::query::<HtmlInputElement>(&colors) {
        radio.set_checked(true);
    }
}

/// Scrolls a new error note into view.
pub fn reveal_note(lobby: &Lobby) {
    dom::html("lobby-note").scroll_into_view_with_bool(false);
    if lobby.name_invalid {
        let _ = dom::html("name").focus();
    }
}

/// Loads the pictures of visible scenes. The browser's lazy loading would also fetch pictures far below, and few
/// visitors scroll that far. This runs with every pulse, so it follows scrolling.
pub fn load_visible() {
    let height = f64::from(dom::root().client_height());
    let waiting = dom::document().query_selector_all("img[data-src]").expect("a valid selector");
    for at in 0..waiting.length() {
        let Some(image) = waiting.item(at).and_then(|node| node.dyn_into::<Element>().ok()) else {
            continue;
        };
        let place = image.get_bounding_client_rect();
        if place.height() > 0.0 && place.top() < height {
            dom::set(&image, "src", image.get_attribute("data-src").as_deref());
            dom::set(&image, "data-src", None);
        }
    }
}

pub fn form() -> Form {
    let checked = dom::query::<HtmlInputElement>("#colors input:checked");
    Form {
        name: dom::by_id::<HtmlInputElement>("name").value(),
        color: checked.and_then(|radio| radio.value().parse().ok()).unwrap_or(0),
        private: false,
        bots: dom::by_id::<HtmlInputElement>("bots").checked(),
    }
}

pub fn listen(events: Events) {
    let join = dom::html("join");
    dom::listen(&join, "submit", move |event: web_sys::Event| {
        event.prevent_default();
        events.push(Event::PlayClicked(form()));
    });
    dom::listen(&join, "input", move |event: web_sys::Event| {
        // Text that is still being composed belongs to the input method.
        if !event.dyn_ref::<InputEvent>().is_some_and(InputEvent::is_composing) {
            fit_name();
        }
        events.push(Event::FormChanged(form()));
    });
    dom::listen(&dom::html("name"), "compositionend", |_: web_sys::Event| fit_name());
    dom::listen(&dom::html("all-replays"), "click", |_: MouseEvent| {
        let _ = dom::html("replay-list").class_list().remove_1("folded");
        let next =
            dom::query::<HtmlElement>(&format!("#replay-list li:nth-child({}) a", FOLDED + 1));
        next.into_iter().for_each(|link| drop(link.focus()));
    });
    dom::listen(&dom::html("lobby"), "pointermove", |event: PointerEvent| follow(&event));
}

/// Makes the wordmark's hero look at the pointer.
fn follow(event: &PointerEvent) {
    let Some(hero) = dom::query::<Element>(".block.hero") else { return };
    let bounds = hero.get_bounding_client_rect();
    let dx = f64::from(event.client_x()) - (bounds.left() + bounds.width() * 0.5);
    let dy = f64::from(event.client_y()) - (bounds.top() + bounds.height() * 0.5);
    let length = (dx * dx + dy * dy).sqrt().max(60.0);
    dom::style(&hero, "--gaze-x", &format!("{:.2}", dx / length));
    dom::style(&hero, "--gaze-y", &format!("{:.2}", dy / length));
}

/// Truncates the field to a valid name length. The browser's own limit counts UTF-16 units.
fn fit_name() {
    let input: HtmlInputElement = dom::by_id("name");
    let typed = input.value();
    let fitting = name::fit(&typed);
    if fitting.len() < typed.len() {
        let caret = input.selection_end().ok().flatten();
        input.set_value(fitting);
        if let Some(caret) = caret {
            let _ = input.set_selection_range(caret, caret);
        }
    }
}
