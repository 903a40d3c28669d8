//! Fingers: a stick that appears under the left thumb, and a button for each tool under the right
//! one. Tools that need a place are armed by their button and used where the world is touched.

use crate::browser;
use crate::input::stick;
use crate::page::app::App;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use crate::page::tools::{self, Cap};
use jostle_game::{Buttons, Scene};
use jostle_sim::Vec2;
use web_sys::{HtmlElement, MouseEvent, PointerEvent};

/// A button that is clicked without a pointer (by a key, by a screen reader) is down for this long,
/// milliseconds: some ticks.
const CLICK_MS: i32 = 120;

/// Stick and tool buttons as they were shown last.
pub struct Touchpad {
    events: Events,
    scene: Option<String>,
    armed: Buttons,
    stick: Option<(Vec2, Vec2)>,
}

impl Touchpad {
    /// No buttons yet.
    pub fn new(events: Events) -> Touchpad {
        Touchpad { events, scene: None, armed: Buttons::default(), stick: None }
    }

    /// Shows stick and buttons.
    pub fn show(&mut self, app: &App) {
        if let Some(replica) = app.game().and_then(|game| game.replica())
            && self.scene.as_ref() != Some(&replica.scene.source)
        {
            self.scene = Some(replica.scene.source.clone());
            self.make_buttons(&replica.scene, app.fingers.armed);
        }
        if self.armed != app.fingers.armed {
            show_armed(app.fingers.armed);
            self.armed = app.fingers.armed;
        }
        let stick = app.fingers.stick();
        if self.stick != stick {
            if self.stick.map(|(from, _)| from) != stick.map(|(from, _)| from) {
                place_stick(stick.map(|(from, _)| from));
            }
            place_knob(stick.map_or(Vec2::ZERO, |(_, offset)| stick::knob(offset)));
            self.stick = stick;
        }
    }

    /// Makes the buttons of a scene.
    fn make_buttons(&self, scene: &Scene, armed: Buttons) {
        dom::show(&dom::by_id("stick"), tools::fingers(scene).steers);
        let tools = tools::touch_tools(scene);
        let parent: HtmlElement = dom::by_id("tools");
        parent.set_text_content(None);
        // A lone aimed tool needs no button: touching the world is it.
        let lone = tools.iter().filter(|cap| cap.aimed).count() == 1;
        for cap in tools.iter().filter(|cap| !(lone && cap.aimed)) {
            dom::append(&parent, &tool_button(self.events, cap));
        }
        show_armed(armed);
    }
}

fn show_armed(armed: Buttons) {
    let buttons = dom::by_id::<HtmlElement>("tools").children();
    for index in 0..buttons.length() {
        let Some(button) = buttons.item(index) else { continue };
        if let Some(bits) = button.get_attribute("data-arm") {
            dom::set(&button, "aria-pressed", &(bits == armed.0.to_string()).to_string());
        }
    }
}

fn tool_button(events: Events, cap: &Cap) -> HtmlElement {
    let button = dom::labelled("button", "", cap.does);
    let buttons = cap.buttons;
    if cap.aimed {
        dom::set(&button, "data-arm", &buttons.0.to_string());
        let arm = move || events.push(Event::ToolArmed(buttons));
        dom::listen(&button, "pointerdown", move |_: PointerEvent| arm());
        dom::listen(&button, "click", move |_: MouseEvent| arm());
        return button;
    }
    for (kind, down) in [
        ("pointerdown", true),
        ("pointerup", false),
        ("pointercancel", false),
        ("pointerleave", false),
    ] {
        let own = button.clone();
        dom::listen(&button, kind, move |_: PointerEvent| {
            let _ = own.class_list().toggle_with_force("down", down);
            events.push(Event::ToolPressed(buttons, down));
        });
    }
    dom::listen(&button, "click", move |event: MouseEvent| {
        if event.detail() == 0 {
            events.push(Event::ToolPressed(buttons, true));
            browser::after(CLICK_MS, move || events.push(Event::ToolPressed(buttons, false)));
        }
    });
    button
}

/// Moves the stick under the thumb, or back to its place.
fn place_stick(at: Option<Vec2>) {
    let stick: HtmlElement = dom::by_id("stick");
    let _ = stick.class_list().toggle_with_force("held", at.is_some());
    let (left, top, bottom) = match at {
        Some(at) => (format!("{}px", at.x), format!("{}px", at.y - stick::RADIUS_PX), "auto"),
        None => (String::new(), String::new(), ""),
    };
    dom::style(&stick, "left", &left);
    dom::style(&stick, "top", &top);
    dom::style(&stick, "bottom", bottom);
}

fn place_knob(offset: Vec2) {
    let knob: HtmlElement = dom::by_id("knob");
    dom::style(&knob, "transform", &format!("translate({}px, {}px)", offset.x, offset.y));
}
