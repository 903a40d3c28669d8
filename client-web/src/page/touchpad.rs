//! Thumbs: a stick that appears under the left one, and a button for each tool under the right
//! one. Tools that need a place are armed by their button and used where the world is touched.

use super::app;
use super::dom;
use crate::fingers::{Fingers, Touched};
use crate::stick;
use crate::words::{self, Cap};
use jostle_sim::{Buttons, Scene, Tools, Vec2};
use web_sys::{HtmlElement, MouseEvent, PointerEvent};

/// A button that is clicked without a pointer (by a key, by a screen reader) is down for so long,
/// milliseconds: some ticks.
const CLICK_MS: i32 = 120;

/// Thumbs on the glass.
#[derive(Default)]
pub struct Touchpad {
    fingers: Fingers,
    scene: Option<String>,
}

impl Touchpad {
    /// Makes the buttons of a scene.
    pub fn adopt_scene(&mut self, scene: &Scene) {
        if self.scene.as_ref() == Some(&scene.source) {
            return;
        }
        *self = Touchpad { scene: Some(scene.source.clone()), ..Touchpad::default() };
        self.fingers.steers = scene.tools.contains(Tools::STEER);
        dom::show(&dom::by_id("stick"), self.fingers.steers);
        let caps = words::caps(scene);
        let directions = [Buttons::UP, Buttons::LEFT, Buttons::DOWN, Buttons::RIGHT];
        let tools: Vec<Cap> =
            caps.into_iter().filter(|cap| !directions.contains(&cap.buttons)).collect();
        let aimed: Vec<&Cap> = tools.iter().filter(|cap| cap.aimed).collect();
        self.fingers.armed = aimed.first().map_or(Buttons::default(), |cap| cap.buttons);
        let parent: HtmlElement = dom::by_id("tools");
        parent.set_text_content(None);
        // A lone aimed tool needs no button: touching the world is it.
        let lone = aimed.len() == 1;
        for cap in tools.iter().filter(|cap| !(lone && cap.aimed)) {
            dom::append(&parent, &tool_button(cap));
        }
        self.show_armed();
    }

    /// Arms a tool.
    pub fn arm(&mut self, buttons: Buttons) {
        self.fingers.armed = buttons;
        self.show_armed();
    }

    fn show_armed(&self) {
        let buttons = dom::by_id::<HtmlElement>("tools").children();
        for index in 0..buttons.length() {
            let Some(button) = buttons.item(index) else { continue };
            if let Some(bits) = button.get_attribute("data-arm") {
                let armed = bits == self.fingers.armed.0.to_string();
                dom::set(&button, "aria-pressed", &armed.to_string());
            }
        }
    }

    /// A finger came down at a place on the canvas of a size (CSS pixels).
    pub fn down(&mut self, pointer: i32, at: Vec2, size: Vec2) -> Touched {
        let touched = self.fingers.down(pointer, at, size);
        if let Touched::Grip(at) = touched {
            place_stick(Some(at));
        }
        touched
    }

    /// A finger moved.
    pub fn moved(&mut self, pointer: i32, at: Vec2) -> Touched {
        let touched = self.fingers.moved(pointer, at);
        if let Touched::Lean(offset) = touched {
            place_knob(stick::knob(offset));
        }
        touched
    }

    /// A finger left the glass.
    pub fn up(&mut self, pointer: i32) -> Touched {
        let touched = self.fingers.up(pointer);
        if touched == Touched::Loose {
            place_stick(None);
        }
        touched
    }

    /// Forgets all fingers.
    pub fn release(&mut self) {
        self.fingers.release();
        place_stick(None);
    }
}

fn tool_button(cap: &Cap) -> HtmlElement {
    let button = dom::labelled("button", "", cap.does);
    let buttons = cap.buttons;
    if cap.aimed {
        dom::set(&button, "data-arm", &buttons.0.to_string());
        dom::listen(&button, "pointerdown", move |_: PointerEvent| {
            app::with(|app| app.touchpad.arm(buttons));
        });
        dom::listen(&button, "click", move |_: MouseEvent| {
            app::with(|app| app.touchpad.arm(buttons));
        });
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
            app::with(|app| app.press(buttons, down));
        });
    }
    dom::listen(&button, "click", move |event: MouseEvent| {
        if event.detail() == 0 {
            app::with(|app| app.press(buttons, true));
            dom::after(CLICK_MS, move || {
                app::with(|app| app.press(buttons, false));
            });
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
    place_knob(Vec2::ZERO);
}

fn place_knob(offset: Vec2) {
    let knob: HtmlElement = dom::by_id("knob");
    dom::style(&knob, "transform", &format!("translate({}px, {}px)", offset.x, offset.y));
}
