//! One WebSocket: opens, hands on what arrives, closes. When to open another is decided elsewhere.

use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;
use web_sys::{BinaryType, CloseEvent, Event, MessageEvent, WebSocket};

/// Close code of a player who leaves (RFC 6455: a normal closure).
const LEAVE_CODE: u16 = 1000;

/// What a socket reports.
pub enum SocketEvent {
    /// It is open: the hello may be sent.
    Opened,
    /// A message came.
    Message(Vec<u8>),
    /// It is closed, or never opened.
    Closed {
        /// WebSocket close code.
        code: u16,
    },
}

/// An open or opening WebSocket. Dropping it closes it and silences it.
pub struct Socket {
    inner: WebSocket,
    _on_open: Closure<dyn Fn(Event)>,
    _on_message: Closure<dyn Fn(MessageEvent)>,
    _on_close: Closure<dyn Fn(CloseEvent)>,
}

impl Socket {
    /// Opens a socket to a path of the own server. `None` if the browser refuses to try.
    pub fn open(path: &str, report: impl Fn(SocketEvent) + Clone + 'static) -> Option<Socket> {
        let location = super::dom::window().location();
        let scheme = if location.protocol().ok()? == "https:" { "wss" } else { "ws" };
        let inner = WebSocket::new(&format!("{scheme}://{}{path}", location.host().ok()?)).ok()?;
        inner.set_binary_type(BinaryType::Arraybuffer);
        let tell = report.clone();
        let on_open = Closure::<dyn Fn(Event)>::new(move |_| tell(SocketEvent::Opened));
        let tell = report.clone();
        let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |event: MessageEvent| {
            if let Ok(buffer) = event.data().dyn_into::<js_sys::ArrayBuffer>() {
                tell(SocketEvent::Message(js_sys::Uint8Array::new(&buffer).to_vec()));
            }
        });
        let on_close = Closure::<dyn Fn(CloseEvent)>::new(move |event: CloseEvent| {
            report(SocketEvent::Closed { code: event.code() });
        });
        inner.set_onopen(Some(on_open.as_ref().unchecked_ref()));
        inner.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        inner.set_onclose(Some(on_close.as_ref().unchecked_ref()));
        Some(Socket { inner, _on_open: on_open, _on_message: on_message, _on_close: on_close })
    }

    /// Sends a message if the socket is open.
    pub fn send(&self, bytes: &[u8]) {
        if self.inner.ready_state() == WebSocket::OPEN {
            // Fails only while connecting, which was just ruled out.
            let _ = self.inner.send_with_u8_array(bytes);
        }
    }

    /// Closes it on purpose, which the server can tell from a connection that broke.
    pub fn leave(self) {
        let _ = self.inner.close_with_code(LEAVE_CODE);
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        self.inner.set_onopen(None);
        self.inner.set_onmessage(None);
        self.inner.set_onclose(None);
        // Of no use, and harmless, if it was closed with a reason before.
        let _ = self.inner.close();
    }
}
