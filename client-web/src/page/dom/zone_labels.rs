//! Labels of zones, over the canvas.

use crate::language::say;
use crate::page::dom;
use crate::page::panels::players::color_var;
use crate::view::frame::{View, ZoneLabel};
use crate::world::replica::Replica;
use jostle_sim::Vec2;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

/// A zone that is at least so high, CSS pixels, has its label inside, under the upper edge.
const ROOMY_CSS: f32 = 56.0;

/// The labels of the zones in view.
#[derive(Default)]
pub struct ZoneLabels {
    shown: Vec<(HtmlElement, String)>,
}

impl ZoneLabels {
    /// Puts a label on every zone that has one.
    pub fn update(&mut self, replica: &Replica, view: &View, css_per_pixel: f32) {
        let mut used = 0;
        for ZoneLabel { text, center, half, color } in replica.zone_labels() {
            let element = self.take(used, say(&text));
            used += 1;
            let [upper, lower] = [half.y, -half.y]
                .map(|y| view.to_pixel(center + Vec2::new(0.0, y)) * css_per_pixel);
            let is_roomy = lower.y - upper.y >= ROOMY_CSS;
            let (at, up) =
                if is_roomy { (upper.y, "4px") } else { ((upper.y + lower.y) * 0.5, "-50%") };
            let transform = format!("translate({}px, {at}px) translate(-50%, {up})", upper.x);
            dom::style(element, "transform", &transform);
            dom::style(element, "--color", &color.map_or("var(--paper-1)".to_owned(), color_var));
            dom::style(element, "opacity", "1");
        }
        for (element, _) in &self.shown[used..] {
            dom::style(element, "opacity", "0");
        }
    }

    pub fn clear(&mut self) {
        self.shown.drain(..).for_each(|(element, _)| element.remove());
    }

    fn take(&mut self, index: usize, text: &str) -> &HtmlElement {
        if index == self.shown.len() {
            let element = dom::document().create_element("div").expect("div is a tag");
            let element: HtmlElement = element.unchecked_into();
            dom::set(&element, "class", Some("tag zone"));
            // Before the names, which lie over it.
            let _ = dom::html("tags").prepend_with_node_1(&element);
            self.shown.push((element, String::new()));
        }
        let (element, shown) = &mut self.shown[index];
        if shown != text {
            dom::set_text(element, text);
            text.clone_into(shown);
        }
        element
    }
}
