//! One game on the page: the link to its room, the copy of the room, time, intent and view. It
//! decides nothing about the world; it moves bytes in and frames out.

use super::dom;
use super::profile;
use super::socket::{Socket, SocketEvent};
use crate::camera::{Camera, Target};
use crate::clock::{Clock, TICK_MS};
use crate::demo::Demo;
use crate::frame::{Frame, View};
use crate::input::{Controls, Outflow};
use crate::meter::{Meter, Traffic};
use crate::predict::Predictor;
use crate::reconnect::Backoff;
use crate::replica::{Eye, Replica};
use crate::words::{self, Notice};
use jostle_protocol::limits::VIEW_MAX;
use jostle_protocol::{
    Appearance, ClientMessage, DecodeError, Refusal, ServerMessage, Snapshot, Token, VERSION,
};
use jostle_sim::scene::Camera as CameraRule;
use jostle_sim::{Scene, Seat, TICKS_PER_SECOND, Tools, Vec2};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// A socket that says nothing for so long is given up, milliseconds.
const SILENCE_MS: f64 = 6000.0;
/// Milliseconds between two pings.
const PING_MS: f64 = 1000.0;
/// The view before the first frame.
const UNSEEN: View = View { center: Vec2::ZERO, height: 1.0, pixels: [1, 1] };
/// A connection whose snapshots were read for so long after the welcome is good, milliseconds:
/// the next loss is answered at once. One that fails sooner is retried ever more slowly.
const PROVEN_MS: f64 = 5000.0;
/// Without a frame for so long the page is hidden: messages move the display then.
const UNSEEN_MS: f64 = 500.0;
/// Copies of rooms so far, of all games on this page.
static COPIES: AtomicU32 = AtomicU32::new(0);

/// What the page is doing, as `data-state` says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Waiting for the first seat.
    Connecting,
    /// Seated.
    Playing,
    /// The socket was lost; the world stays on view.
    Reconnecting,
    /// The session ended; a notice says why.
    Refused,
    /// A scripted demo stands still.
    Frozen,
}

impl State {
    /// The value of `data-state`.
    pub fn name(self) -> &'static str {
        match self {
            State::Connecting => "connecting",
            State::Playing => "playing",
            State::Reconnecting => "reconnecting",
            State::Refused => "refused",
            State::Frozen => "frozen",
        }
    }
}

/// The other end.
enum Link {
    /// A room on the server.
    Server { socket: Option<Socket>, backoff: Backoff, generation: u32 },
    /// A room in the page.
    Demo(Box<Demo>),
}

/// One game.
pub struct Play {
    /// The word in the room's link.
    pub code: String,
    /// What the player is to be told, if the session ended.
    pub notice: Option<Notice>,
    /// Keys, pointer and thumbs.
    pub controls: Controls,
    /// Figures.
    pub meter: Meter,
    /// The bounds view was switched from the scene's own choice.
    pub bounds_toggled: bool,
    /// When the first seat was taken.
    pub joined_ms: Option<f64>,
    /// When the server will close.
    pub closing_ms: Option<f64>,
    /// The server closed, and is tried until it is back.
    restarting: bool,
    appearance: Appearance,
    state: State,
    link: Link,
    replica: Option<Replica>,
    /// Number of the replica.
    copy: u32,
    clock: Clock,
    outflow: Outflow,
    /// The own hero before the server's word, where the player steers one and wants that.
    predictor: Option<Predictor>,
    camera: Option<Camera>,
    view: View,
    /// Width and height of the view that the room was told.
    told_view: Option<Vec2>,
    heard_ms: f64,
    pinged_ms: f64,
    framed_ms: f64,
    opened_ms: f64,
    /// When the welcome came, while the connection is not known to be good.
    unproven_ms: Option<f64>,
    /// Tick of the welcome.
    welcomed_tick: u32,
}

