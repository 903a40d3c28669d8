//! The connection of a game to its room: how it is opened, lost, tried again and ended. A room in the page is
//! always there.

use super::GameScreen;
use super::link::Link;
use super::status::State;
use crate::net::report::SocketEvent;
use crate::page::context::Context;
use crate::page::event::Effect;
use crate::page::storage::Secret;
use crate::page::strings::{self, Card};
use jostle_protocol::Refusal;

/// A move to another server that takes longer than this is shown, milliseconds.
const MOVE_MS: f64 = 1000.0;
/// Close code of a connection that broke (RFC 6455).
const BROKEN: u16 = 1006;

impl GameScreen {
    /// Opens a new socket in place of the old one.
    pub fn connect(&mut self, ctx: &mut Context) {
        let Link::Server(connection) = &mut self.link else { return };
        connection.session = ctx.next_number();
        connection.open = true;
        connection.opened_ms = ctx.now_ms;
        let path = format!("/{}", self.code);
        let origin = connection.servers.current().to_owned();
        ctx.request(Effect::Connect { path, session: connection.session, origin });
        self.status.notice = None;
        if self.status.state == State::Refused {
            self.status.state = State::Connecting;
        }
    }

    /// Handles an event of the socket of a session; older sockets are ignored.
    pub fn on_socket(&mut self, ctx: &mut Context, session: u32, event: SocketEvent) {
        let Link::Server(connection) = &mut self.link else { return };
        if connection.session != session || !connection.open {
            return;
        }
        match event {
            SocketEvent::Opened => self.hello(ctx),
            SocketEvent::Message(bytes) => {
                self.receive(ctx, &bytes);
                self.keep_up_unseen(ctx);
            }
            SocketEvent::Closed { code } => {
                connection.open = false;
                self.closed(ctx, code);
            }
        }
    }

    /// Closes the socket as a broken network would; the page then reconnects.
    pub fn drop_socket(&mut self, ctx: &mut Context) {
        let Link::Server(connection) = &mut self.link else { return };
        if std::mem::take(&mut connection.open) {
            ctx.request(Effect::Disconnect { leaving: false });
            self.closed(ctx, BROKEN);
        }
    }

    /// Gives the seat up: the player left on purpose.
    pub fn leave(self, ctx: &mut Context) {
        if let Link::Server(_) = self.link {
            if !self.watches() {
                ctx.storage.set_secret(Secret::Seat, &self.code, None);
            }
            ctx.request(Effect::Disconnect { leaving: true });
        }
    }

    /// Ends the session as the server demands: for good, or until the cause has passed.
    pub(super) fn end(&mut self, ctx: &mut Context, refusal: Refusal) {
        if refusal == Refusal::BadToken {
            return self.join_again(ctx);
        }
        self.forget(ctx, refusal);
        let known_room = self.status.joined_ms.is_some();
        let notice = match refusal {
            Refusal::NoSuchRoom if known_room => Some(strings::ROOM_GONE),
            Refusal::RoomClosed if self.status.closes => Some(strings::CLOSED_BY_YOU),
            _ => strings::refused(refusal),
        };
        let Some(notice) = notice else {
            if refusal == Refusal::Closing {
                self.status.restarting = true;
            } else if let Link::Server(connection) = &mut self.link {
                connection.servers.moving();
                self.begin_to_move(ctx.now_ms);
            }
            return self.drop_socket(ctx);
        };
        self.status.notice = Some(notice);
        self.status.state = State::Refused;
        self.status.closing_ms = None;
    }

    /// Follows the room to another server: at once, unless that did not help the last time.
    pub(super) fn follow(&mut self, ctx: &mut Context, url: String) {
        self.begin_to_move(ctx.now_ms);
        let Link::Server(connection) = &mut self.link else { return };
        if connection.servers.moved(url) {
            return self.connect(ctx);
        }
        connection.open = false;
        connection.lost(ctx.now_ms, ctx.random());
        ctx.request(Effect::Disconnect { leaving: false });
    }

    /// The server does not play the room any more, and another one soon will.
    fn begin_to_move(&mut self, now_ms: f64) {
        if self.status.state == State::Playing {
            (self.status.state, self.status.moved_ms) = (State::Moving, now_ms);
        }
        self.status.closing_ms = None;
    }

    /// Forgets the secrets that a refusal makes worthless.
    fn forget(&self, ctx: &mut Context, refusal: Refusal) {
        let closed = matches!(refusal, Refusal::RoomClosed | Refusal::TooCostly);
        if closed || matches!(refusal, Refusal::Kicked | Refusal::GaveWay) {
            ctx.storage.set_secret(Secret::Seat, &self.code, None);
        }
        if closed || refusal == Refusal::NoSuchRoom {
            ctx.storage.set_secret(Secret::Host, &self.code, None);
        }
    }

    /// The seat is lost to this page: it silently asks for another at once.
    fn join_again(&mut self, ctx: &mut Context) {
        ctx.storage.set_secret(Secret::Seat, &self.code, None);
        if let Link::Server(connection) = &mut self.link {
            connection.open = false;
            connection.lost(ctx.now_ms, 0.0);
            connection.backoff.hurry();
            ctx.request(Effect::Disconnect { leaving: false });
        }
    }

    fn closed(&mut self, ctx: &mut Context, code: u16) {
        if let Link::Server(connection) = &mut self.link {
            connection.unproven_ms = None;
        }
        if self.status.state == State::Refused {
            return;
        }
        if let Some(refusal) = strings::refusal_of_close(code) {
            return self.end(ctx, refusal);
        }
        if self.status.state == State::Playing {
            self.show_loss();
        }
        // A server that announced it did close, even if its last message was lost.
        self.status.restarting |= self.status.closing_ms.take().is_some();
        if let Link::Server(connection) = &mut self.link {
            connection.servers.lost();
            connection.lost(ctx.now_ms, ctx.random());
        }
    }

    fn show_loss(&mut self) {
        self.status.state = State::Reconnecting;
        self.controls.release();
    }

    /// The notice to show while the page reconnects.
    pub fn loss(&self) -> Card {
        match (self.status.restarting, self.status.is_kept) {
            (true, true) => strings::BACK_SOON,
            (true, false) => strings::RESTARTING,
            (false, _) => strings::RECONNECTING,
        }
    }

    /// Attempts since the last good connection.
    pub fn attempts(&self) -> u32 {
        match &self.link {
            Link::Server(connection) => connection.backoff.attempts,
            Link::InPage(_) => 0,
        }
    }

    /// Gives up a silent socket, and opens a new one when that is due.
    pub fn keep_connected(&mut self, ctx: &mut Context) {
        match self.status.state {
            State::Refused => return,
            State::Moving if ctx.now_ms - self.status.moved_ms > MOVE_MS => self.show_loss(),
            _ => {}
        }
        // A link that died silently never reports its end. It is given up at the second check in a row: a page
        // that stood still itself gets what was sent meanwhile only after the first.
        if let Link::Server(connection) = &mut self.link {
            let silent = connection.is_silent(ctx.now_ms);
            if std::mem::replace(&mut connection.silent, silent) && silent {
                self.drop_socket(ctx);
            }
        }
        if let Link::Server(connection) = &mut self.link
            && connection.backoff.due(ctx.now_ms)
        {
            self.connect(ctx);
        }
    }

    /// Stops waiting for the next attempt: the network is back, or the player asked.
    pub fn hurry(&mut self) {
        if let Link::Server(connection) = &mut self.link {
            connection.backoff.hurry();
        }
    }
}
