//! Listeners for keys, pointers and the page's buttons. Each only reports an event.

use crate::browser;
use crate::input::keys::place_of;
use crate::net::simulated_link::NetworkConditions;
use crate::page::dom;
use crate::page::dom::{editor, files, lobby, settings, timeline, touchpad};
use crate::page::event::{Event, Focus, Form, Key, Pointer, PointerChange};
use crate::page::page_action::PageAction;
use crate::page::queue::Events;
use crate::sound::task::SoundEvent;
use jostle_sim::Vec2;
use web_sys::{
    HtmlInputElement, KeyboardEvent, MouseEvent, PointerEvent, StorageEvent, WheelEvent,
};

pub fn all(events: Events) {
    panels(events);
    network(events);
    sound(events);
    keys(events);
    pointer(events);
    window(events);
    dom::listen(&dom::document(), "click", move |event: MouseEvent| click(events, &event));
    lobby::listen(events);
    touchpad::listen(events);
    timeline::listen(events);
    settings::listen(events);
    files::listen(events);
    editor::listen(events);
}

fn window(events: Events) {
    let lost = move |_: web_sys::Event| events.push(Event::FocusLost);
    dom::listen(&browser::window(), "blur", lost);
    dom::listen(&browser::window(), "pagehide", move |_: web_sys::Event| {
        events.push(Event::Closing);
    });
    dom::listen(&dom::document(), "visibilitychange", move |_: web_sys::Event| {
        events.push(Event::Sound(SoundEvent::Hidden(dom::document().hidden())));
    });
    dom::listen(&browser::window(), "storage", move |event: StorageEvent| {
        if let Some(key) = event.key() {
            events.push(Event::StoredElsewhere(key, event.new_value()));
        }
    });
    dom::listen(&browser::window(), "online", move |_: web_sys::Event| events.push(Event::Online));
    let stage = dom::html("stage");
    dom::listen(&stage, "webglcontextlost", move |event: web_sys::Event| {
        // The browser restores a lost context only if the default action is prevented.
        event.prevent_default();
        events.push(Event::ContextLost);
    });
    dom::listen(&stage, "webglcontextrestored", move |_: web_sys::Event| {
        events.push(Event::ContextRestored);
    });
}

fn keys(events: Events) {
    dom::listen(&browser::window(), "keydown", move |event: KeyboardEvent| {
        dom::mark("data-tabbing", event.code() == "Tab");
        events.push_from(Event::KeyDown(key(&event)), &event);
    });
    dom::listen(&browser::window(), "keyup", move |event: KeyboardEvent| {
        events.push_from(Event::KeyUp(key(&event)), &event);
    });
}

/// Escape closes a panel that specifies an action for it (`data-escape`). After a mouse click in such a panel, keys
/// control the game again; keyboard focus stays in the panel.
fn panels(events: Events) {
    let document = dom::document();
    dom::listen(&document, "click", |event: MouseEvent| {
        if event.detail() > 0 && dom::target_within(&event, "[data-escape]").is_some() {
            // A click on a label first moves the focus to its checkbox.
            browser::after(0, dom::focus_stage);
        }
    });
    dom::listen(&document, "keydown", move |event: KeyboardEvent| {
        let panel =
            dom::target_within(&event, "[data-escape]").filter(|_| event.code() == "Escape");
        let name = panel.and_then(|panel| panel.get_attribute("data-escape"));
        if let Some(action) = name.and_then(|name| PageAction::named(&name)) {
            event.prevent_default();
            event.stop_propagation();
            events.push(Event::Clicked(action, String::new()));
        }
    });
}

fn key(event: &KeyboardEvent) -> Key {
    let focus = match () {
        () if dom::target_within(event, "input, textarea, select, [contenteditable]").is_some() => {
            Focus::Field
        }
        () if dom::target_within(event, "button, a").is_some() => Focus::Button,
        () => Focus::Elsewhere,
    };
    Key {
        code: place_of(event.code(), &event.key()),
        letter: event.key(),
        repeat: event.repeat(),
        modified: event.ctrl_key() || event.meta_key() || event.alt_key(),
        command: event.ctrl_key() || event.meta_key(),
        shift: event.shift_key(),
        focus,
    }
}

