//! A game's connection to its room: how it is opened, lost, retried and ended, and the game's current stage. A room in
//! the page is always connected.

use super::room_socket::{RoomSocket, Turn};
use crate::net::api::Request;
use crate::net::meter::{Meter, Traffic};
use crate::page::context::Context;
use crate::page::event::Effect;
use crate::page::plot::Plot;
use crate::page::storage::Secret;
use crate::page::strings::{self, Card};
use crate::world::room_in_page::RoomInPage;
use jostle_protocol::{
    Appearance, ClientMessage, ClipRefusal, DecodeError, Refusal, Role, VERSION,
};

/// How long a move to another server may take before it is shown as a lost connection, milliseconds.
const MOVE_MS: f64 = 1000.0;
/// Time after the welcome during which snapshots must be received before the connection counts as good, milliseconds. A
/// good connection that is lost is retried immediately; one that fails sooner is retried with growing delays.
const PROVEN_MS: f64 = 5000.0;
/// The number of attempts after which neither a WebSocket nor HTTP has opened, although the server answers requests.
const ATTEMPTS_BLOCKED: u32 = 3;
/// Interval between pings, milliseconds.
const PING_MS: f64 = 1000.0;
/// Interval between changes of the name or colour, milliseconds; a room drops those that come sooner than 2 s.
const LOOK_MS: f64 = 2500.0;
/// Interval between questions for the next room of a host, milliseconds.
const NEXT_MS: f64 = 3000.0;
/// Close code for a broken connection (RFC 6455).
const BROKEN: u16 = 1006;
/// The number of pulses in the connection plots.
const PULSES: usize = 60;

/// A game's connection to its room.
pub struct Connection {
    /// The room's code, as it appears in the link.
    pub code: String,
    /// Whether the page plays or only watches.
    pub role: Role,
    pub link: Link,
    /// The current stage of the game.
    pub status: Status,
    /// Measurements of the connection and of drawing.
    pub meter: Meter,
    /// Round trip and interpolation delay over the last few pulses, milliseconds.
    pub plots: [Plot; 2],
    appearance: Appearance,
    /// Whether the room does not know the name and colour yet.
    is_new_look: bool,
    looked_ms: f64,
    pinged_ms: f64,
}

impl Connection {
    /// A connection that is not open yet.
    pub fn new(ctx: &Context, code: &str, appearance: Appearance, link: Link) -> Connection {
        Connection {
            code: code.to_owned(),
            role: Role::Player,
            link,
            status: Status::default(),
            meter: Meter::default(),
            plots: [0, 1].map(|_| Plot::new(PULSES)),
            appearance,
            is_new_look: false,
            looked_ms: f64::NEG_INFINITY,
            pinged_ms: ctx.now_ms,
        }
    }

    /// Adds this moment to the plots, with the interpolation delay in milliseconds.
    pub fn plot(&mut self, delay_ms: f64) {
        let [trips, delays] = &mut self.plots;
        trips.push(self.meter.ping_ms.unwrap_or(0.0));
        delays.push(delay_ms);
    }

    /// The origin of the server that runs the room; empty for the page's own.
    pub fn server(&self) -> &str {
        match &self.link {
            Link::Server(socket) => socket.servers.current(),
            Link::InPage(_) => "",
        }
    }

    /// The room, if it is inside the page.
    pub fn room_in_page(&self) -> Option<&RoomInPage> {
        match &self.link {
            Link::Server(_) => None,
            Link::InPage(room) => Some(room),
        }
    }

    pub fn watches(&self) -> bool {
        self.role == Role::Spectator
    }

    /// Signal bars, 0..=4.
    pub fn bars(&self, now_ms: f64) -> u8 {
        match (&self.link, self.status.state) {
            (Link::Server(socket), State::Playing | State::Moving) => {
                self.meter.bars(now_ms - socket.heard_ms)
            }
            (Link::InPage(_), State::Playing | State::Frozen) => 4,
            _ => 0,
        }
    }

    /// Opens a new socket, replacing the old one.
    pub fn connect(&mut self, ctx: &mut Context) {
        let Link::Server(socket) = &mut self.link else { return };
        socket.session = ctx.next_number();
        socket.open = true;
        socket.has_opened = false;
        socket.opened_ms = ctx.now_ms;
        let path = format!("/{}", self.code);
        let RoomSocket { session, over_http, .. } = *socket;
        let origin = socket.servers.current().to_owned();
        ctx.request(Effect::Connect { path, session, origin, over_http });
        self.status.notice = None;
        if self.status.state == State::Refused {
            self.status.state = State::Connecting;
        }
    }

    /// Whether this session's socket is the current one; events from older sockets are ignored.
    pub fn is_open(&self, session: u32) -> bool {
        matches!(&self.link, Link::Server(socket) if socket.session == session && socket.open)
    }