/// What a frame is drawn on, device pixels.
#[derive(Clone, Copy, Debug)]
pub struct Canvas {
    /// Width and height, neither zero.
    pub pixels: [u32; 2],
    /// The part at the bottom that the hud covers.
    pub bottom: u32,
}

/// Frames are drawn with this.
pub struct Picture<'a> {
    /// The copy of the room.
    pub replica: &'a Replica,
    /// What to draw.
    pub frame: Frame<'a>,
}

impl Play {
    /// A game in a room of the server. `report` is told what the socket of a generation does.
    pub fn join(
        code: &str,
        appearance: Appearance,
        report: impl Fn(u32, SocketEvent) + Clone + 'static,
    ) -> Play {
        let backoff = Backoff::default();
        let mut play =
            Play::new(code, appearance, Link::Server { socket: None, backoff, generation: 0 });
        play.connect(report);
        play
    }

    /// A game in a room of the page.
    pub fn demo(demo: Demo, appearance: Appearance) -> Play {
        let mut play = Play::new("demo", appearance, Link::Demo(Box::new(demo)));
        play.hello();
        play
    }

    fn new(code: &str, appearance: Appearance, link: Link) -> Play {
        let now = dom::now_ms();
        Play {
            code: code.to_owned(),
            notice: None,
            controls: Controls::default(),
            meter: Meter::default(),
            bounds_toggled: false,
            joined_ms: None,
            closing_ms: None,
            restarting: false,
            appearance,
            state: State::Connecting,
            link,
            replica: None,
            copy: 0,
            clock: Clock::default(),
            outflow: Outflow::default(),
            predictor: None,
            camera: None,
            view: UNSEEN,
            told_view: None,
            heard_ms: now,
            pinged_ms: now,
            framed_ms: now,
            opened_ms: now,
            unproven_ms: None,
            welcomed_tick: 0,
        }
    }

    /// What the page is doing.
    pub fn state(&self) -> State {
        self.state
    }

    /// The copy of the room, once there is one.
    pub fn replica(&self) -> Option<&Replica> {
        self.replica.as_ref()
    }

    /// The copy of the room, to take its news.
    pub fn replica_mut(&mut self) -> Option<&mut Replica> {
        self.replica.as_mut()
    }

    /// Time as this game sees it.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The view of the last frame.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Whether the room is in the page.
    pub fn is_demo(&self) -> bool {
        matches!(self.link, Link::Demo(_))
    }

    /// Digest of the whole state of a room in the page.
    pub fn state_hash(&self) -> Option<u64> {
        match &self.link {
            Link::Server { .. } => None,
            Link::Demo(demo) => Some(demo.state_hash()),
        }
    }

    /// Milliseconds since the other end was last heard.
    pub fn silence_ms(&self, now_ms: f64) -> f64 {
        now_ms - self.heard_ms
    }

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

