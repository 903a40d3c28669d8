//! The DOM side of the settings: language, full screen, key letters and gamepads.

use crate::browser;
use crate::input::pad::PadState;
use crate::page::dom;
use crate::page::event::{Event, SettingsEvent};
use crate::page::page_action::PageAction;
use crate::page::queue::Events;
use jostle_sim::Vec2;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Gamepad, GamepadButton, GamepadMappingType, HtmlInputElement, HtmlSelectElement};

pub fn listen(events: Events) {
    dom::show("full-choice", dom::document().fullscreen_enabled());
    let send = move |event| events.push(Event::Settings(event));
    dom::listen(&dom::html("language"), "change", move |_: web_sys::Event| {
        send(SettingsEvent::Language(dom::by_id::<HtmlSelectElement>("language").value()));
    });
    dom::listen(&dom::html("calm-on"), "change", move |_: web_sys::Event| {
        send(SettingsEvent::Calm(dom::by_id::<HtmlInputElement>("calm-on").checked()));
    });
    dom::listen(&dom::html("full-on"), "change", move |_: web_sys::Event| {
        events.push(Event::Clicked(PageAction::FullScreen, String::new()));
    });
    dom::listen(&dom::html("own-look"), "change", move |_: web_sys::Event| {
        let name = dom::by_id::<HtmlInputElement>("own-name").value();
        let color = dom::query::<HtmlInputElement>("#own-colors :checked");
        let color = color.and_then(|radio| radio.value().parse().ok()).unwrap_or(0);
        events.push(Event::LookChosen(name, color));
    });
    dom::listen(&dom::html("dead-zone"), "input", move |event: web_sys::Event| {
        if let Some(percent) = dom::value_of(&event) {
            send(SettingsEvent::DeadZone(percent));
        }
    });
    dom::listen(&dom::document(), "fullscreenchange", move |_: web_sys::Event| {
        send(SettingsEvent::FullScreen(dom::document().fullscreen_element().is_some()));
    });
    for kind in ["gamepadconnected", "gamepaddisconnected"] {
        dom::listen(&browser::window(), kind, move |_: web_sys::Event| {
            send(SettingsEvent::PadConnected(pads().next().is_some()));
        });
    }
    read_layout(events);
}

/// Asks the browser for the letters of the keys, where supported.
fn read_layout(events: Events) -> Option<()> {
    let get = |object: &JsValue, name: &str| js_sys::Reflect::get(object, &name.into()).ok();
    let keyboard = get(&browser::window().navigator(), "keyboard").filter(JsValue::is_object)?;
    let read: js_sys::Function = get(&keyboard, "getLayoutMap")?.dyn_into().ok()?;
    let promise: js_sys::Promise = read.call0(&keyboard).ok()?.dyn_into().ok()?;
    let taken = Closure::<dyn FnMut(JsValue)>::new(move |map: JsValue| {
        let entries = js_sys::Array::from(&map);
        let labels = entries.iter().filter_map(|entry| {
            let entry: js_sys::Array = entry.dyn_into().ok()?;
            Some((entry.get(0).as_string()?, entry.get(1).as_string()?))
        });
        events.push(Event::Settings(SettingsEvent::Layout(labels.collect())));
    });
    // A page in a frame may not be allowed to read the layout.
    let ignored = Closure::<dyn FnMut(JsValue)>::new(|_| {});
    let _ = promise.then2(&taken, &ignored);
    // The promise calls exactly one of them, once.
    taken.forget();
    ignored.forget();
    Some(())
}

/// Connected gamepads with the standard mapping.
fn pads() -> impl Iterator<Item = Gamepad> {
    let pads = browser::window().navigator().get_gamepads().unwrap_or_default();
    (0..pads.length())
        .filter_map(move |index| pads.get(index).dyn_into::<JsValue>().ok())
        .filter(JsValue::is_object)
        .map(|pad| pad.unchecked_into::<Gamepad>())
        .filter(|pad| pad.connected() && pad.mapping() == GamepadMappingType::Standard)
}

/// The combined state of all connected gamepads.
pub fn pad_state() -> PadState {
    let mut state = PadState::default();
    for pad in pads() {
        for (index, button) in pad.buttons().iter().enumerate().take(32) {
            let is_down = button.unchecked_into::<GamepadButton>().pressed();
            state.buttons |= u32::from(is_down) << index;
        }
        let axes = pad.axes();
        let axis = |index| axes.get(index).as_f64().unwrap_or(0.0) as f32;
        for (stick, first) in state.sticks.iter_mut().zip([0, 2]) {
            let read = Vec2::new(axis(first), axis(first + 1));
            if read.length() > stick.length() {
                *stick = read;
            }
        }
    }
    state
}

/// Enters or leaves full-screen mode.
pub fn full_screen(wanted: bool) {
    match wanted {
        // If the browser refuses, nothing changes.
        true => drop(dom::root().request_fullscreen()),
        false => dom::document().exit_fullscreen(),
    }
}

/// The address of a language file, as given in the document.
pub fn language_file(language: &str) -> Option<String> {
    dom::query::<web_sys::Element>(&format!("#language [value={language:?}]"))?
        .get_attribute("data-file")
}
