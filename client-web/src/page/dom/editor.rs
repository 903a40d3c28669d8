//! The panels around the picture that is edited: bar, palette, form and text.

mod form;
mod text;

use crate::browser;
use crate::editor::palette::Make;
use crate::editor::update::Deed;
use crate::language::say;
use crate::page::app::App;
use crate::page::dom;
use crate::page::edit_screen::EditScreen;
use crate::page::event::Event;
use crate::page::page_action::PageAction;
use crate::page::queue::Events;
use form::FormView;
use text::TextView;
use wasm_bindgen::JsCast;
use web_sys::{HtmlElement, MouseEvent, PointerEvent};

/// The panels as they were shown last.
#[derive(Default)]
pub struct EditorView {
    /// `data-editor`: "edit", "play" or nothing.
    mode: Option<&'static str>,
    text: TextView,
    form: FormView,
}

impl EditorView {
    /// Has the texts shown again.
    pub fn retell(&mut self) {
        self.mode = None;
        self.form = FormView::default();
    }

    /// Shows the editor's panels, where there is an editor.
    pub fn show(&mut self, app: &App) {
        let mode = match (app.edit_screen(), app.edited()) {
            (Some(_), _) => Some("edit"),
            (None, Some(_)) => Some("play"),
            _ => None,
        };
        if self.mode != mode {
            self.mode = mode;
            dom::set(&dom::root(), "data-editor", mode);
            dom::show("editor", mode.is_some());
            let plays = mode == Some("play");
            for id in ["palette", "edit-tabs", "edit-form", "edit-code"] {
                dom::set(&dom::html(id), "inert", plays.then_some(""));
            }
            let (label, title) =
                if plays { (say("Edit"), say("Edit (E)")) } else { (say("Play"), say("Play (E)")) };
            let button = dom::html("edit-toggle");
            dom::set(&button, "title", Some(title));
            if let Ok(Some(span)) = button.query_selector("span") {
                dom::set_text(&span, label);
            }
        }
        if let Some(screen) = app.edited() {
            self.show_bar(screen, mode == Some("edit"));
        }
        if let Some(screen) = app.edit_screen() {
            self.text.show(&screen.editor);
        }
    }

    fn show_bar(&self, screen: &EditScreen, edits: bool) {
        let editor = &screen.editor;
        let [undo, redo] = editor.can();
        let chosen = !editor.selection.is_empty();
        for (id, on) in [
            ("edit-undo", undo),
            ("edit-redo", redo),
            ("edit-duplicate", chosen && editor.is_toml),
            ("edit-delete", chosen && editor.is_toml),
            ("edit-new", !editor.text().is_empty()),
        ] {
            dom::set(&dom::html(id), "disabled", (!(on && edits)).then_some(""));
        }
        let empty = editor.text().is_empty();
        dom::set(&dom::html("edit-room"), "disabled", (empty || screen.opening).then_some(""));
        let room = if screen.opening { say("Opening\u{2026}") } else { say("Open a room") };
        dom::text("edit-room", room);
        dom::text("edit-file", &editor.file);
        dom::text("edit-said", &editor.said);
    }

    /// Shows what follows from the checked text.
    pub fn show_frame(&mut self, screen: &EditScreen) {
        let editor = &screen.editor;
        let problem = editor.problem().map(ToString::to_string);
        dom::text_or_hide("edit-error", problem.as_deref());
        self.text.underline(editor);
        self.form.show(editor);
    }

    /// Brings a byte of the text into view, with the focus there.
    pub fn focus_text(&self, at: usize) {
        choose_tab("text");
        self.text.focus(at);
    }
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
    form::listen(events);
}

fn choose_tab(name: &str) {
    dom::set(&dom::html("editor"), "data-tab", Some(name));
    for tab in ["pieces", "form", "text"] {
        let chosen = if tab == name { "true" } else { "false" };
        dom::set(&dom::html(&format!("tab-{tab}")), "aria-selected", Some(chosen));
    }
}

/// A piece is dragged into the picture by the pointer that takes it; a click without a drag, or a key, puts it in
/// the middle.
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
        // From here on the picture hears of this pointer, wherever it is.
        let _ = dom::html("stage").set_pointer_capture(event.pointer_id());
        dom::focus_stage();
        events.push(Event::Edited(Deed::Taken(make, event.pointer_id())));
    });
    dom::listen(&palette, "click", move |event: MouseEvent| {
        if let Some(name) = piece(&event).filter(|_| event.detail() == 0) {
            events.push(Event::Clicked(PageAction::EditPlace, name));
        }
    });
}

/// Has the browser save a text as a file.
pub fn save(name: &str, text: &str) {
    let encoded = String::from(js_sys::encode_uri_component(text));
    save_data(name, &format!("data:application/toml;charset=utf-8,{encoded}"));
}

/// Saves bytes as a file of this name.
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
