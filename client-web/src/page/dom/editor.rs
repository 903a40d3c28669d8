//! The panels around the picture being edited: bar, palette, form and text.

mod text;

use crate::browser;
use crate::editor::field_words;
use crate::editor::form;
use crate::editor::palette::Make;
use crate::editor::state::Editor;
use crate::editor::update::EditorEvent;
use crate::page::dom;
use crate::page::dom::patch::Patch;
use crate::page::event::Event;
use crate::page::page_action::PageAction;
use crate::page::panels;
use crate::page::queue::Events;
use text::TextView;
use wasm_bindgen::JsCast;
use web_sys::{
    Element, HtmlElement, HtmlInputElement, HtmlSelectElement, MouseEvent, PointerEvent,
};

/// The most recently shown text and form.
#[derive(Default)]
pub struct EditorView {
    pub text: TextView,
    /// The version of the text and the title for which the form was last shown, and whether its words were known.
    form: Option<((u32, u32), String, bool)>,
}

impl EditorView {
    /// Marks the form as outdated, so that the next update shows it again.
    pub fn retell(&mut self) {
        self.form = None;
    }

    /// Updates everything that depends on the checked text.
    pub fn show_frame(&mut self, editor: &Editor, patch: &mut Patch) {
        self.text.underline(editor);
        let shown = Some((editor.version(), form::title(editor), field_words::are_known()));
        // During a drag the numbers change constantly, so the form is updated only when it ends.
        if self.form != shown && !editor.is_held() && !is_tab("text") {
            self.form = shown;
            patch.show(panels::editor::form(editor));
        }
    }

    /// Moves the focus to this byte of the text and scrolls it into view.
    pub fn focus_text(&self, at: usize) {
        choose_tab("text");
        self.text.focus(at);
    }
}

fn is_tab(name: &str) -> bool {
    dom::html("editor").get_attribute("data-tab").as_deref() == Some(name)
}

pub fn listen(events: Events) {
    choose_tab(if dom::is_narrow() { "pieces" } else { "form" });
    dom::listen(&dom::html("edit-tabs"), "click", |event: MouseEvent| {
        let tab = dom::target_within(&event, "[data-tab]");
        if let Some(name) = tab.and_then(|tab| tab.get_attribute("data-tab")) {
            choose_tab(&name);
        }
    });
    palette(events);
    text::listen(events);
    form_fields(events);
}

fn choose_tab(name: &str) {
    dom::set(&dom::html("editor"), "data-tab", Some(name));
    for tab in ["pieces", "form", "text"] {
        let chosen = if tab == name { "true" } else { "false" };
        dom::set(&dom::html(&format!("tab-{tab}")), "aria-selected", Some(chosen));
    }
}

/// Lets the player drag pieces from the palette into the picture. A click without a drag, or a key, places a piece in
/// the centre.
fn palette(events: Events) {
    let palette = dom::html("palette");
    let piece = |event: &web_sys::Event| {
        dom::target_within(event, "[data-piece]")?.get_attribute("data-piece")
    };
    dom::listen(&palette, "pointerdown", move |event: PointerEvent| {
        let Some(make) = piece(&event).and_then(|name| Make::named(&name)) else { return };
        if event.button() != 0 {
            return;
        }
        event.prevent_default();
        // From here on, the canvas receives this pointer's events, wherever the pointer is.
        let _ = dom::html("stage").set_pointer_capture(event.pointer_id());
        dom::focus_stage();
        events.push(Event::Edited(EditorEvent::Taken(make, event.pointer_id())));
    });
    dom::listen(&palette, "click", move |event: MouseEvent| {
        if let Some(name) = piece(&event).filter(|_| event.detail() == 0) {
            events.push(Event::Clicked(PageAction::EditPlace, name));
        }
    });
}

/// Listens to the form's controls.
fn form_fields(events: Events) {
    dom::listen(&dom::html("edit-form"), "change", move |event: web_sys::Event| {
        let Some(line) = dom::target_within(&event, "[data-path]") else { return };
        let Some(path) = line.get_attribute("data-path") else { return };
        let values = controls(&line).into_iter().map(|control| {
            if let Some(select) = control.dyn_ref::<HtmlSelectElement>() {
                return select.value();
            }
            let input: HtmlInputElement = control.unchecked_into();
            if input.type_() == "checkbox" { input.checked().to_string() } else { input.value() }
        });
        let values = values.collect();
        events.push(Event::FieldChanged(path, values));
    });
}

fn controls(line: &Element) -> Vec<Element> {
    let found = line.query_selector_all("input, select").expect("a valid selector");
    (0..found.length()).filter_map(|at| found.item(at)?.dyn_into().ok()).collect()
}

/// The addresses of the documentation of fields and of the form's words, as given in the document.
pub fn word_files() -> [String; 2] {
    let form = dom::html("edit-form");
    ["data-docs", "data-words"].map(|name| form.get_attribute(name).unwrap_or_default())
}

/// Makes the browser save a text as a file.
pub fn save(name: &str, text: &str) {
    let encoded = String::from(js_sys::encode_uri_component(text));
    save_data(name, &format!("data:application/toml;charset=utf-8,{encoded}"));
}

/// Saves bytes as a file with this name.
pub fn save_bytes(name: &str, bytes: &[u8]) {
    let letters: String = bytes.iter().copied().map(char::from).collect();
    let coded = browser::window().btoa(&letters).unwrap_or_default();
    save_data(name, &format!("data:application/octet-stream;base64,{coded}"));
}

fn save_data(name: &str, data: &str) {
    let link = dom::document().create_element("a").expect("a is a tag");
    dom::set(&link, "href", Some(data));
    dom::set(&link, "download", Some(name));
    link.unchecked_into::<HtmlElement>().click();
}