    /// Closes the socket as a network failure would; the page then reconnects.
    pub fn drop_socket(&mut self, ctx: &mut Context) {
        let Link::Server(socket) = &mut self.link else { return };
        if std::mem::take(&mut socket.open) {
            ctx.request(Effect::Disconnect { leaving: false });
            self.closed(ctx, BROKEN);
        }
    }

    /// Handles an unreadable message. Later messages depend on it, so a new socket is opened, which starts with a
    /// keyframe.
    pub fn misunderstood(&mut self, ctx: &mut Context, why: &DecodeError) {
        ctx.request(Effect::Warn(format!("a message of the server cannot be read: {why}")));
        self.drop_socket(ctx);
    }

    /// Whether the server holds the seat while the player is away.
    pub fn keeps_seat(&self) -> bool {
        matches!(self.link, Link::Server(_)) && self.status.state != State::Refused
    }

    /// Gives up the seat because the player left on purpose.
    pub fn leave(self, ctx: &mut Context) {
        if let Link::Server(_) = self.link {
            if !self.watches() {
                ctx.storage.set_secret(Secret::Seat, &self.code, None);
            }
            ctx.request(Effect::Disconnect { leaving: true });
        }
    }

    /// Ends the session as the server demands, either for good or until the cause no longer applies.
    pub fn end(&mut self, ctx: &mut Context, refusal: Refusal) {
        match refusal {
            Refusal::BadToken => return self.join_again(ctx),
            // The hello came too late, because the page was still busy when the socket opened.
            Refusal::BadHello => return self.drop_socket(ctx),
            _ => {}
        }
        self.note_closed(ctx, refusal);
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
            } else if let Link::Server(socket) = &mut self.link {
                socket.servers.moving();
                self.begin_to_move(ctx.now_ms);
            }
            return self.drop_socket(ctx);
        };
        self.status.notice = Some(notice);
        self.status.state = State::Refused;
        self.status.closing_ms = None;
    }

    /// Follows the room to another server, immediately unless that failed the previous time.
    pub fn follow(&mut self, ctx: &mut Context, url: String) {
        self.begin_to_move(ctx.now_ms);
        let Link::Server(socket) = &mut self.link else { return };
        if socket.servers.moved(url) {
            return self.connect(ctx);
        }
        socket.open = false;
        socket.lost(ctx.now_ms, ctx.random());
        ctx.request(Effect::Disconnect { leaving: false });
    }

    /// Notes that the server no longer runs the room and that another one soon will.
    fn begin_to_move(&mut self, now_ms: f64) {
        if self.status.state == State::Playing {
            (self.status.state, self.status.moved_ms) = (State::Moving, now_ms);
        }
        self.status.closing_ms = None;
    }

    /// Prepares for the next room of the host who closed this one: the host opens it, others wait for it.
    fn note_closed(&mut self, ctx: &mut Context, refusal: Refusal) {
        if refusal != Refusal::RoomClosed {
            return;
        }
        let kind = if self.status.closes { Secret::Host } else { Secret::Seat };
        let secret = ctx.storage.secret(kind, &self.code).map(|token| token.text());
        match self.status.closes {
            true => ctx.closed = secret,
            false => self.status.awaits = secret.map(|secret| (secret, ctx.now_ms)),
        }
    }

    /// Asks now and then whether the host has opened another room.
    pub fn look_for_next(&mut self, ctx: &mut Context) {
        if let Some((token, asked_ms)) = &mut self.status.awaits
            && ctx.now_ms - *asked_ms >= NEXT_MS
        {
            *asked_ms = ctx.now_ms;
            ctx.request(Effect::Request(Request::Next(token.clone())));
        }
    }

    /// Offers to follow the host to this room.
    pub fn offer_next(&mut self, code: String) {
        if self.status.awaits.take().is_some() {
            self.status.notice = Some(strings::NEXT_ROOM);
            self.status.next = Some(code);
        }
    }

    /// Removes stored secrets that a refusal makes invalid.
    fn forget(&self, ctx: &mut Context, refusal: Refusal) {
        let closed = matches!(refusal, Refusal::RoomClosed | Refusal::TooCostly);
        // By the secret of a lost seat, a room recognises a player who was kicked.
        if closed || refusal == Refusal::GaveWay {
            ctx.storage.set_secret(Secret::Seat, &self.code, None);
        }
        if closed || refusal == Refusal::NoSuchRoom {
            ctx.storage.set_secret(Secret::Host, &self.code, None);
        }
    }

    /// Requests another seat immediately, because the page lost its seat.
    fn join_again(&mut self, ctx: &mut Context) {
        ctx.storage.set_secret(Secret::Seat, &self.code, None);
        if let Link::Server(socket) = &mut self.link {
            socket.open = false;
            socket.lost(ctx.now_ms, 0.0);
            socket.backoff.hurry();
            ctx.request(Effect::Disconnect { leaving: false });
        }
    }

    /// Handles the end of the socket, whether the server closed it or the network failed.
    pub fn closed(&mut self, ctx: &mut Context, code: u16) {
        if let Link::Server(socket) = &mut self.link {
            socket.open = false;
            socket.unproven_ms = None;
        }
        if self.status.state == State::Refused {
            return;
        }
        if let Some(refusal) = strings::refusal_of_close(code) {
            return self.end(ctx, refusal);
        }
        if self.status.state == State::Playing {
            self.status.state = State::Reconnecting;
        }
        // A server that announced its shutdown did shut down, even if its last message was lost.
        self.status.restarting |= self.status.closing_ms.take().is_some();
        if let Link::Server(socket) = &mut self.link {
            let turn = socket.turn();
            socket.servers.lost();
            socket.lost(ctx.now_ms, ctx.random());
            match turn {
                Turn::None => {}
                // If the server answers this, something on the way blocks WebSockets only.
                Turn::Ask => ctx.request(Effect::Request(Request::Rooms)),
                Turn::Http => socket.backoff.hurry(),
            }
        }
    }

    /// Notes that the server has answered a request other than the socket's.
    pub fn answered(&mut self) {
        self.status.blocked = self.attempts() >= ATTEMPTS_BLOCKED;
        if let Link::Server(socket) = &mut self.link {
            socket.is_answered = !socket.has_opened && socket.backoff.attempts > 0;
        }
    }

    /// The notice to show while the page reconnects.
    pub fn loss(&self) -> Card {
        match (self.status.restarting, self.status.is_kept) {
            (true, true) => strings::BACK_SOON,
            (true, false) => strings::RESTARTING,
            (false, _) => strings::RECONNECTING,
        }
    }

    /// Number of attempts since the last good connection.
    pub fn attempts(&self) -> u32 {
        match &self.link {
            Link::Server(socket) => socket.backoff.attempts,
            Link::InPage(_) => 0,
        }
    }

    /// Abandons a silent socket, and opens a new one when an attempt is due.
    pub fn keep_connected(&mut self, ctx: &mut Context) {
        match self.status.state {
            State::Refused => return,
            State::Moving if ctx.now_ms - self.status.moved_ms > MOVE_MS => {
                self.status.state = State::Reconnecting;
            }
            _ => {}
        }
        // A connection that died silently never reports its end. It is abandoned only at the second silent check in a
        // row, because a page that was suspended receives pending messages only after the first check.
        if let Link::Server(socket) = &mut self.link {
            let silent = socket.is_silent(ctx.now_ms);
            if std::mem::replace(&mut socket.silent, silent) && silent {
                self.drop_socket(ctx);
            }
        }
        if let Link::Server(socket) = &mut self.link
            && socket.backoff.due(ctx.now_ms)
        {
            self.connect(ctx);
        }
    }

    /// Skips the wait for the next attempt, because the network is back or the player asked for it.
    pub fn hurry(&mut self) {
        if let Link::Server(socket) = &mut self.link {
            socket.backoff.hurry();
        }
    }

    pub fn hello(&mut self, ctx: &mut Context) {
        let mut secrets = (None, None);
        (self.status.blocked, self.is_new_look) = (false, false);
        if let Link::Server(socket) = &mut self.link {
            socket.heard_ms = ctx.now_ms;
            (socket.has_opened, socket.is_answered) = (true, false);
            if ctx.storage.keep_over_http(socket.over_http) && socket.over_http {
                self.status.over_http_ms = Some(ctx.now_ms);
            }
        }
        if self.room_in_page().is_none() && !self.watches() {
            secrets = (
                ctx.storage.secret(Secret::Seat, &self.code),
                ctx.storage.secret(Secret::Host, &self.code),
            );
        }
        let (token, host_key) = secrets;
        let appearance = self.appearance.clone();
        let (version, role) = (VERSION, self.role);
        self.send(ctx, &ClientMessage::Hello { version, appearance, token, host_key, role });
    }

    /// Asks for another name and colour: now, or as soon as the room allows another change.
    pub fn wear(&mut self, ctx: &mut Context, appearance: Appearance) {
        self.is_new_look |= self.appearance != appearance;
        self.appearance = appearance;
        self.send_look(ctx);
    }

    /// Sends the name and colour if they have changed and the last change was long enough ago.
    pub fn send_look(&mut self, ctx: &mut Context) {
        let rests = ctx.now_ms - self.looked_ms < LOOK_MS;
        if self.is_new_look && !rests && self.status.state == State::Playing && !self.watches() {
            (self.is_new_look, self.looked_ms) = (false, ctx.now_ms);
            let appearance = self.appearance.clone();
            self.send(ctx, &ClientMessage::Look { appearance });
        }
    }

    /// Shows an emote to everyone.
    pub fn emote(&mut self, ctx: &mut Context, emote: u8) {
        self.send(ctx, &ClientMessage::Emote { emote });
    }

    /// Saves the last few seconds on the server, or as a file if the room is in the page.
    pub fn keep_clip(&mut self, ctx: &mut Context) {
        match &self.link {
            Link::Server(_) if self.status.state != State::Playing => {}
            Link::Server(_) if self.watches() => {
                self.status.clip = Some((ctx.now_ms, Err(strings::CLIP_OF_SPECTATOR)));
            }
            Link::Server(_) => self.send(ctx, &ClientMessage::Clip),
            Link::InPage(room) => {
                let file = room.clip();
                let failed = strings::no_clip(ClipRefusal::Failed);
                let kept = file.as_ref().map(|_| String::new()).ok_or(failed);
                self.status.clip = Some((ctx.now_ms, kept));
                ctx.effects.extend(file.map(Effect::SaveClip));
            }
        }
    }

    /// Sends a message if the connection is open.
    pub fn send(&mut self, ctx: &mut Context, message: &ClientMessage) {
        let bytes = message.encode();
        let traffic = match message {
            ClientMessage::Input { .. } => Traffic::Input,
            _ => Traffic::Question,
        };
        self.meter.carried(ctx.now_ms, traffic, bytes.len());
        match &mut self.link {
            Link::Server(socket) if socket.open => ctx.request(Effect::Send(bytes)),
            Link::Server(_) => {}
            Link::InPage(room) => room.receive(&bytes),
        }
    }

    /// Called for every snapshot. After enough time, the connection is considered good.
    pub fn prove(&mut self, now_ms: f64) {
        let Link::Server(socket) = &mut self.link else { return };
        if socket.unproven_ms.take_if(|since| now_ms - *since >= PROVEN_MS).is_some() {
            socket.backoff.reset();
        }
    }

    /// Whether it is time for a ping.
    pub fn is_ping_due(&self, now_ms: f64) -> bool {
        now_ms - self.pinged_ms >= PING_MS
    }

    pub fn ping(&mut self, ctx: &mut Context) {
        self.pinged_ms = ctx.now_ms;
        self.send(ctx, &ClientMessage::Ping { stamp: ctx.now_ms as u32 });
    }
}

