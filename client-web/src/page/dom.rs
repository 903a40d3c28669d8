//! Short helpers for common DOM calls. Ids are those of `index.html`; a missing element is a bug and causes a panic
//! that names the id.

pub mod crash;
pub mod editor;
mod files;
pub mod language;
pub mod listeners;
mod lobby;
mod patch;
pub mod settings;
pub mod stage;
mod tags;
mod timeline;
mod touchpad;
pub mod views;

use crate::browser;
use jostle_game::scene::parse_decimal;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Document, Element, Event, EventTarget, HtmlElement, HtmlInputElement, MouseEvent};

pub fn document() -> Document {
    browser::window().document().expect("a page has a document")
}

/// The root element. Its data attributes describe the state of the page.
pub fn root() -> Element {
    document().document_element().expect("a document has a root")
}

pub fn by_id<T: JsCast>(id: &str) -> T {
    let element = document().get_element_by_id(id);
    let element = element.unwrap_or_else(|| panic!("index.html lacks #{id}"));
    element.dyn_into().unwrap_or_else(|_| panic!("#{id} is of another kind"))
}

pub fn html(id: &str) -> HtmlElement {
    by_id(id)
}

/// The first element that matches a selector.
pub fn query<T: JsCast>(selector: &str) -> Option<T> {
    document().query_selector(selector).ok().flatten()?.dyn_into().ok()
}

/// Sets or removes an attribute if it differs.
pub fn set(element: &Element, name: &str, value: Option<&str>) {
    if element.get_attribute(name).as_deref() != value {
        let done = match value {
            Some(value) => element.set_attribute(name, value),
            None => element.remove_attribute(name),
        };
        done.expect("attribute names are valid");
    }
}

/// Sets a style property if it differs.
pub fn style(element: &Element, name: &str, value: &str) {
    let style = element.unchecked_ref::<HtmlElement>().style();
    if style.get_property_value(name).as_deref() != Ok(value) {
        style.set_property(name, value).expect("a live element takes styles");
    }
}

/// Sets an element's text if it differs, so that unchanged text does not cause a new layout.
pub fn set_text(element: &Element, text: &str) {
    if element.text_content().as_deref() != Some(text) {
        element.set_text_content(Some(text));
    }
}

/// Sets the text of the element with this id.
pub fn text(id: &str, text: &str) {
    set_text(&html(id), text);
}

/// Shows or hides the element with this id.
pub fn show(id: &str, shown: bool) {
    set(&html(id), "hidden", (!shown).then_some(""));
}

/// Sets or removes an attribute on the root element for the style sheet.
pub fn mark(name: &str, on: bool) {
    set(&root(), name, on.then_some("yes"));
}

/// Whether the page has no server.
pub fn is_static() -> bool {
    root().has_attribute("data-static")
}

/// Whether the page is too narrow for panels next to the picture.
pub fn is_narrow() -> bool {
    browser::media("(max-width: 60rem)")
}

/// Gives the keyboard focus to the canvas, so that keys control the game.
pub fn focus_stage() {
    let _ = html("stage").focus();
}

/// Returns the focus to the game after a mouse click, but not after a key press on a focused button.
pub fn back_to_stage(event: &MouseEvent) {
    if event.detail() > 0 {
        focus_stage();
    }
}

/// Calls `react` for every event of this kind for as long as the page is open. The callback may prevent the default
/// action.
pub fn listen<E: JsCast>(target: &EventTarget, kind: &str, react: impl Fn(E) + 'static) {
    let closure = Closure::<dyn Fn(Event)>::new(move |event: Event| react(event.unchecked_into()));
    let options = web_sys::AddEventListenerOptions::new();
    options.set_passive(false);
    target
        .add_event_listener_with_callback_and_add_event_listener_options(
            kind,
            closure.as_ref().unchecked_ref(),
            &options,
        )
        .expect("event targets take listeners");
    closure.forget();
}

/// The first element at or above an event's target that matches a selector.
pub fn target_within(event: &Event, selector: &str) -> Option<Element> {
    let target: Element = event.target()?.dyn_into().ok()?;
    target.closest(selector).ok().flatten()
}

/// The value of the input field from which an event came.
pub fn value_of<T: std::str::FromStr>(event: &Event) -> Option<T> {
    event.target()?.dyn_into::<HtmlInputElement>().ok()?.value().parse().ok()
}

/// The number in the input field from which an event came.
pub fn number_of(event: &Event) -> Option<f64> {
    parse_decimal(&value_of::<String>(event)?)
}

/// Formats a time, given in milliseconds since 1970, in the local style.
pub fn date_and_time(unix_ms: f64) -> String {
    let date = js_sys::Date::new(&unix_ms.into());
    let options = js_sys::Object::new();
    for (name, value) in [("dateStyle", "medium"), ("timeStyle", "short")] {
        let _ = js_sys::Reflect::set(&options, &name.into(), &value.into());
    }
    String::from(date.to_locale_string("default", &options))
}

/// Copies the page's address to the clipboard and reports whether that succeeded.
pub fn copy_address(done: impl Fn(bool) + Clone + 'static) {
    match browser::window().location().href() {
        Ok(address) => copy(&address, done),
        Err(_) => done(false),
    }
}

/// Copies a text to the clipboard and reports whether that succeeded.
pub fn copy(text: &str, done: impl Fn(bool) + Clone + 'static) {
    // The clipboard object exists only in secure contexts, so not, for example, on a LAN over plain HTTP.
    let navigator = browser::window().navigator();
    if !js_sys::Reflect::get(&navigator, &"clipboard".into()).is_ok_and(|c| c.is_object()) {
        return done(copy_by_selection(text).unwrap_or(false));
    }
    let denied = done.clone();
    let copied = Closure::<dyn FnMut(JsValue)>::new(move |_| done(true));
    let refused = Closure::<dyn FnMut(JsValue)>::new(move |_| denied(false));
    let _ = navigator.clipboard().write_text(text).then2(&copied, &refused);
    // The promise will call one of the two closures later. Leaking them costs a few bytes per click.
    copied.forget();
    refused.forget();
}

/// The legacy method: selects the text in a temporary field and executes the browser's copy command.
fn copy_by_selection(text: &str) -> Option<bool> {
    let area: web_sys::HtmlTextAreaElement =
        document().create_element("textarea").ok()?.dyn_into().ok()?;
    area.set_value(text);
    root().append_child(&area).ok()?;
    area.select();
    let page = document().dyn_into::<web_sys::HtmlDocument>();
    let copied = page.is_ok_and(|page| page.exec_command("copy").unwrap_or(false));
    area.remove();
    Some(copied)
}
