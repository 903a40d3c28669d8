//! The form: a control for each field whose range the reader of scenes knows.

use crate::editor::form::{Row, rows};
use crate::editor::state::Editor;
use crate::language::{self, say};
use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use jostle_game::scene::FieldForm;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlInputElement, HtmlSelectElement};

/// The form as it was shown last.
#[derive(Default)]
pub struct FormView {
    shown: Option<(u32, String)>,
    rows: Vec<Row>,
}

impl FormView {
    /// Shows the fields of the selected piece, or those of the scene.
    pub fn show(&mut self, editor: &Editor) {
        // While something is dragged its numbers change all the time.
        if editor.is_held()
            || dom::html("editor").get_attribute("data-tab").as_deref() == Some("text")
        {
            return;
        }
        let title = editor.form_title();
        let shown = (editor.revision, title.clone());
        if self.shown.as_ref() == Some(&shown) {
            return;
        }
        dom::text("form-title", &title);
        dom::text("form-note", say(editor.form_note()));
        dom::text_or_hide("edit-path", editor.path_offer().map(say));
        let rows = rows(editor);
        let alike = |(one, other): (&Row, &Row)| one.path == other.path && one.form == other.form;
        if self.rows.len() != rows.len() || !self.rows.iter().zip(&rows).all(alike) {
            build(&rows);
        }
        rows.iter().for_each(fill);
        self.rows = rows;
        self.shown = Some(shown);
    }
}

fn build(rows: &[Row]) {
    let list = dom::html("form-fields");
    list.set_text_content(None);
    for row in rows {
        let line = create("label");
        let name = create("span");
        name.set_text_content(Some(&row.name));
        let _ = line.append_child(&name);
        let holder = create("span");
        let count = if let FieldForm::Vector { .. } = row.form { 2 } else { 1 };
        for _ in 0..count {
            let _ = holder.append_child(&control(row));
        }
        if count == 2 {
            dom::set(&holder, "class", Some("two"));
        }
        let _ = line.append_child(&holder);
        dom::set(&line, "data-path", Some(&row.path));
        let _ = list.append_child(&line);
    }
}

fn create(tag: &str) -> Element {
    dom::document().create_element(tag).expect("all of them are tags")
}

fn control(row: &Row) -> Element {
    let input = create(if let FieldForm::Choice { .. } = row.form { "select" } else { "input" });
    let set = |name, value: &str| dom::set(&input, name, Some(value));
    let ends = |ends: [String; 2]| {
        set("type", "number");
        set("min", &ends[0]);
        set("max", &ends[1]);
        set("title", &language::fill("{low} to {high}", &[("low", &ends[0]), ("high", &ends[1])]));
    };
    match &row.form {
        FieldForm::Number { range, .. } | FieldForm::Vector { range, .. } => {
            ends(range.map(|end| end.to_string()));
            set("step", "any");
        }
        FieldForm::Whole { range, .. } => ends(range.map(|end| end.to_string())),
        FieldForm::Truth { .. } => set("type", "checkbox"),
        FieldForm::Text { chars_max } => {
            set("type", "text");
            set("maxlength", &chars_max.to_string());
        }
        FieldForm::Choice { names } => {
            for name in std::iter::once("").chain(names.iter().map(String::as_str)) {
                let option = create("option");
                dom::set(&option, "value", Some(name));
                option.set_text_content(Some(if name.is_empty() { say("default") } else { name }));
                let _ = input.append_child(&option);
            }
        }
    }
    dom::set(&input, "aria-label", Some(&row.name));
    input
}

fn line_of(path: &str) -> Option<Element> {
    dom::query(&format!("#form-fields [data-path='{path}']"))
}

fn controls(line: &Element) -> Vec<Element> {
    let found = line.query_selector_all("input, select").expect("a valid selector");
    (0..found.length()).filter_map(|at| found.item(at)?.dyn_into().ok()).collect()
}

fn fill(row: &Row) {
    let Some(line) = line_of(&row.path) else { return };
    dom::set(&line, "class", Some(if row.values.is_some() { "field given" } else { "field" }));
    let focused = dom::document().active_element();
    for (at, control) in controls(&line).into_iter().enumerate() {
        if focused.as_ref() == Some(&control) {
            continue;
        }
        let value = row.values.as_ref().and_then(|values| values.get(at)).map(String::as_str);
        if let Some(select) = control.dyn_ref::<HtmlSelectElement>() {
            select.set_value(value.unwrap_or_default());
        } else if let Some(input) = control.dyn_ref::<HtmlInputElement>() {
            if let FieldForm::Truth { default } = row.form {
                input.set_checked(value.map_or(default, |value| value == "true"));
            } else {
                input.set_value(value.unwrap_or_default());
                dom::set(input, "placeholder", row.default.get(at).map(String::as_str));
            }
        }
    }
}

pub fn listen(events: Events) {
    dom::listen(&dom::html("form-fields"), "change", move |event: web_sys::Event| {
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
