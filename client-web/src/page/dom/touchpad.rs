//! Touch buttons for tools. A button arms a tool that needs a position; touching the world then uses the tool there.

use crate::browser;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use jostle_game::Buttons;
use web_sys::{Element, MouseEvent, PointerEvent};

/// How long a press lasts if a button is clicked without a pointer (by a key or a screen reader), milliseconds. It
/// spans several ticks.
const CLICK_MS: i32 = 120;

/// Adds listeners to the tool buttons. Those with `data-arms` arm a tool; the others act like keys.
pub fn listen(events: Events) {
    let tool = |event: &web_sys::Event| -> Option<(Element, Buttons)> {
        let button = dom::target_within(event, "[data-buttons]")?;
        let buttons = button.get_attribute("data-buttons")?.parse().ok()?;
        Some((button, Buttons(buttons)))
    };
    let tools = dom::html("tools");
    for kind in ["pointerdown", "pointerup", "pointercancel", "pointerout"] {
        dom::listen(&tools, kind, move |event: PointerEvent| {
            let Some((button, buttons)) = tool(&event) else { return };
            let down = kind == "pointerdown";
            if !button.has_attribute("data-arms") {
                let _ = button.class_list().toggle_with_force("down", down);
                events.push(Event::ToolPressed(buttons, down));
            } else if down {
                events.push(Event::ToolArmed(buttons));
            }
        });
    }
    dom::listen(&tools, "click", move |event: MouseEvent| {
        let Some((button, buttons)) = tool(&event) else { return };
        if button.has_attribute("data-arms") {
            events.push(Event::ToolArmed(buttons));
        } else if event.detail() == 0 {
            events.push(Event::ToolPressed(buttons, true));
            browser::after(CLICK_MS, move || events.push(Event::ToolPressed(buttons, false)));
        }
    });
}
