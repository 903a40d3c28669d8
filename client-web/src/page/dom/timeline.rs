//! Handles the pointer over a replay's timeline, and the choice of speeds.

use crate::page::dom;
use crate::page::event::Event;
use crate::page::panels::replay::tick_in_words;
use crate::page::queue::Events;
use crate::page::strings;
use jostle_game::scene::parse_decimal;
use web_sys::{Element, PointerEvent};

/// Adds listeners to the speed controls and the timeline.
pub fn listen(events: Events) {
    dom::listen(&dom::html("speeds"), "change", move |event: web_sys::Event| {
        if let Some(speed) = dom::number_of(&event) {
            events.push(Event::SpeedChosen(speed));
        }
    });
    let slider = dom::html("seek");
    dom::listen(&slider, "input", move |event: web_sys::Event| {
        if let Some(tick) = dom::value_of(&event) {
            events.push(Event::SeekChosen(tick));
            show_bubble(Some(tick));
        }
    });
    dom::listen(&slider, "pointermove", |event: PointerEvent| {
        let slider = dom::html("seek");
        let [first, last] = limits();
        // The centre of the thumb moves between these ends.
        let (thumb, width) = (f64::from(slider.client_height()), f64::from(slider.client_width()));
        let share = (f64::from(event.offset_x()) - thumb / 2.0) / (width - thumb).max(1.0);
        show_bubble(Some((first + share.clamp(0.0, 1.0) * (last - first)).round() as u32));
    });
    for kind in ["pointerleave", "pointercancel", "blur"] {
        dom::listen(&slider, kind, |_: web_sys::Event| show_bubble(None));
    }
}

/// The first and last tick of the timeline.
fn limits() -> [f64; 2] {
    let slider: Element = dom::by_id("seek");
    let limit = |name| parse_decimal(&slider.get_attribute(name)?);
    ["min", "max"].map(|name| limit(name).unwrap_or(0.0))
}

/// Shows the time and tick under the pointer on the timeline.
fn show_bubble(tick: Option<u32>) {
    dom::show("bubble", tick.is_some());
    let Some(tick) = tick else { return };
    let [first, last] = limits();
    let since = f64::from(tick) - first;
    dom::text(
        "bubble",
        &format!("{} \u{b7} {}", strings::clock(since.max(0.0), true), tick_in_words(tick)),
    );
    let share = since / (last - first).max(1.0);
    dom::style(&dom::html("bubble"), "--at", &format!("{share:.4}"));
}
