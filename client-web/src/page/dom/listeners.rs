//! Listeners to keys, pointers and the buttons of the page: each only says what happened.

use crate::browser;
use crate::page::dom;
use crate::page::dom::{files, lobby, network_panel, players, replay_controls};
use crate::page::event::{Control, Event, Focus, Key, Pointer, PointerChange};
use crate::page::queue::Events;
use jostle_sim::Vec2;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement, HtmlInputElement, KeyboardEvent, MouseEvent, PointerEvent};

/// Buttons of the page; the flag says whether keys belong to the game again after a click.
const BUTTONS: [(&str, Control, bool); 12] = [
    ("leave", Control::Leave, false),
    ("copy", Control::Copy, true),
    ("help-button", Control::Help, true),
    ("help-close", Control::Help, false),
    ("close-room", Control::CloseRoom, true),
    ("ask-yes", Control::Confirm, false),
    ("ask-no", Control::Cancel, false),
    ("notice-button", Control::Notice, false),
    ("notice-other", Control::NoticeOther, false),
    ("signal", Control::Network, true),
    ("net-close", Control::Network, false),
    ("open-file", Control::OpenFile, false),
];

/// Starts all listeners.
pub fn all(events: Events) {
    keys(events);
    pointer(events);
    buttons(events);
    window(events);
    lobby::listen(events);
    players::listen(events);
    network_panel::listen(events);
    replay_controls::listen(events);
    files::listen(events);
    if browser::media("(pointer: coarse)") {
        dom::mark("touch", true);
    }
}

fn window(events: Events) {
    let lost = move |_: web_sys::Event| events.push(Event::FocusLost);
    dom::listen(&browser::window(), "blur", lost);
    dom::listen(&browser::window(), "pagehide", lost);
    dom::listen(&dom::document(), "visibilitychange", lost);
    dom::listen(&browser::window(), "online", move |_: web_sys::Event| events.push(Event::Online));
    let stage: HtmlElement = dom::by_id("stage");
    dom::listen_active(&stage, "webglcontextlost", move |event: web_sys::Event| {
        // Without this the browser would not give it back.
        event.prevent_default();
        events.push(Event::ContextLost);
    });
    dom::listen(&stage, "webglcontextrestored", move |_: web_sys::Event| {
        events.push(Event::ContextRestored);
    });
}

fn keys(events: Events) {
    dom::listen_active(&browser::window(), "keydown", move |event: KeyboardEvent| {
        dom::mark("tabbing", event.code() == "Tab");
        events.push_from(Event::KeyDown(key(&event)), &event);
    });
    dom::listen(&browser::window(), "keyup", move |event: KeyboardEvent| {
        events.push_from(Event::KeyUp(key(&event)), &event);
    });
}

fn key(event: &KeyboardEvent) -> Key {
    Key {
        code: event.code(),
        letter: event.key(),
        repeat: event.repeat(),
        modified: event.ctrl_key() || event.meta_key() || event.alt_key(),
        focus: focus(event),
    }
}

fn focus(event: &web_sys::Event) -> Focus {
    let Some(target) = event.target() else { return Focus::Elsewhere };
    if target.dyn_ref::<HtmlInputElement>().is_some() {
        return Focus::Field;
    }
    let within = |selector| {
        target.dyn_ref::<Element>().is_some_and(|e| e.closest(selector).ok().flatten().is_some())
    };
    match () {
        () if within("[contenteditable]") => Focus::Field,
        () if within("button, a") => Focus::Button,
        () => Focus::Elsewhere,
    }
}

fn pointer(events: Events) {
    let stage: HtmlElement = dom::by_id("stage");
    dom::listen_active(&stage, "contextmenu", |event: MouseEvent| event.prevent_default());
    dom::listen_active(&stage, "pointerdown", move |event: PointerEvent| {
        event.prevent_default();
        dom::mark("tabbing", false);
        let stage: HtmlElement = dom::by_id("stage");
        let _ = stage.focus();
        // Fails for a pointer that is gone again already.
        let _ = stage.set_pointer_capture(event.pointer_id());
        if is_touch(&event) {
            // The first touch brings the stick and the tool buttons, also where a mouse is present.
            dom::mark("touch", true);
        }
        events.push(Event::Pointer(change(&event, PointerChange::Down)));
    });
    for (kind, means) in [
        ("pointermove", PointerChange::Moved),
        ("pointerup", PointerChange::Up),
        ("pointercancel", PointerChange::Up),
    ] {
        dom::listen(&stage, kind, move |event: PointerEvent| {
            events.push(Event::Pointer(change(&event, means)));
        });
    }
    dom::listen(&stage, "pointerleave", move |event: PointerEvent| {
        if !is_touch(&event) {
            events.push(Event::Pointer(change(&event, PointerChange::Left)));
        }
    });
    dom::listen(&stage, "click", move |_: web_sys::Event| events.push(Event::StageClicked));
}

fn is_touch(event: &PointerEvent) -> bool {
    event.pointer_type() == "touch"
}

fn change(event: &PointerEvent, change: PointerChange) -> Pointer {
    let stage: HtmlElement = dom::by_id("stage");
    Pointer {
        change,
        id: event.pointer_id(),
        touch: is_touch(event),
        at: Vec2::new(event.offset_x() as f32, event.offset_y() as f32),
        canvas: Vec2::new(stage.client_width() as f32, stage.client_height() as f32),
        button: event.button(),
        pressed: event.buttons() & 0b11 != 0,
    }
}

fn buttons(events: Events) {
    for (id, control, gives_keys_back) in BUTTONS {
        dom::listen(&dom::by_id::<HtmlElement>(id), "click", move |event: MouseEvent| {
            if gives_keys_back {
                dom::back_to_stage(&event);
            }
            events.push(Event::Clicked(control));
        });
    }
}
