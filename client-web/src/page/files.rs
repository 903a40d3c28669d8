//! Replay files from this machine: dropped onto the page, or chosen.

use super::{app, dom};
use crate::film::FilmError;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::{Problem, ReplayError};
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{DragEvent, Event, File, HtmlElement, HtmlInputElement};

/// Starts listening.
pub fn listen() {
    // Without this the browser would leave the page to show the file.
    dom::listen_active(&dom::window(), "dragover", |event: DragEvent| {
        event.prevent_default();
        let takes = app::with(|app| app.play.is_none()).unwrap_or(false);
        if let Some(data) = event.data_transfer() {
            data.set_drop_effect(if takes { "copy" } else { "none" });
        }
        mark_dropping(takes);
    });
    dom::listen(&dom::window(), "dragleave", |event: DragEvent| {
        // It leaves every element on its way; the window itself it leaves for nothing else.
        if event.related_target().is_none() {
            mark_dropping(false);
        }
    });
    dom::listen_active(&dom::window(), "drop", |event: DragEvent| {
        event.prevent_default();
        mark_dropping(false);
        let files = event.data_transfer().and_then(|data| data.files());
        if let Some(file) = files.and_then(|files| files.get(0)) {
            read(file);
        }
    });
    dom::listen(&dom::by_id::<HtmlInputElement>("file"), "change", |_: Event| {
        let input: HtmlInputElement = dom::by_id("file");
        if let Some(file) = input.files().and_then(|files| files.get(0)) {
            read(file);
        }
        // The same file can be chosen again.
        input.set_value("");
    });
    dom::listen(&dom::by_id::<HtmlElement>("open-file"), "click", |_: Event| choose());
}

/// Has the browser ask for a file.
pub fn choose() {
    dom::by_id::<HtmlInputElement>("file").click();
}

fn mark_dropping(on: bool) {
    let data = dom::root().dataset();
    if on {
        let _ = data.set("dropping", "yes");
    } else {
        data.delete("dropping");
    }
}

/// Reads a file and watches it. A game that is on is not left for it.
fn read(file: File) {
    if app::with(|app| app.play.is_some()).unwrap_or(true) {
        return;
    }
    let bytes = file.size();
    if bytes > REPLAY_BYTES_MAX as f64 {
        let problem = Problem::TooLong { bytes: bytes as usize };
        let error = FilmError::Unreadable(ReplayError { offset: REPLAY_BYTES_MAX, problem });
        app::with(|app| app.refuse_replay(&error));
        return;
    }
    let name = file.name();
    let taken = Closure::<dyn FnMut(JsValue)>::new(move |buffer: JsValue| {
        let bytes = js_sys::Uint8Array::new(&buffer).to_vec();
        app::open_file(name.clone(), bytes);
    });
    let failed = Closure::<dyn FnMut(JsValue)>::new(|_| {
        let problem = Problem::CutOff;
        let error = FilmError::Unreadable(ReplayError { offset: 0, problem });
        app::with(|app| app.refuse_replay(&error));
    });
    let _ = file.array_buffer().unchecked_into::<js_sys::Promise>().then2(&taken, &failed);
    // Who is called when is the promise's affair: a few bytes a file.
    taken.forget();
    failed.forget();
}