pub enum Link {
    Server(RoomSocket),
    InPage(Box<RoomInPage>),
}

/// The stage of a game, as given in `data-state`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Waiting for the first seat.
    #[default]
    Connecting,
    Playing,
    /// Another server continues the room; the picture freezes for a moment.
    Moving,
    /// The socket was lost; the world remains visible.
    Reconnecting,
    /// The session ended; a notice says why.
    Refused,
    /// A scripted demo is frozen at its end.
    Frozen,
}

impl State {
    /// The value of `data-state`.
    pub fn name(self) -> &'static str {
        match self {
            State::Connecting => "connecting",
            State::Playing => "playing",
            State::Moving => "moving",
            State::Reconnecting => "reconnecting",
            State::Refused => "refused",
            State::Frozen => "frozen",
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Status {
    pub state: State,
    /// Why the session ended, if it did.
    pub notice: Option<Card>,
    /// Whether the server answers requests while the first socket does not open.
    pub blocked: bool,
    /// The time at which the first connection over HTTP opened in this tab.
    pub over_http_ms: Option<f64>,
    /// The time at which the first seat was taken.
    pub joined_ms: Option<f64>,
    /// The time at which the room started to move to another server.
    pub moved_ms: f64,
    /// The duration of a tick that was too long, milliseconds. The game has been paused since then.
    pub stalled_ms: Option<f64>,
    /// The time at which the server will shut down.
    pub closing_ms: Option<f64>,
    /// The server shut down; the page retries until it is back.
    pub restarting: bool,
    /// Whether the room continues after the restart.
    pub is_kept: bool,
    /// Whether the server accepted this player as the room's host.
    pub host: bool,
    /// Whether the player closed the room.
    pub closes: bool,
    /// The player's secret in a room that its host closed, and when the page last asked for the next room.
    pub awaits: Option<(String, f64)>,
    /// Code of the room that the host opened next.
    pub next: Option<String>,
    /// The time at which the room last denied a request that only a host may make.
    pub denied_ms: Option<f64>,
    /// The time and result of the last clip request: the clip's name, empty for a local file, or a sentence that
    /// explains the failure.
    pub clip: Option<(f64, Result<String, &'static str>)>,
}
