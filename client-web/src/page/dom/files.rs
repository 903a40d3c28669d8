//! Local files (replays and scenes) that are dropped onto the page or chosen in a dialog.

use crate::browser;
use crate::net::api::file_error;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::file_kind::{FileKind, is_scene_name};
use crate::page::queue::Events;
use jostle_protocol::limits::{REPLAY_BYTES_MAX, SCENE_BYTES_MAX};
use jostle_protocol::replay::{Problem, ReplayError};
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{DragEvent, File, HtmlInputElement};

pub fn listen(events: Events) {
    // Without this, the browser would leave the page to show the file.
    dom::listen(&browser::window(), "dragover", move |event: DragEvent| {
        event.prevent_default();
        events.push_from(Event::FileDragged, &event);
    });
    dom::listen(&browser::window(), "dragleave", |event: DragEvent| {
        // The event fires for every element that the drag leaves. There is no related target only when the drag leaves
        // the window.
        if event.related_target().is_none() {
            dom::mark("data-dropping", false);
        }
    });
    dom::listen(&browser::window(), "drop", move |event: DragEvent| {
        event.prevent_default();
        dom::mark("data-dropping", false);
        let files = event.data_transfer().and_then(|data| data.files());
        if let Some(file) = files.and_then(|files| files.get(0)) {
            read(events, &file);
        }
    });
    dom::listen(&dom::html("file"), "change", move |_: web_sys::Event| {
        let input: HtmlInputElement = dom::by_id("file");
        if let Some(file) = input.files().and_then(|files| files.get(0)) {
            read(events, &file);
        }
        // Clearing the value allows the same file to be chosen again.
        input.set_value("");
    });
}

/// The event for a file that was read.
fn read_event(name: String, bytes: Vec<u8>) -> Event {
    match FileKind::of(&name, &bytes) {
        FileKind::Replay => Event::ReplayRead(name, Ok(bytes)),
        FileKind::Scene if bytes.len() > SCENE_BYTES_MAX => too_long(name, bytes.len()),
        FileKind::Scene => Event::SceneRead(name, Ok(bytes)),
    }
}

/// The event for a file that is too long to be read.
fn too_long(name: String, bytes: usize) -> Event {
    if bytes > REPLAY_BYTES_MAX && !is_scene_name(&name) {
        let error = ReplayError { offset: REPLAY_BYTES_MAX, problem: Problem::TooLong { bytes } };
        return Event::ReplayRead(name, Err(error));
    }
    let allowed = format!("at most {SCENE_BYTES_MAX}");
    let error = file_error(&name, &format!("{bytes} bytes"), &allowed);
    Event::SceneRead(name, Err(error))
}

fn unreadable(name: String) -> Event {
    if is_scene_name(&name) {
        let error = file_error(&name, "a file that cannot be read", "a TOML file");
        return Event::SceneRead(name, Err(error));
    }
    let error = ReplayError { offset: 0, problem: Problem::CutOff };
    Event::ReplayRead(name, Err(error))
}

/// Reads a file and reports its contents.
fn read(events: Events, file: &File) {
    let name = file.name();
    let bytes_max = if is_scene_name(&name) { SCENE_BYTES_MAX } else { REPLAY_BYTES_MAX };
    if file.size() > bytes_max as f64 {
        return events.push(too_long(name, file.size() as usize));
    }
    let unread = name.clone();
    let taken = Closure::<dyn FnMut(JsValue)>::new(move |buffer: JsValue| {
        let bytes = js_sys::Uint8Array::new(&buffer).to_vec();
        events.push(read_event(name.clone(), bytes));
    });
    let failed = Closure::<dyn FnMut(JsValue)>::new(move |_| {
        events.push(unreadable(unread.clone()));
    });
    let _ = file.array_buffer().unchecked_into::<js_sys::Promise>().then2(&taken, &failed);
    // The promise will call one of the two closures later. Leaking them costs a few bytes per file.
    taken.forget();
    failed.forget();
}
