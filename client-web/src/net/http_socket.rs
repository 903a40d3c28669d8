//! A socket over HTTP, for networks that let no WebSocket through: performs the requests of an [`HttpStream`].

use crate::browser;
use crate::net::http;
use crate::net::http_stream::{HttpStream, Next};
use crate::net::report::SocketEvent;
use js_sys::{Promise, Reflect, Uint8Array};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{AbortController, ReadableStreamDefaultReader, RequestInit, Response};

/// Delay before a post without a good answer is repeated, milliseconds.
const RETRY_MS: i32 = 250;
/// Close code for a broken connection (RFC 6455).
const BROKEN: u16 = 1006;

/// An open or opening socket over HTTP. Dropping it closes it and stops its reports.
pub struct HttpSocket(Rc<Shared>);

/// Shared with the requests that are under way.
struct Shared {
    origin: String,
    stream: RefCell<HttpStream>,
    abort: AbortController,
    report: Box<dyn Fn(SocketEvent)>,
    stage: Cell<Stage>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum Stage {
    #[default]
    Open,
    /// The player left: the last posts go out, and nothing is reported.
    Leaving,
    Over,
}

#[wasm_bindgen]
extern "C" {
    /// A promise, as an object that takes functions.
    type Thenable;
    #[wasm_bindgen(method)]
    fn then(this: &Thenable, done: &JsValue, failed: &JsValue);
}

/// Calls `react` once, with the value or the error of a promise.
fn settled(promise: &Promise, react: impl FnOnce(JsValue) + 'static) {
    let react = Closure::once_into_js(react);
    promise.unchecked_ref::<Thenable>().then(&react, &react);
}

impl HttpSocket {
    /// Opens a socket to a path on the server with this origin. `None` if the browser refuses to try.
    pub fn open(
        origin: String,
        path: &str,
        report: impl Fn(SocketEvent) + 'static,
    ) -> Option<HttpSocket> {
        let abort = AbortController::new().ok()?;
        let init = RequestInit::new();
        init.set_method("POST");
        init.set_signal(Some(&abort.signal()));
        let address = format!("{origin}/api/stream{path}");
        let answer = browser::window().fetch_with_str_and_init(&address, &init);
        let (stream, stage) = Default::default();
        let shared = Rc::new(Shared { origin, stream, abort, report: Box::new(report), stage });
        let opened = Rc::clone(&shared);
        settled(&answer, move |answer| {
            let body = answer.dyn_into().ok().filter(Response::ok).and_then(|answer| answer.body());
            match body {
                Some(body) => opened.read(body.get_reader().unchecked_into()),
                None => opened.close(BROKEN),
            }
        });
        Some(HttpSocket(shared))
    }

    /// Sends a message if the socket is open.
    pub fn send(&self, bytes: &[u8]) {
        self.0.stream.borrow_mut().send(bytes);
        self.0.post();
    }

    /// Closes the socket on purpose. The server then ends the response.
    pub fn leave(&self) {
        self.0.stage.set(Stage::Leaving);
        self.0.stream.borrow_mut().leave();
        self.0.post();
    }
}

impl Drop for HttpSocket {
    fn drop(&mut self) {
        if self.0.stage.get() == Stage::Open {
            self.0.end();
        }
    }
}

impl Shared {
    /// Reads the response part by part until it ends.
    fn read(self: Rc<Self>, reader: ReadableStreamDefaultReader) {
        settled(&reader.read(), move |part| {
            let value = Reflect::get(&part, &JsValue::from_str("value")).ok();
            let Some(bytes) = value.and_then(|value| value.dyn_into::<Uint8Array>().ok()) else {
                return self.close(BROKEN);
            };
            self.stream.borrow_mut().receive(&bytes.to_vec());
            while let Some(event) = self.next_event() {
                match event {
                    SocketEvent::Closed { code } => return self.close(code),
                    event if self.stage.get() == Stage::Open => (self.report)(event),
                    _ => {}
                }
            }
            // A ping may have to be answered.
            self.post();
            self.read(reader);
        });
    }

    /// Releases the state before the event is reported, which may lead to the next call.
    fn next_event(&self) -> Option<SocketEvent> {
        self.stream.borrow_mut().next_event()
    }

    /// Sends the next post, if it is time.
    fn post(self: &Rc<Self>) {
        let post = self.stream.borrow_mut().next_post();
        self.request(post);
    }

    fn request(self: &Rc<Self>, post: Option<(String, Vec<u8>)>) {
        let Some((path, body)) = post.filter(|_| self.stage.get() != Stage::Over) else { return };
        let shared = Rc::clone(self);
        http::post(&format!("{}{path}", self.origin), &body, move |status| {
            let next = shared.stream.borrow_mut().answered(status);
            match next {
                Next::Post => shared.post(),
                Next::Retry => browser::after(RETRY_MS, move || {
                    let post = shared.stream.borrow().post();
                    shared.request(post);
                }),
                Next::End => shared.close(BROKEN),
            }
        });
    }

    fn close(&self, code: u16) {
        let was = self.stage.get();
        self.end();
        if was == Stage::Open {
            (self.report)(SocketEvent::Closed { code });
        }
    }

    fn end(&self) {
        self.stage.set(Stage::Over);
        self.abort.abort();
    }
}