    fn hello(&mut self) {
        let appearance = self.appearance.clone();
        let token = profile::seat_token(&self.code).filter(|_| !self.is_demo());
        self.heard_ms = dom::now_ms();
        let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key: None };
        self.send(&hello);
    }

    fn send(&mut self, message: &ClientMessage) {
        let bytes = message.encode();
        let traffic = match message {
            ClientMessage::Input { .. } => Traffic::Input,
            _ => Traffic::Question,
        };
        self.meter.carried(dom::now_ms(), traffic, bytes.len());
        match &mut self.link {
            Link::Server { socket, .. } => {
                if let Some(socket) = socket {
                    socket.send(&bytes);
                }
            }
            Link::Demo(demo) => demo.receive(&bytes),
        }
    }

    fn receive(&mut self, bytes: &[u8], now_ms: f64) {
        self.heard_ms = now_ms;
        let message = ServerMessage::decode(bytes);
        self.meter.carried(now_ms, traffic_of(&message), bytes.len());
        match message {
            Ok(ServerMessage::Snapshot(coded)) => self.file(&coded, now_ms),
            Ok(ServerMessage::Welcome { seat, token, tick, room, scene_name, scene, .. }) => {
                match Scene::parse(&format!("{scene_name}.toml"), &scene) {
                    Ok(scene) => {
                        self.welcomed_tick = tick;
                        self.welcome(Arc::new(scene), Seat(seat), token, room);
                    }
                    Err(error) => {
                        dom::warn(&format!("the server's scene: {error}"));
                        self.end(Refusal::Version);
                    }
                }
            }
            Ok(ServerMessage::Refused { refusal }) => self.end(refusal),
            Ok(ServerMessage::Draining { seconds }) => {
                self.closing_ms = Some(now_ms + f64::from(seconds) * 1000.0);
            }
            Ok(ServerMessage::Pong { stamp, .. }) => {
                self.meter.ponged(f64::from(stamp), now_ms.floor());
            }
            Ok(ServerMessage::Denied) => dom::warn("only the host of a room may do that"),
            Err(error) => self.misunderstood(&error.to_string()),
        }
    }

    fn welcome(&mut self, scene: Arc<Scene>, seat: Seat, token: Token, room: String) {
        if !self.is_demo() {
            profile::set_seat_token(&self.code, Some(token));
        }
        self.unproven_ms = Some(dom::now_ms());
        let world = scene.size;
        let same = self.replica.as_ref().is_some_and(|old| old.scene.source == scene.source);
        match &mut self.camera {
            // The view stays, for the pointer's sake, and jumps with the first snapshot.
            Some(camera) if same => camera.cut(),
            camera => *camera = Some(Camera::new(scene.camera, world)),
        }
        self.replica = Some(Replica::new(scene, seat, room));
        self.predictor = None;
        self.set_prediction(profile::predicts());
        self.copy = COPIES.fetch_add(1, Ordering::Relaxed) + 1;
        self.clock = Clock::default();
        self.outflow = Outflow::default();
        self.told_view = None;
        self.closing_ms = None;
        self.restarting = false;
        self.joined_ms.get_or_insert(dom::now_ms());
        self.state = State::Playing;
    }

    fn file(&mut self, coded: &[u8], now_ms: f64) {
        let Some(replica) = &mut self.replica else { return };
        match replica.hear(coded) {
            Ok((arrival, emitters)) => {
                self.clock.arrived(arrival, now_ms);
                if let (Some(predictor), (Some(newest), before)) =
                    (&mut self.predictor, replica.newest_two())
                {
                    predictor.heard(newest, before);
                }
                self.meter.snapshot(&Snapshot::section_names(coded).unwrap_or_default(), emitters);
                self.prove(now_ms);
            }
            Err(error) => self.misunderstood(&error.to_string()),
        }
    }

    /// A snapshot was read: after some time of that the connection is good.
    fn prove(&mut self, now_ms: f64) {
        let proven = self.unproven_ms.take_if(|since| now_ms - *since >= PROVEN_MS).is_some();
        if let Link::Server { backoff, .. } = &mut self.link
            && proven
        {
            backoff.reset();
        }
    }

    /// What cannot be read cannot be built upon: a new socket gets a keyframe.
    fn misunderstood(&mut self, why: &str) {
        dom::warn(&format!("a message of the server cannot be read: {why}"));
        self.drop_socket();
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
    fn end(&mut self, refusal: Refusal) {
        if refusal == Refusal::BadToken {
            return self.join_anew();
        }
        let known_room = self.joined_ms.is_some();
        let notice = match refusal {
            Refusal::NoSuchRoom if known_room => Some(words::ROOM_GONE),
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

    /// The seat is lost to this page: it asks for another at once, and says nothing of it.
    fn join_anew(&mut self) {
        profile::set_seat_token(&self.code, None);
        if let Link::Server { socket, backoff, .. } = &mut self.link {
            *socket = None;
            backoff.lost(dom::now_ms(), 0.0);
            backoff.hurry();
        }
    }

    fn closed(&mut self, code: u16) {
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

    /// Sends what is due: an input, a ping.
    pub fn speak(&mut self, now_ms: f64) {
        if self.state != State::Playing {
            return;
        }
        self.outflow.note(self.controls.input(&self.view));
        let moment = self.next_moment(now_ms);
        while let Some((seq, input)) = self.outflow.due(now_ms, moment) {
            let heard = self.heard();
            self.send(&ClientMessage::Input { seq, heard, input });
            if let (Some(predictor), Some(tick)) =
                (&mut self.predictor, self.clock.server_tick(now_ms))
            {
                predictor.sent(seq, input, tick, now_ms);
            }
        }
        let pings = now_ms - self.pinged_ms >= PING_MS;
        if pings || self.told_view.is_none() {
            self.tell_view();
        }
        if pings {
            self.pinged_ms = now_ms;
            self.send(&ClientMessage::Ping { stamp: now_ms as u32 });
        }
    }

    /// Low bits of the newest tick of which a snapshot was read.
    fn heard(&self) -> u16 {
        let newest = self.replica.as_ref().and_then(|replica| replica.newest());
        newest.map_or(self.welcomed_tick, |newest| newest.tick) as u16
    }

    /// In the tick after this moment an input of now is played; without a prediction its phase is
    /// a guess.
    fn next_moment(&mut self, now_ms: f64) -> f64 {
        let tick = self.clock.server_tick(now_ms).unwrap_or(now_ms / TICK_MS);
        let Some(predictor) = &self.predictor else { return tick };
        self.outflow.book_until(predictor.booked());
        predictor.moment_at(tick, now_ms)
    }

    /// The room is told how much of the world is shown, if that depends on the screen.
    fn tell_view(&mut self) {
        let scene = self.replica.as_ref().map(|replica| &replica.scene);
        let follows = scene.is_some_and(|scene| matches!(scene.camera, CameraRule::Follow { .. }));
        if !follows || self.view.pixels == UNSEEN.pixels {
            return;
        }
        let [width, height] = self.view.pixels.map(|pixels| pixels as f32);
        let size = Vec2::new(width, height) * self.view.unit_per_pixel();
        let size = size.min(Vec2::splat(VIEW_MAX));
        if self.told_view != Some(size) {
            self.told_view = Some(size);
            self.send(&ClientMessage::View { size });
        }
    }

    /// Browsers stop the frames of a hidden page but not its messages: they keep the copy new, the
    /// pings going, and the way back short.
    fn keep_up_unseen(&mut self, now_ms: f64) {
        if now_ms - self.framed_ms < UNSEEN_MS {
            return;
        }
        self.speak(now_ms);
        self.move_display(now_ms);
    }

    fn move_display(&mut self, now_ms: f64) {
        let eye = self.eye();
        if let (Some(replica), Some(tick)) = (&mut self.replica, self.clock.display(now_ms)) {
            replica.advance(tick, eye);
        }
        let (Some(replica), Some(predictor)) = (&mut self.replica, &mut self.predictor) else {
            return;
        };
        let tick = self.clock.server_tick(now_ms);
        let own = tick.and_then(|tick| predictor.advance(tick, now_ms, |id| replica.place(id)));
        if let Some(own) = own {
            replica.lead(own);
        }
    }

    /// Begins or ends to show the own hero before the server's word. A room in the page needs none.
    pub fn set_prediction(&mut self, wanted: bool) {
        let predictor = match &self.replica {
            Some(replica) if wanted && !self.is_demo() => {
                Predictor::new(&replica.scene, replica.seat)
            }
            _ => None,
        };
        if predictor.is_some() != self.predictor.is_some() {
            self.predictor = predictor;
        }
    }

    /// What shows the own hero before the server's word, if anything does.
    pub fn predictor(&self) -> Option<&Predictor> {
        self.predictor.as_ref()
    }

    fn eye(&self) -> Eye {
        Eye { pointer: self.controls.pointer(&self.view), bounds: self.bounds() }
    }

    /// Whether bounds are drawn: always where bodies are selected by them, else on demand.
    pub fn bounds(&self) -> bool {
        let own = self.replica.as_ref().is_some_and(|r| r.scene.tools.contains(Tools::SELECT));
        own != self.bounds_toggled
    }

    /// Brings everything to `now_ms` on a canvas: room in the page, display, camera, intent.
    pub fn advance(&mut self, now_ms: f64, canvas: Option<Canvas>) {
        let elapsed_s = ((now_ms - self.framed_ms) / 1000.0).clamp(0.0, 0.25) as f32;
        self.framed_ms = now_ms;
        if self.state != State::Frozen {
            if let Link::Demo(demo) = &mut self.link {
                demo.advance(now_ms);
            }
            self.hear_demo(now_ms);
            self.move_display(now_ms);
        }
        self.look(canvas, elapsed_s);
        self.speak(now_ms);
    }

    fn hear_demo(&mut self, now_ms: f64) {
        let Link::Demo(demo) = &mut self.link else { return };
        for bytes in demo.take() {
            self.receive(&bytes, now_ms);
        }
    }

    fn look(&mut self, canvas: Option<Canvas>, elapsed_s: f32) {
        let (Some(canvas), Some(camera)) = (canvas, &mut self.camera) else { return };
        let hero = self.replica.as_ref().and_then(|replica| replica.own_hero());
        let hero = hero.map(|hero| (hero.center, hero.velocity));
        let Canvas { pixels, bottom } = canvas;
        self.view = camera.view(Target { pixels, hero, bottom, elapsed_s });
    }

    /// Plays a scripted demo to its end as fast as it goes, and stands still there.
    pub fn freeze_at(&mut self, ticks: u32) {
        self.hear_demo(0.0);
        for _ in 0..ticks.max(1) {
            let Link::Demo(demo) = &mut self.link else { return };
            demo.tick();
            self.hear_demo(0.0);
            let eye = Eye { pointer: None, bounds: self.bounds() };
            if let Some(replica) = &mut self.replica
                && let Some(tick) = replica.newest().map(|snapshot| snapshot.tick)
            {
                replica.advance(f64::from(tick), eye);
            }
        }
        self.state = State::Frozen;
    }

    /// What to draw now, or `None` before the first snapshot. `time` is the page's age in seconds.
    pub fn picture(&self, time: f32, calm: bool) -> Option<Picture<'_>> {
        let replica = self.replica.as_ref().filter(|replica| replica.newest().is_some())?;
        let frozen = self.state == State::Frozen;
        let tick_s = (replica.display() / f64::from(TICKS_PER_SECOND)) as f32;
        let frame = Frame {
            view: self.view,
            world_size: replica.scene.size,
            bodies: replica.bodies(),
            particles: replica.particles(),
            recipes: &replica.scene.recipes,
            particle_lead: if frozen { 0.0 } else { replica.particle_lead() },
            effects: replica.effects(),
            time: if frozen { tick_s } else { time },
            bounds: self.bounds(),
            calm,
            own_seat: Some(replica.seat),
            pointer: if frozen { None } else { self.controls.pointer(&self.view) },
            copy: self.copy,
            dimmed: !matches!(self.state, State::Playing | State::Frozen),
        };
        Some(Picture { replica, frame })
    }
}

fn traffic_of(message: &Result<ServerMessage, DecodeError>) -> Traffic {
    let Ok(ServerMessage::Snapshot(coded)) = message else { return Traffic::Answer };
    let sections = Snapshot::section_names(coded).unwrap_or_default();
    if sections.contains(&"keyframe") { Traffic::Keyframe } else { Traffic::Snapshot }
}
