//! Local files (replays and scenes) that are dropped onto the page or chosen in a dialog.

use crate::browser;
use crate::net::api::file_error;
use crate::page::dom;
use crate::page::event::Event;
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

/// The two kinds of files, distinguished by file name extension.
#[derive(Clone, Copy)]
enum FileKind {
    Replay,
    Scene,
}

impl FileKind {
    fn of(name: &str) -> FileKind {
        if name.ends_with(".toml") { FileKind::Scene } else { FileKind::Replay }
    }

    fn bytes_max(self) -> usize {
        match self {
            FileKind::Replay => REPLAY_BYTES_MAX,
            FileKind::Scene => SCENE_BYTES_MAX,
        }
    }

    fn read(self, name: String, bytes: Vec<u8>) -> Event {
        match self {
            FileKind::Replay => Event::ReplayRead(name, Ok(bytes)),
            FileKind::Scene => Event::SceneRead(name, Ok(bytes)),
        }
    }

    /// The error for a file that is too long.
    fn too_long(self, name: String, bytes: f64) -> Event {
        match self {
            FileKind::Replay => {
                let problem = Problem::TooLong { bytes: bytes as usize };
                let error = ReplayError { offset: REPLAY_BYTES_MAX, problem };
                Event::ReplayRead(name, Err(error))
            }
            FileKind::Scene => {
                let error = file_error(
                    &name,
                    &format!("{bytes} bytes"),
                    &format!("at most {SCENE_BYTES_MAX}"),
                );
                Event::SceneRead(name, Err(error))
            }
        }
    }

    fn unreadable(self, name: String) -> Event {
        match self {
            FileKind::Replay => {
                let error = ReplayError { offset: 0, problem: Problem::CutOff };
                Event::ReplayRead(name, Err(error))
            }
            FileKind::Scene => {
                let error = file_error(&name, "a file that cannot be read", "a TOML file");
                Event::SceneRead(name, Err(error))
            }
        }
    }
}

/// Reads a file and reports its contents.
fn read(events: Events, file: &File) {
    let (name, kind) = (file.name(), FileKind::of(&file.name()));
    if file.size() > kind.bytes_max() as f64 {
        return events.push(kind.too_long(name, file.size()));
    }
    let unread = name.clone();
    let taken = Closure::<dyn FnMut(JsValue)>::new(move |buffer: JsValue| {
        let bytes = js_sys::Uint8Array::new(&buffer).to_vec();
        events.push(kind.read(name.clone(), bytes));
    });
    let failed = Closure::<dyn FnMut(JsValue)>::new(move |_| {
        events.push(kind.unreadable(unread.clone()));
    });
    let _ = file.array_buffer().unchecked_into::<js_sys::Promise>().then2(&taken, &failed);
    // The promise will call one of the two closures later. Leaking them costs a few bytes per file.
    taken.forget();
    failed.forget();
}
