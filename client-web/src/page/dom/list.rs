//! Lists whose entries are made from templates of `index.html`. An entry that stays keeps its element,
//! and only what differs in it is touched: a click takes its time, and the focus stays where it was.

use crate::page::dom;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement, HtmlTemplateElement};

/// An entry of a list: the id of its template, a key of its own, and its parts.
#[derive(PartialEq)]
pub struct Item {
    template: &'static str,
    key: String,
    parts: Vec<Part>,
}

/// A selector within the entry (none for the entry itself), what to set there, and to what.
type Part = (&'static str, &'static str, Option<String>);

impl Item {
    /// An entry as its template has it.
    pub fn new(template: &'static str, key: impl ToString) -> Item {
        Item { template, key: key.to_string(), parts: Vec::new() }
    }

    /// With a style property, if `what` begins with two dashes, else with an attribute.
    pub fn with(
        mut self,
        selector: &'static str,
        what: &'static str,
        value: impl Into<Option<String>>,
    ) -> Item {
        self.parts.push((selector, what, value.into()));
        self
    }

    pub fn text(self, selector: &'static str, text: impl Into<String>) -> Item {
        self.with(selector, "", text.into())
    }

    fn is_entry_of(&self, other: &Item) -> bool {
        self.template == other.template && self.key == other.key
    }

    fn instance(&self) -> Element {
        let template: HtmlTemplateElement = dom::by_id(self.template);
        let element = template.content().first_element_child().expect("templates hold an element");
        element.clone_node_with_deep(true).expect("elements can be copied").unchecked_into()
    }

    /// Sets the parts that are not as in the entry that was shown `before`.
    fn fill(&self, element: &Element, before: &[Part]) {
        for part in self.parts.iter().filter(|part| !before.contains(part)) {
            let (selector, what, value) = part;
            let found = match *selector {
                "" => Some(element.clone()),
                selector => element.query_selector(selector).ok().flatten(),
            };
            let found = found.unwrap_or_else(|| panic!("#{} lacks {selector}", self.template));
            let text = value.as_deref().unwrap_or_default();
            match *what {
                "" => dom::set_text(&found, text),
                property if property.starts_with("--") => dom::style(&found, property, text),
                name => dom::set(&found, name, value.as_deref()),
            }
        }
    }
}

/// The list with an id, as it was shown last.
pub struct List {
    id: &'static str,
    shown: Vec<(Item, Element)>,
}

impl List {
    pub fn new(id: &'static str) -> List {
        List { id, shown: Vec::new() }
    }

    /// Shows these entries, in this order.
    pub fn show(&mut self, items: impl IntoIterator<Item = Item>) {
        let focused = dom::document().active_element();
        let mut before = std::mem::take(&mut self.shown);
        for item in items {
            let known = before.iter().position(|(known, _)| known.is_entry_of(&item));
            let element = match known.map(|at| before.remove(at)) {
                Some((known, element)) => {
                    item.fill(&element, &known.parts);
                    element
                }
                None => {
                    let element = item.instance();
                    item.fill(&element, &[]);
                    element
                }
            };
            self.shown.push((item, element));
        }
        before.iter().for_each(|(_, element)| element.remove());
        let list = dom::html(self.id);
        let places = list.children();
        for (place, (_, element)) in (0..).zip(&self.shown) {
            let there = places.item(place);
            if there.as_ref() != Some(element) {
                let _ = list.insert_before(element, there.as_ref().map(AsRef::as_ref));
            }
        }
        // An entry that moves loses it.
        if focused != dom::document().active_element()
            && let Some(focused) =
                focused.and_then(|element| element.dyn_into::<HtmlElement>().ok())
        {
            let _ = focused.focus();
        }
    }
}
