//! One WebSocket: opens, hands on what arrives, closes. When to open another is decided elsewhere.
//!
//! Both ways may lead through a simulated network, which the player chooses (F4): what is passed on
//! then waits its time, in order.

use super::dom;
use crate::lag::{Lag, Lane};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;
use web_sys::{BinaryType, CloseEvent, Event, MessageEvent, WebSocket};

/// Close code of a player who leaves (RFC 6455: a normal closure).
const LEAVE_CODE: u16 = 1000;
/// A timer may end so much before its time, milliseconds.
const TIMER_SLACK_MS: f64 = 1.0;

thread_local! {
    /// The simulated network of this page.
    static LAG: Cell<Lag> = const { Cell::new(Lag::OFF) };
}

/// The simulated network.
pub fn lag() -> Lag {
    LAG.get()
}

/// Sets the simulated network, also of what is open.
pub fn set_lag(lag: Lag) {
    LAG.set(lag);
}

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

/// One direction: what goes in comes out in order, at once or when the simulated network lets it.
struct Way<T> {
    lane: RefCell<Lane>,
    waiting: RefCell<VecDeque<(f64, T)>>,
    out: Box<dyn Fn(T)>,
}

impl<T: 'static> Way<T> {
    fn new(seed: u64, out: impl Fn(T) + 'static) -> Rc<Way<T>> {
        let (lane, waiting) = (RefCell::new(Lane::new(seed)), RefCell::default());
        Rc::new(Way { lane, waiting, out: Box::new(out) })
    }

    fn pass(self: &Rc<Self>, what: T) {
        let lag = LAG.get();
        if !lag.is_on() && self.waiting.borrow().is_empty() {
            return (self.out)(what);
        }
        let now = dom::now_ms();
        let due = self.lane.borrow_mut().arrival_ms(&lag, now);
        self.waiting.borrow_mut().push_back((due, what));
        // A way that is gone by then lets nothing out.
        let way = Rc::downgrade(self);
        dom::after((due - now).ceil() as i32, move || {
            if let Some(way) = way.upgrade() {
                way.let_out();
            }
        });
    }

    fn let_out(&self) {
        let now = dom::now_ms() + TIMER_SLACK_MS;
        loop {
            // What comes out may put something in.
            let due = self.waiting.borrow_mut().pop_front_if(|(due, _)| *due <= now);
            let Some((_, what)) = due else { return };
            (self.out)(what);
        }
    }
}

/// An open or opening WebSocket. Dropping it closes it and silences it.
pub struct Socket {
    inner: WebSocket,
    inward: Rc<Way<SocketEvent>>,
    outward: Rc<Way<Vec<u8>>>,
    _on_open: Closure<dyn Fn(Event)>,
    _on_message: Closure<dyn Fn(MessageEvent)>,
    _on_close: Closure<dyn Fn(CloseEvent)>,
}

impl Socket {
    /// Opens a socket to a path of the own server. `None` if the browser refuses to try.
    pub fn open(path: &str, report: impl Fn(SocketEvent) + Clone + 'static) -> Option<Socket> {
        let location = dom::window().location();
        let scheme = if location.protocol().ok()? == "https:" { "wss" } else { "ws" };
        let inner = WebSocket::new(&format!("{scheme}://{}{path}", location.host().ok()?)).ok()?;
        inner.set_binary_type(BinaryType::Arraybuffer);
        let inward = Way::new(1, report);
        let way = Rc::clone(&inward);
        let on_open = Closure::<dyn Fn(Event)>::new(move |_| way.pass(SocketEvent::Opened));
        let way = Rc::clone(&inward);
        let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |event: MessageEvent| {
            if let Ok(buffer) = event.data().dyn_into::<js_sys::ArrayBuffer>() {
                way.pass(SocketEvent::Message(js_sys::Uint8Array::new(&buffer).to_vec()));
            }
        });
        let way = Rc::clone(&inward);
        let on_close = Closure::<dyn Fn(CloseEvent)>::new(move |event: CloseEvent| {
            way.pass(SocketEvent::Closed { code: event.code() });
        });
        inner.set_onopen(Some(on_open.as_ref().unchecked_ref()));
        inner.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        inner.set_onclose(Some(on_close.as_ref().unchecked_ref()));
        let socket = inner.clone();
        let outward = Way::new(2, move |bytes: Vec<u8>| {
            if socket.ready_state() == WebSocket::OPEN {
                // Fails only while connecting, which was just ruled out.
                let _ = socket.send_with_u8_array(&bytes);
            }
        });
        let (_on_open, _on_message, _on_close) = (on_open, on_message, on_close);
        Some(Socket { inner, inward, outward, _on_open, _on_message, _on_close })
    }

    /// Sends a message if the socket is open.
    pub fn send(&self, bytes: &[u8]) {
        self.outward.pass(bytes.to_vec());
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
        // What is just let out may be what drops this: nothing comes after it.
        self.inward.waiting.borrow_mut().clear();
        self.outward.waiting.borrow_mut().clear();
        // Of no use, and harmless, if it was closed with a reason before.
        let _ = self.inner.close();
    }
}
