//! The way to the room: how it is opened, lost, looked for again and ended. A room in the page is
//! always there.

use super::{Play, State};
use crate::demo::Demo;
use crate::page::socket::{Socket, SocketEvent};
use crate::page::{dom, profile};
use crate::reconnect::Backoff;
use crate::words::{self, Notice};
use jostle_protocol::Refusal;

/// A socket that says nothing for so long is given up, milliseconds.
const SILENCE_MS: f64 = 6000.0;

/// The other end.
pub(super) enum Link {
    /// A room on the server.
    Server { socket: Option<Socket>, backoff: Backoff, generation: u32 },
    /// A room in the page.
    Demo(Box<Demo>),
}

impl Play {
    /// Opens a new socket in place of the old one.
    pub fn connect(&mut self, report: impl Fn(u32, SocketEvent) + Clone + 'static) {
        let Link::Server { socket, backoff, generation } = &mut self.link else { return };
        *generation += 1;
        let own = *generation;
        let opened = Socket::open(&format!("/{}", self.code), move |event| report(own, event));
        if opened.is_none() {
            backoff.lost(dom::now_ms(), js_sys::Math::random());
        }
        *socket = opened;
        self.opened_ms = dom::now_ms();
        self.notice = None;
        if self.state == State::Refused {
            self.state = State::Connecting;
        }
    }

    /// Takes what the socket of a generation reports; an older socket is not listened to.
    pub fn on_socket(&mut self, from: u32, event: SocketEvent) {
        if !matches!(&self.link, Link::Server { generation, .. } if *generation == from) {
            return;
        }
        match event {
            SocketEvent::Opened => self.hello(),
            SocketEvent::Message(bytes) => {
                let now = dom::now_ms();
                self.receive(&bytes, now);
                self.keep_up_unseen(now);
            }
            SocketEvent::Closed { code } => {
                if let Link::Server { socket, .. } = &mut self.link {
                    *socket = None;
                }
                self.closed(code);
            }
        }
    }

    /// Closes the socket as if the network had; the page then reconnects.
    pub fn drop_socket(&mut self) {
        let Link::Server { socket, .. } = &mut self.link else { return };
        if socket.take().is_some() {
            self.closed(1006);
        }
    }

    /// Gives the seat up: the player went on purpose.
    pub fn leave(self) {
        if let Link::Server { socket, .. } = self.link {
            profile::set_seat_token(&self.code, None);
            if let Some(socket) = socket {
                socket.leave();
            }
        }
    }

    /// The server ended the session: for good, or as if the network had.
    pub(super) fn end(&mut self, refusal: Refusal) {
        if refusal == Refusal::BadToken {
            return self.join_anew();
        }
        self.forget(refusal);
        let known_room = self.joined_ms.is_some();
        let notice = match refusal {
            Refusal::NoSuchRoom if known_room => Some(words::ROOM_GONE),
            Refusal::RoomClosed if self.closes => Some(words::CLOSED_BY_YOU),
            _ => words::refused(refusal),
        };
        let Some(notice) = notice else {
            self.restarting = true;
            return self.drop_socket();
        };
        self.notice = Some(notice);
        self.state = State::Refused;
        self.closing_ms = None;
    }

    /// What the server does not give back is not asked for again.
    fn forget(&self, refusal: Refusal) {
        if matches!(refusal, Refusal::Kicked | Refusal::RoomClosed) {
            profile::set_seat_token(&self.code, None);
        }
        if matches!(refusal, Refusal::NoSuchRoom | Refusal::RoomClosed) {
            profile::set_host_key(&self.code, None);
        }
    }

    /// The seat is lost to this page: it asks for another at once, and says nothing of it.
    fn join_anew(&mut self) {
        profile::set_seat_token(&self.code, None);
        if let Link::Server { socket, backoff, .. } = &mut self.link {
            *socket = None;
            backoff.lost(dom::now_ms(), 0.0);
            backoff.hurry();
        }
    }

    pub(super) fn closed(&mut self, code: u16) {
        self.unproven_ms = None;
        if self.state == State::Refused {
            return;
        }
        if let Some(refusal) = words::refusal_of_close(code) {
            return self.end(refusal);
        }
        if self.state == State::Playing {
            self.state = State::Reconnecting;
        }
        // A server that said so did close, even if its last word was lost.
        self.restarting |= self.closing_ms.take().is_some();
        self.controls.release();
        if let Link::Server { backoff, .. } = &mut self.link {
            backoff.lost(dom::now_ms(), js_sys::Math::random());
        }
    }

    /// What the card says while the way back is looked for.
    pub fn loss(&self) -> &'static Notice {
        if self.restarting { &words::RESTARTING } else { &words::RECONNECTING }
    }

    /// Attempts since the last good connection.
    pub fn attempts(&self) -> u32 {
        match &self.link {
            Link::Server { backoff, .. } => backoff.attempts(),
            Link::Demo(_) => 0,
        }
    }

    /// Whether a new socket is to be opened now.
    pub fn wants_socket(&mut self, now_ms: f64) -> bool {
        if self.state == State::Refused {
            return false;
        }
        self.give_up_silent(now_ms);
        match &mut self.link {
            Link::Server { backoff, .. } => backoff.due(now_ms),
            Link::Demo(_) => false,
        }
    }

    /// A link that died without a word never reports its end.
    fn give_up_silent(&mut self, now_ms: f64) {
        let quiet_ms = now_ms - self.heard_ms.max(self.opened_ms);
        if quiet_ms > SILENCE_MS {
            self.drop_socket();
        }
    }

    /// The network is back or the player asks: no more waiting.
    pub fn hurry(&mut self) {
        if let Link::Server { backoff, .. } = &mut self.link {
            backoff.hurry();
        }
    }
}
