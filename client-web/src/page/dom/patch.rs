//! Applies views to the document and changes only what differs from the previous view. List entries that remain keep
//! their elements, so that clicks complete and the focus stays in place.

use crate::page::app::App;
use crate::page::dom;
use crate::page::view::{Set, View};
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement, HtmlInputElement, HtmlSelectElement, HtmlTemplateElement};

/// The most recently shown panels.
#[derive(Default)]
pub struct Patch {
    shown: Vec<View>,
    /// The element that visibly had the focus before a panel took it.
    before: Option<HtmlElement>,
}

impl Patch {
    pub fn show(&mut self, view: View) {
        let known = self.shown.iter().position(|shown| shown.name == view.name);
        let index = known.unwrap_or_else(|| {
            self.shown.push(View::panel(view.name));
            self.shown.len() - 1
        });
        let shown = &mut self.shown[index];
        fill(&dom::root(), shown, &view);
        let [from, to] = [shown.focus, view.focus];
        *shown = view;
        if from != to {
            self.move_focus(from, to);
        }
    }

    pub fn show_all(&mut self, panels: &[fn(&App) -> View], app: &App) {
        panels.iter().for_each(|panel| self.show(panel(app)));
    }

    /// Discards all state and removes the entries of all lists, because the document has changed.
    pub fn forget(&mut self) {
        for view in &mut self.shown {
            for (at, set) in view.parts.drain(..) {
                if let Set::List(_) = set {
                    found(&dom::root(), at).set_text_content(None);
                }
            }
        }
    }

    fn move_focus(&mut self, from: Option<&str>, to: Option<&str>) {
        if from.is_none() {
            // After a click, a ring around the button would stay when the dialog is gone.
            self.before =
                focused().filter(|element| element.matches(":focus-visible").unwrap_or(false));
        }
        let element = match to {
            Some(at) => dom::query(at),
            None => self.before.take(),
        };
        if let Some(element) = element {
            let _ = element.focus();
        }
        rescue_focus();
    }
}

/// Gives the focus to the canvas if no visible element has it.
pub fn rescue_focus() {
    let lost = focused().is_none_or(|element| {
        let gone = element.closest("[hidden], [inert]").ok().flatten();
        gone.is_some() || element.tag_name() == "BODY"
    });
    if lost {
        dom::focus_stage();
    }
}

fn focused() -> Option<HtmlElement> {
    dom::document().active_element()?.dyn_into().ok()
}

fn found(root: &Element, at: &str) -> Element {
    let element = match at {
        "" => Some(root.clone()),
        at => root.query_selector(at).ok().flatten(),
    };
    element.unwrap_or_else(|| panic!("nothing is {at}"))
}

fn fill(root: &Element, before: &View, view: &View) {
    for (index, (at, set)) in view.parts.iter().enumerate() {
        let shown = before.parts.get(index).filter(|part| part.0 == *at).map(|part| &part.1);
        // Values that the user can change are compared with the element.
        let is_field = matches!(set, Set::Value(_) | Set::Checked(_) | Set::Choice(_));
        if is_field || shown != Some(set) {
            apply(&found(root, at), shown, set);
        }
    }
}

fn apply(element: &Element, shown: Option<&Set>, set: &Set) {
    match set {
        Set::Text(text) => dom::set_text(element, text),
        Set::Attribute(name, value) => {
            let hides = *name == "hidden" && value.is_some();
            let has_focus = hides && focused().is_some_and(|e| element.contains(Some(&e)));
            dom::set(element, name, value.as_deref());
            if has_focus {
                dom::focus_stage();
            }
        }
        Set::Style(name, value) => dom::style(element, name, value),
        Set::Value(value) => set_value(element, value),
        Set::Typed(value) => {
            if focused().as_deref() != Some(element) {
                set_value(element, value);
            }
        }
        Set::Checked(on) => element.unchecked_ref::<HtmlInputElement>().set_checked(*on),
        Set::Choice(value) => {
            let radio = element.query_selector(&format!("input[value='{value}']"));
            if let Ok(Some(radio)) = radio {
                radio.unchecked_ref::<HtmlInputElement>().set_checked(true);
            }
        }
        Set::Moment(unix_ms) => dom::set_text(element, &dom::date_and_time(*unix_ms)),
        Set::List(items) => fill_list(element, shown, items),
    }
}

/// Sets a field's value if it differs, since setting the same value again would move the cursor.
fn set_value(element: &Element, value: &str) {
    if let Some(select) = element.dyn_ref::<HtmlSelectElement>() {
        select.set_value(value);
    } else {
        let input: &HtmlInputElement = element.unchecked_ref();
        if input.value() != value {
            input.set_value(value);
        }
    }
}

fn fill_list(list: &Element, shown: Option<&Set>, items: &[View]) {
    let focused = focused();
    let places = list.children();
    let mut before: Vec<(&View, Element)> = match shown {
        Some(Set::List(shown)) => {
            (0..).zip(shown).filter_map(|(at, view)| Some((view, places.item(at)?))).collect()
        }
        _ => {
            list.set_text_content(None);
            Vec::new()
        }
    };
    let mut entries = Vec::new();
    for item in items {
        let is_it = |(view, _): &(&View, _)| view.name == item.name && view.key == item.key;
        let known = before.iter().position(is_it).map(|at| before.remove(at));
        let (view, element) = match &known {
            Some((view, element)) => (*view, element.clone()),
            None => (&View::panel(item.name), instance(item.name)),
        };
        fill(&element, view, item);
        entries.push(element);
    }
    before.iter().for_each(|(_, element)| element.remove());
    for (place, element) in (0..).zip(&entries) {
        let there = places.item(place);
        if there.as_ref() != Some(element) {
            let _ = list.insert_before(element, there.as_ref().map(AsRef::as_ref));
        }
    }
    // Moving an element removes its focus.
    if focused != self::focused()
        && let Some(element) = focused
    {
        let _ = element.focus();
    }
}

fn instance(template: &str) -> Element {
    let template: HtmlTemplateElement = dom::by_id(template);
    let element = template.content().first_element_child().expect("templates hold an element");
    element.clone_node_with_deep(true).expect("elements can be copied").unchecked_into()
}
