//! Short forms of the DOM calls that the page makes all the time. Ids are those of `index.html`;
//! a missing one is a bug and ends in a panic that names it.

pub mod dialogs;
mod files;
mod help;
mod hud;
pub mod listeners;
mod lobby;
mod network_panel;
mod players;
mod replay_controls;
pub mod stage;
mod tags;
mod touchpad;
pub mod views;

use crate::browser;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Document, Element, Event, EventTarget, HtmlElement, MouseEvent};

/// The document.
pub fn document() -> Document {
    browser::window().document().expect("a page has a document")
}

/// The root element, whose data attributes say what state the page is in.
pub fn root() -> HtmlElement {
    document()
        .document_element()
        .and_then(|element| element.dyn_into().ok())
        .expect("a document has a root")
}

/// The element with an id.
pub fn by_id<T: JsCast>(id: &str) -> T {
    let element = document().get_element_by_id(id);
    let element = element.unwrap_or_else(|| panic!("index.html lacks #{id}"));
    element.dyn_into().unwrap_or_else(|_| panic!("#{id} is of another kind"))
}

/// A new element with classes.
pub fn element(tag: &str, class: &str) -> HtmlElement {
    let element = document().create_element(tag).expect("tags are valid names");
    element.set_class_name(class);
    element.dyn_into().expect("only HTML elements are made here")
}

/// A new element with classes and text.
pub fn labelled(tag: &str, class: &str, text: &str) -> HtmlElement {
    let element = element(tag, class);
    element.set_text_content(Some(text));
    element
}

/// Puts an element at the end of another.
pub fn append(parent: &Element, child: &Element) {
    parent.append_child(child).expect("a fresh element fits anywhere");
}

/// Sets an attribute.
pub fn set(element: &Element, name: &str, value: &str) {
    element.set_attribute(name, value).expect("attribute names are valid");
}

/// Sets a style property.
pub fn style(element: &HtmlElement, name: &str, value: &str) {
    element.style().set_property(name, value).expect("a live element takes styles");
}

/// Sets text if it differs: text that stays is not laid out again.
pub fn set_text(element: &Element, text: &str) {
    if element.text_content().as_deref() != Some(text) {
        element.set_text_content(Some(text));
    }
}

/// Adds or removes a mark on the root element, for the styles.
pub fn mark(name: &str, on: bool) {
    let data = root().dataset();
    if on {
        let _ = data.set(name, "yes");
    } else if data.get(name).is_some() {
        data.delete(name);
    }
}

/// Whether the page is played with fingers.
pub fn is_touched() -> bool {
    root().dataset().get("touch").is_some()
}

/// After a click (not after a key on a focused button) keys belong to the game again.
pub fn back_to_stage(event: &MouseEvent) {
    if event.detail() > 0 {
        let _ = by_id::<HtmlElement>("stage").focus();
    }
}

/// Shows or hides an element.
pub fn show(element: &HtmlElement, shown: bool) {
    if element.hidden() == shown {
        element.set_hidden(!shown);
    }
}

/// Calls `react` for every event of a kind, for as long as the page lives.
pub fn listen<E: JsCast>(target: &EventTarget, kind: &str, react: impl Fn(E) + 'static) {
    let closure = Closure::<dyn Fn(Event)>::new(move |event: Event| react(event.unchecked_into()));
    target
        .add_event_listener_with_callback(kind, closure.as_ref().unchecked_ref())
        .expect("event targets take listeners");
    closure.forget();
}

/// Like [`listen`], for events whose default is to be prevented.
pub fn listen_active<E: JsCast>(target: &EventTarget, kind: &str, react: impl Fn(E) + 'static) {
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
pub fn target_within(event: &Event, selector: &str) -> Option<HtmlElement> {
    let target: Element = event.target()?.dyn_into().ok()?;
    target.closest(selector).ok().flatten()?.dyn_into().ok()
}

/// A time in milliseconds since 1970 as people here write it.
pub fn date_and_time(unix_ms: f64) -> String {
    let date = js_sys::Date::new(&unix_ms.into());
    let options = js_sys::Object::new();
    for (name, value) in [("dateStyle", "medium"), ("timeStyle", "short")] {
        let _ = js_sys::Reflect::set(&options, &name.into(), &value.into());
    }
    String::from(date.to_locale_string("default", &options))
}

/// Puts the page's address into the clipboard and says whether the browser let it.
pub fn copy_address(done: impl Fn(bool) + Clone + 'static) {
    let Ok(address) = browser::window().location().href() else { return done(false) };
    // Outside of a secure context (a plain http address in a LAN) there is no clipboard object.
    let navigator = browser::window().navigator();
    if !js_sys::Reflect::get(&navigator, &"clipboard".into()).is_ok_and(|c| c.is_object()) {
        return done(copy_by_selection(&address));
    }
    let denied = done.clone();
    let copied = Closure::<dyn FnMut(JsValue)>::new(move |_| done(true));
    let refused = Closure::<dyn FnMut(JsValue)>::new(move |_| denied(false));
    let _ = navigator.clipboard().write_text(&address).then2(&copied, &refused);
    // The promise decides which of them is called and when: a few bytes a click.
    copied.forget();
    refused.forget();
}

/// The old way: a field whose text is selected, and the command of the edit menu.
fn copy_by_selection(address: &str) -> bool {
    let field = element("textarea", "");
    let Some(area) = field.dyn_ref::<web_sys::HtmlTextAreaElement>() else { return false };
    area.set_value(address);
    append(&root(), &field);
    area.select();
    let page = document().dyn_into::<web_sys::HtmlDocument>();
    let copied = page.is_ok_and(|page| page.exec_command("copy").unwrap_or(false));
    field.remove();
    copied
}
