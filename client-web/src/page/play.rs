//! One game on the page: the link to its room, the copy of the room, time, intent and view. It
//! decides nothing about the world; it moves bytes in and frames out.

mod heard;
mod link;
mod said;

use super::dom;
use super::socket::SocketEvent;
use crate::camera::{Camera, Target};
use crate::clock::Clock;
use crate::demo::Demo;
use crate::frame::{Frame, View};
use crate::input::{Controls, Outflow};
use crate::meter::Meter;
use crate::predict::Predictor;
use crate::reconnect::Backoff;
use crate::replica::{Eye, Replica};
use crate::words::Notice;
use jostle_protocol::Appearance;
use jostle_sim::scene::Camera as CameraRule;
use jostle_sim::{TICKS_PER_SECOND, Tools, Vec2};
use link::Link;
use std::sync::atomic::AtomicU32;

/// The view before the first frame.
const UNSEEN: View = View { center: Vec2::ZERO, height: 1.0, pixels: [1, 1] };
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
    /// The server took this page for the room's host.
    host: bool,
    /// The player closed the room.
    closes: bool,
    /// The room did not do what only a host may ask for.
    denied: bool,
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
            host: false,
            closes: false,
            denied: false,
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

    /// Whether the player is the room's host.
    pub fn is_host(&self) -> bool {
        self.host
    }

    /// Whether the room refused what only a host may ask for; says so once.
    pub fn take_denied(&mut self) -> bool {
        std::mem::take(&mut self.denied)
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
        let hero = self.replica.as_ref().and_then(|replica| match replica.scene.camera {
            // No more than what is around the server's hero is sent.
            CameraRule::Follow { .. } => replica.own_hero_as_told(),
            CameraRule::Fit => replica.own_hero().map(|hero| (hero.center, hero.velocity)),
        });
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
