//! The form: what its controls say.

use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlInputElement, HtmlSelectElement};

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

fn controls(line: &Element) -> Vec<Element> {
    let found = line.query_selector_all("input, select").expect("a valid selector");
    (0..found.length()).filter_map(|at| found.item(at)?.dyn_into().ok()).collect()
}
