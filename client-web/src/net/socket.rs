//! A socket that reports when it opens, receives a message or closes: a WebSocket, or the same over HTTP. Other code
//! decides when to reconnect, and over which.
//!
//! Both directions may pass through a simulated network, which the player can enable (F4). Messages are then delayed,
//! but stay in order.

use crate::browser;
use crate::net::http_socket::HttpSocket;
use crate::net::report::SocketEvent;
use crate::net::simulated_link::{NetworkConditions, SimulatedLink};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;
use wasm_bindgen::JsCast;
use wasm_bindgen::closure::Closure;
use web_sys::{BinaryType, CloseEvent, Event, MessageEvent, WebSocket};

/// Close code used when a player leaves (RFC 6455: normal closure).
const LEAVE_CODE: u16 = 1000;
/// Timers may fire early by this much, milliseconds.
const TIMER_SLACK_MS: f64 = 1.0;

/// The simulated network, shared by all sockets of the page.
pub type Conditions = Rc<Cell<NetworkConditions>>;

/// One direction of the socket: messages come out in the order in which they went in, either immediately or when the
/// simulated network delivers them.
struct OrderedChannel<T> {
    conditions: Conditions,
    link: RefCell<SimulatedLink>,
    waiting: RefCell<VecDeque<(f64, T)>>,
    out: Box<dyn Fn(T)>,
}

impl<T: 'static> OrderedChannel<T> {
    fn new(seed: u64, conditions: &Conditions, out: impl Fn(T) + 'static) -> Rc<OrderedChannel<T>> {
        Rc::new(OrderedChannel {
            conditions: Rc::clone(conditions),
            link: RefCell::new(SimulatedLink::new(seed)),
            waiting: RefCell::default(),
            out: Box::new(out),
        })
    }

    fn pass(self: &Rc<Self>, what: T) {
        let conditions = self.conditions.get();
        if !conditions.is_on() && self.waiting.borrow().is_empty() {
            return (self.out)(what);
        }
        let now = browser::now_ms();
        let due = self.link.borrow_mut().arrival_ms(&conditions, now);
        self.waiting.borrow_mut().push_back((due, what));
        // A channel dropped in the meantime delivers nothing.
        let channel = Rc::downgrade(self);
        browser::after((due - now).ceil() as i32, move || {
            if let Some(channel) = channel.upgrade() {
                channel.let_out();
            }
        });
    }

    fn let_out(&self) {
        let now = browser::now_ms() + TIMER_SLACK_MS;
        loop {
            // Delivering a message may add another one.
            let due = self.waiting.borrow_mut().pop_front_if(|(due, _)| *due <= now);
            let Some((_, what)) = due else { return };
            (self.out)(what);
        }
    }
}

/// An open or opening socket. Dropping it closes it and stops its reports.
pub struct Socket {
    carrier: Rc<Carrier>,
    inward: Rc<OrderedChannel<SocketEvent>>,
    outward: Rc<OrderedChannel<Vec<u8>>>,
}

enum Carrier {
    WebSocket(OpenWebSocket),
    Http(HttpSocket),
}

struct OpenWebSocket {
    inner: WebSocket,
    _on_open: Closure<dyn Fn(Event)>,
    _on_message: Closure<dyn Fn(MessageEvent)>,
    _on_close: Closure<dyn Fn(CloseEvent)>,
}

impl Socket {
    /// Opens a socket to a path on the server with this origin, or on the page's server if the origin is empty. `None`
    /// if the browser refuses to try.
    pub fn open(
        mut origin: String,
        path: &str,
        over_http: bool,
        conditions: &Conditions,
        report: impl Fn(SocketEvent) + 'static,
    ) -> Option<Socket> {
        if origin.is_empty() {
            origin = browser::window().location().origin().ok()?;
        }
        let inward = OrderedChannel::new(1, conditions, report);
        let channel = Rc::clone(&inward);
        let report = move |event| channel.pass(event);
        let carrier = Rc::new(match over_http {
            true => Carrier::Http(HttpSocket::open(origin, path, report)?),
            false => Carrier::WebSocket(OpenWebSocket::open(&origin, path, report)?),
        });
        let sender = Rc::downgrade(&carrier);
        let outward = OrderedChannel::new(2, conditions, move |bytes: Vec<u8>| {
            sender.upgrade().into_iter().for_each(|carrier| carrier.send(&bytes));
        });
        Some(Socket { carrier, inward, outward })
    }

    /// Sends a message if the socket is open.
    pub fn send(&self, bytes: &[u8]) {
        self.outward.pass(bytes.to_vec());
    }

    /// Closes the socket on purpose, so that the server can tell this from a broken connection.
    pub fn leave(self) {
        match &*self.carrier {
            Carrier::WebSocket(socket) => _ = socket.inner.close_with_code(LEAVE_CODE),
            Carrier::Http(socket) => socket.leave(),
        }
    }
}

impl Carrier {
    fn send(&self, bytes: &[u8]) {
        match self {
            // This fails only while connecting, which is ruled out.
            Carrier::WebSocket(OpenWebSocket { inner, .. }) => {
                if inner.ready_state() == WebSocket::OPEN {
                    let _ = inner.send_with_u8_array(bytes);
                }
            }
            Carrier::Http(socket) => socket.send(bytes),
        }
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // Delivering a message may have caused this drop, after which no more messages may be delivered.
        self.inward.waiting.borrow_mut().clear();
        self.outward.waiting.borrow_mut().clear();
    }
}

impl OpenWebSocket {
    fn open(
        origin: &str,
        path: &str,
        report: impl Fn(SocketEvent) + Clone + 'static,
    ) -> Option<OpenWebSocket> {
        // `https` becomes `wss`.
        let address = origin.strip_prefix("http")?;
        let inner = WebSocket::new(&format!("ws{address}{path}")).ok()?;
        inner.set_binary_type(BinaryType::Arraybuffer);
        let [opens, receives, closes] = [report.clone(), report.clone(), report];
        let on_open = Closure::<dyn Fn(Event)>::new(move |_| opens(SocketEvent::Opened));
        let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |event: MessageEvent| {
            if let Ok(buffer) = event.data().dyn_into::<js_sys::ArrayBuffer>() {
                receives(SocketEvent::Message(js_sys::Uint8Array::new(&buffer).to_vec()));
            }
        });
        let on_close = Closure::<dyn Fn(CloseEvent)>::new(move |event: CloseEvent| {
            closes(SocketEvent::Closed { code: event.code() });
        });
        inner.set_onopen(Some(on_open.as_ref().unchecked_ref()));
        inner.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        inner.set_onclose(Some(on_close.as_ref().unchecked_ref()));
        let (_on_open, _on_message, _on_close) = (on_open, on_message, on_close);
        Some(OpenWebSocket { inner, _on_open, _on_message, _on_close })
    }
}

impl Drop for OpenWebSocket {
    fn drop(&mut self) {
        self.inner.set_onopen(None);
        self.inner.set_onmessage(None);
        self.inner.set_onclose(None);
        // Redundant but harmless if the socket was already closed.
        let _ = self.inner.close();
    }
}