/// Handles a click on an element with an action (`data-action`) and optionally a value. If the element has
/// `data-stage`, keys then control the game again.
fn click(events: Events, event: &MouseEvent) {
    let Some(element) = dom::target_within(event, "[data-action]") else { return };
    if element.has_attribute("href") {
        // With these keys the browser opens the link in a new tab or window.
        if event.ctrl_key() || event.meta_key() || event.shift_key() {
            return;
        }
        event.prevent_default();
    }
    if element.has_attribute("data-stage") {
        dom::back_to_stage(event);
    }
    let attribute = |name| element.get_attribute(name).unwrap_or_default();
    let value = attribute("data-value");
    let Some(action) = PageAction::named(&attribute("data-action")) else { return };
    events.push(match action {
        PageAction::OpenPrivate => {
            Event::SceneClicked(value, Form { private: true, ..lobby::form() })
        }
        PageAction::OpenScene if !dom::is_static() => Event::SceneClicked(value, lobby::form()),
        PageAction::OpenScene | PageAction::PlayAlone => Event::AloneClicked(value, lobby::form()),
        _ => Event::Clicked(action, value),
    });
}

fn pointer(events: Events) {
    let stage = dom::html("stage");
    dom::listen(&stage, "contextmenu", |event: MouseEvent| event.prevent_default());
    dom::listen(&stage, "wheel", move |event: WheelEvent| {
        let at = Vec2::new(event.offset_x() as f32, event.offset_y() as f32);
        // Converts lines and pages to a typical number of pixels.
        let unit = [1.0, 20.0, 400.0][event.delta_mode().min(2) as usize];
        events.push_from(Event::Wheel(at, event.delta_y() as f32 * unit), &event);
    });
    dom::listen(&stage, "pointerdown", move |event: PointerEvent| {
        event.prevent_default();
        dom::mark("data-tabbing", false);
        dom::focus_stage();
        // Fails if the pointer is already gone.
        let _ = dom::html("stage").set_pointer_capture(event.pointer_id());
        events.push(Event::Pointer(change(&event, PointerChange::Down)));
    });
    for (kind, means) in [
        ("pointermove", PointerChange::Moved),
        ("pointerup", PointerChange::Up),
        ("pointercancel", PointerChange::Up),
        ("pointerleave", PointerChange::Left),
    ] {
        dom::listen(&stage, kind, move |event: PointerEvent| {
            events.push(Event::Pointer(change(&event, means)));
        });
    }
}

fn is_touch(event: &PointerEvent) -> bool {
    event.pointer_type() == "touch"
}

fn change(event: &PointerEvent, change: PointerChange) -> Pointer {
    let stage = dom::html("stage");
    Pointer {
        change,
        id: event.pointer_id(),
        touch: is_touch(event),
        at: Vec2::new(event.offset_x() as f32, event.offset_y() as f32),
        canvas: Vec2::new(stage.client_width() as f32, stage.client_height() as f32),
        button: event.button(),
        pressed: event.buttons() & 0b11 != 0,
        shift: event.shift_key(),
        alt: event.alt_key(),
    }
}

/// Listens to the switches in the network panel.
fn network(events: Events) {
    dom::listen(&dom::html("net-predict"), "change", move |_: web_sys::Event| {
        let on = dom::by_id::<HtmlInputElement>("net-predict").checked();
        events.push(Event::PredictionChosen(on));
    });
    dom::listen(&dom::html("net-presets"), "change", move |event: web_sys::Event| {
        let chosen = dom::value_of::<String>(&event);
        if let Some(conditions) = chosen.and_then(|code| NetworkConditions::parse(&code)) {
            events.push(Event::ConditionsChosen(conditions));
        }
    });
}

/// Listens to the volume control and the switches in the sound panel.
fn sound(events: Events) {
    dom::listen(&dom::html("volume"), "input", move |event: web_sys::Event| {
        if let Some(volume) = dom::value_of(&event) {
            events.push(Event::Sound(SoundEvent::VolumeChosen(volume)));
        }
    });
    for (id, chosen) in [
        ("sound-on", (|on| SoundEvent::MuteChosen(!on)) as fn(bool) -> SoundEvent),
        ("captions-on", SoundEvent::CaptionsChosen),
    ] {
        dom::listen(&dom::html(id), "change", move |_: web_sys::Event| {
            let on = dom::by_id::<HtmlInputElement>(id).checked();
            events.push(Event::Sound(chosen(on)));
        });
    }
}
