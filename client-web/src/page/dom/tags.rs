//! Name tags over heroes.

use crate::page::dom;
use crate::page::panels::players::color_of;
use crate::view::frame::View;
use crate::world::replica::Replica;
use jostle_protocol::{Appearance, PlayerState};
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

/// Name tags over heroes.
#[derive(Default)]
pub struct Tags {
    tags: Vec<Tag>,
}

struct Tag {
    element: HtmlElement,
    appearance: Option<Appearance>,
    own: bool,
    size: [f32; 2],
}

impl Tags {
    /// Places a tag over every visible hero. If two would overlap, only the player's own tag or the first in seat order
    /// is shown.
    pub fn update(&mut self, replica: &Replica, view: &View, css_per_pixel: f32) {
        let mut placed: Vec<[f32; 4]> = Vec::new();
        let mut used = 0;
        // The player's own tag is placed first.
        let own = |player: &&PlayerState| player.seat == replica.room.seat;
        let players = replica.room.players();
        let others = players.iter().filter(|player| !own(player));
        for player in players.iter().filter(own).chain(others) {
            let Some(above) = replica.top_of_hero(player) else { continue };
            let shown =
                Appearance { color: replica.room.color_of(player), ..player.appearance.clone() };
            let tag = self.take(used, &shown, own(&player));
            used += 1;
            let at = view.to_pixel(above) * css_per_pixel;
            let [width, height] = tag.size;
            let wide = view.pixels[0] as f32 * css_per_pixel;
            let beside = (at.x - width * 0.5).round();
            // At the edge, the name stays in the picture as long as the middle of the hero does.
            let left = match (0.0..wide).contains(&at.x) {
                true => beside.clamp(0.0, (wide - width).max(0.0)),
                false => beside,
            };
            let top = (at.y - height - 6.0).round();
            let rect = [left, top, left + width, top + height];
            let free = !placed.iter().any(|other| overlap(&rect, other));
            let seen = free && in_view(&rect, view, css_per_pixel);
            if seen {
                placed.push(rect);
                let transform = format!("translate({left}px, {top}px)");
                dom::style(&tag.element, "transform", &transform);
            }
            dom::style(&tag.element, "opacity", if seen { "1" } else { "0" });
        }
        for tag in &mut self.tags[used..] {
            dom::style(&tag.element, "opacity", "0");
        }
    }

    pub fn clear(&mut self) {
        for tag in self.tags.drain(..) {
            tag.element.remove();
        }
    }

    fn take(&mut self, index: usize, appearance: &Appearance, own: bool) -> &mut Tag {
        if index == self.tags.len() {
            let element = dom::document().create_element("div").expect("div is a tag");
            let element: HtmlElement = element.unchecked_into();
            dom::set(&element, "class", Some("tag"));
            dom::set(&element, "dir", Some("auto"));
            let _ = dom::html("tags").append_child(&element);
            self.tags.push(Tag { element, appearance: None, own: false, size: [0.0; 2] });
        }
        let tag = &mut self.tags[index];
        if tag.appearance.as_ref() != Some(appearance) || tag.own != own {
            let _ = tag.element.class_list().toggle_with_force("own", own);
            tag.own = own;
            dom::set_text(&tag.element, &appearance.name);
            dom::style(&tag.element, "--color", &color_of(appearance));
            let size = [tag.element.offset_width(), tag.element.offset_height()];
            tag.size = size.map(|pixels| pixels as f32);
            tag.appearance = Some(appearance.clone());
        }
        tag
    }
}

fn overlap(a: &[f32; 4], b: &[f32; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn in_view(rect: &[f32; 4], view: &View, css_per_pixel: f32) -> bool {
    let width = view.pixels[0] as f32 * css_per_pixel;
    let height = view.pixels[1] as f32 * css_per_pixel;
    rect[0] < width && rect[2] > 0.0 && rect[1] > -4.0 && rect[3] < height
}
