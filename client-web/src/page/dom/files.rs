//! Replay files of this machine: dropped onto the page, or chosen.

use crate::browser;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::{Problem, ReplayError};
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{DragEvent, File, HtmlInputElement};

pub fn listen(events: Events) {
    // Without this the browser would leave the page to show the file.
    dom::listen(&browser::window(), "dragover", move |event: DragEvent| {
        event.prevent_default();
        events.push_from(Event::FileDragged, &event);
    });
    dom::listen(&browser::window(), "dragleave", |event: DragEvent| {
        // It leaves every element on its way; the window itself it leaves for nothing else.
        if event.related_target().is_none() {
            dom::mark("dropping", false);
        }
    });
    dom::listen(&browser::window(), "drop", move |event: DragEvent| {
        event.prevent_default();
        dom::mark("dropping", false);
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
        // The same file can be chosen again.
        input.set_value("");
    });
}

/// Reads a file and reports its contents.
fn read(events: Events, file: &File) {
    let name = file.name();
    let bytes = file.size();
    if bytes > REPLAY_BYTES_MAX as f64 {
        let problem = Problem::TooLong { bytes: bytes as usize };
        let error = ReplayError { offset: REPLAY_BYTES_MAX, problem };
        return events.push(Event::ReplayRead(name, Err(error)));
    }
    let unread = name.clone();
    let taken = Closure::<dyn FnMut(JsValue)>::new(move |buffer: JsValue| {
        let bytes = js_sys::Uint8Array::new(&buffer).to_vec();
        events.push(Event::ReplayRead(name.clone(), Ok(bytes)));
    });
    let failed = Closure::<dyn FnMut(JsValue)>::new(move |_| {
        let error = ReplayError { offset: 0, problem: Problem::CutOff };
        events.push(Event::ReplayRead(unread.clone(), Err(error)));
    });
    let _ = file.array_buffer().unchecked_into::<js_sys::Promise>().then2(&taken, &failed);
    // The promise decides which of them is called and when: a few bytes a file.
    taken.forget();
    failed.forget();
}
