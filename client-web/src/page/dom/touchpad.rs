//! Fingers: a stick that appears under the left thumb, and a button for each tool under the right
//! one. Tools that need a place are armed by their button and used where the world is touched.

use crate::browser;
use crate::input::stick;
use crate::language::say;
use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::event::Event;
use crate::page::queue::Events;
use crate::page::tools;
use jostle_game::{Buttons, Kind, Scene};
use jostle_sim::Vec2;
use web_sys::{Element, MouseEvent, PointerEvent};

/// A button that is clicked without a pointer (by a key, by a screen reader) is down for this long,
/// milliseconds: some ticks.
const CLICK_MS: i32 = 120;

/// Stick and tool buttons as they were shown last.
pub struct Touchpad {
    scene: Option<String>,
    chosen: (Buttons, Option<Kind>),
    tools: List,
    stick: Option<(Vec2, Vec2)>,
}

impl Touchpad {
    pub fn new() -> Touchpad {
        let chosen = (Buttons::default(), None);
        Touchpad { scene: None, chosen, tools: List::new("tools"), stick: None }
    }

    /// Has the buttons made again.
    pub fn clear(&mut self) {
        self.scene = None;
    }

    /// Shows stick and buttons.
    pub fn show(&mut self, app: &App) {
        if let Some(replica) = app.game().and_then(|game| game.replica()) {
            let chosen = (app.fingers.armed, replica.selected_kind());
            if (self.scene.as_ref(), self.chosen) != (Some(&replica.scene.source), chosen) {
                self.scene = Some(replica.scene.source.clone());
                self.chosen = chosen;
                dom::show("stick", tools::fingers(&replica.scene).steers);
                self.tools.show(tool_buttons(&replica.scene, chosen));
            }
        }
        let stick = app.fingers.stick();
        if self.stick != stick {
            self.stick = stick;
            place_stick(stick.map(|(from, _)| from));
            let offset = stick.map_or(Vec2::ZERO, |(_, offset)| stick::knob(offset));
            let moved = format!("translate({}px, {}px)", offset.x, offset.y);
            dom::style(&dom::html("knob"), "transform", &moved);
        }
    }
}

/// The buttons of a scene, with the tool that is armed and the kind of body that is selected. A lone
/// aimed tool needs none: touching the world is it.
fn tool_buttons(
    scene: &Scene,
    (armed, selected): (Buttons, Option<Kind>),
) -> impl Iterator<Item = Item> {
    let tools = tools::touch_tools(scene);
    let lone = tools.iter().filter(|cap| cap.aimed).count() == 1;
    tools.into_iter().filter(move |cap| !(lone && cap.aimed)).map(move |cap| {
        let is_chosen = match tools::picks(cap.buttons) {
            Some(kind) => Some(selected == Some(kind)),
            None => cap.aimed.then_some(cap.buttons == armed),
        };
        Item::new("tool-item", cap.buttons.0)
            .with("", "data-buttons", cap.buttons.0.to_string())
            .with("", "data-arms", cap.aimed.then(String::new))
            .with("", "aria-pressed", is_chosen.map(|chosen| chosen.to_string()))
            .text("", say(cap.does))
    })
}

/// Listens to the tool buttons: those with `data-arms` arm a tool, the others are keys.
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

/// Moves the stick under the thumb, or back to its place.
fn place_stick(at: Option<Vec2>) {
    let stick = dom::html("stick");
    let _ = stick.class_list().toggle_with_force("held", at.is_some());
    let (left, top, bottom) = match at {
        Some(at) => (format!("{}px", at.x), format!("{}px", at.y - stick::RADIUS_PX), "auto"),
        None => (String::new(), String::new(), ""),
    };
    dom::style(&stick, "left", &left);
    dom::style(&stick, "top", &top);
    dom::style(&stick, "bottom", bottom);
}
