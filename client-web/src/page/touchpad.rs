//! Thumbs: a stick that appears under the left one, and a button for each tool under the right
//! one. Tools that need a place are armed by their button and used where the world is touched.

use super::app;
use super::dom;
use crate::stick;
use crate::words::{self, Cap};
use jostle_sim::{Buttons, Scene, Tools, Vec2};
use web_sys::{HtmlElement, PointerEvent};

/// Share of the canvas's width that belongs to the stick.
const STICK_WIDTH: f32 = 0.45;
/// Share of the canvas's height, from the bottom, that belongs to the stick.
const STICK_HEIGHT: f32 = 0.6;

/// What a finger on the canvas does.
#[derive(Clone, Copy, PartialEq)]
enum Finger {
    Steers { pointer: i32, from: Vec2 },
    Aims { pointer: i32 },
}

/// Thumbs on the glass.
#[derive(Default)]
pub struct Touchpad {
    fingers: Vec<Finger>,
    armed: Buttons,
    steers: bool,
    scene: Option<String>,
}

/// What a touch asks of the controls.
pub enum Touched {
    /// Steer so.
    Steer(Buttons),
    /// The armed tool goes down or up at the finger.
    Aim(Buttons, bool),
    /// The finger that aims moved.
    Move,
    /// Nothing.
    Nothing,
}

impl Touchpad {
    /// Makes the buttons of a scene.
    pub fn adopt_scene(&mut self, scene: &Scene) {
        if self.scene.as_ref() == Some(&scene.source) {
            return;
        }
        *self = Touchpad { scene: Some(scene.source.clone()), ..Touchpad::default() };
        self.steers = scene.tools.contains(Tools::STEER);
        dom::show(&dom::by_id("stick"), self.steers);
        let caps = words::caps(scene);
        let directions = [Buttons::UP, Buttons::LEFT, Buttons::DOWN, Buttons::RIGHT];
        let tools: Vec<Cap> =
            caps.into_iter().filter(|cap| !directions.contains(&cap.buttons)).collect();
        let aimed: Vec<&Cap> = tools.iter().filter(|cap| cap.aimed).collect();
        self.armed = aimed.first().map_or(Buttons::default(), |cap| cap.buttons);
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
        self.armed = buttons;
        self.show_armed();
    }

    fn show_armed(&self) {
        let buttons = dom::by_id::<HtmlElement>("tools").children();
        for index in 0..buttons.length() {
            let Some(button) = buttons.item(index) else { continue };
            if let Some(bits) = button.get_attribute("data-arm") {
                let armed = bits == self.armed.0.to_string();
                dom::set(&button, "aria-pressed", &armed.to_string());
            }
        }
    }

    /// A finger came down at a place on the canvas of a size (CSS pixels).
    pub fn down(&mut self, pointer: i32, at: Vec2, size: Vec2) -> Touched {
        let steering = self.fingers.iter().any(|f| matches!(f, Finger::Steers { .. }));
        let on_stick = at.x < size.x * STICK_WIDTH && at.y > size.y * (1.0 - STICK_HEIGHT);
        if self.steers && !steering && on_stick {
            self.fingers.push(Finger::Steers { pointer, from: at });
            place_stick(Some(at));
            return Touched::Steer(Buttons::default());
        }
        if self.fingers.iter().any(|f| matches!(f, Finger::Aims { .. })) {
            return Touched::Nothing;
        }
        self.fingers.push(Finger::Aims { pointer });
        Touched::Aim(self.armed, true)
    }

    /// A finger moved.
    pub fn moved(&mut self, pointer: i32, at: Vec2) -> Touched {
        match self.finger(pointer) {
            Some(Finger::Steers { from, .. }) => {
                place_knob(stick::knob(at - from));
                Touched::Steer(stick::directions(at - from))
            }
            Some(Finger::Aims { .. }) => Touched::Move,
            None => Touched::Nothing,
        }
    }

    /// A finger left the glass.
    pub fn up(&mut self, pointer: i32) -> Touched {
        let finger = self.finger(pointer);
        self.fingers.retain(|f| Some(*f) != finger);
        match finger {
            Some(Finger::Steers { .. }) => {
                place_stick(None);
                Touched::Steer(Buttons::default())
            }
            Some(Finger::Aims { .. }) => Touched::Aim(self.armed, false),
            None => Touched::Nothing,
        }
    }

    /// Forgets all fingers.
    pub fn release(&mut self) {
        self.fingers.clear();
        place_stick(None);
    }

    fn finger(&self, wanted: i32) -> Option<Finger> {
        self.fingers.iter().copied().find(|finger| match finger {
            Finger::Steers { pointer, .. } | Finger::Aims { pointer } => *pointer == wanted,
        })
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
