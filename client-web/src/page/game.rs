//! One game on the page: the connection to its room, the replica of the room, time, input and view. It makes no
//! decisions about the world, but only turns messages into frames and input into messages.

pub mod connection;
mod controls;
mod highlights;
pub mod input;
pub mod membership;
mod messages;
mod room_socket;

use crate::net::clock::TICK_MS;
use crate::net::report::Fetched;
use crate::page::address::PlayOptions;
use crate::page::context::Context;
use crate::page::dialogs::Question;
use crate::page::edit_screen::EditScreen;
use crate::page::emotes::ShownEmotes;
use crate::page::event::{Canvas, Effect, Event};
use crate::sound::cue::Cue;
use crate::view::camera::{Target, begins_with_a_hero};
use crate::view::frame::{Frame, FrameBody, View};
use crate::world::ghost::{Ghost, GhostWish};
use crate::world::replica::{Eye, Replica};
use crate::world::room_in_page::{DemoRequest, RoomInPage};
use connection::{Connection, Link, State};
use highlights::Showing;
use input::GameInput;
use jostle_game::{RoundPhase, Scene, Seat};
use jostle_protocol::{Appearance, ClientMessage, Role};
use jostle_sim::TICKS_PER_SECOND;
use membership::{GameView, RoomMembership};
use room_socket::RoomSocket;
use std::sync::Arc;

/// The code of an in-page room that is played alone; any other in-page room is a demo.
const ALONE: &str = "alone";

/// Time for one frame's ticks above which an in-page game pauses and asks the player, milliseconds. A tab that is
/// blocked for much longer is hard to close.
const STALL_MS: f64 = 1000.0;

/// Maximum time per frame for playing a ghost, milliseconds.
const GHOST_MS: f64 = 4.0;

/// The time spent on a frame's ticks, if it is too long to continue without asking.
pub fn stalled(taken_ms: f64) -> Option<f64> {
    Some(taken_ms).filter(|taken_ms| *taken_ms > STALL_MS)
}

/// The ghost of a run next to the player's hero.
enum GhostSlot {
    /// The ghost's replay is being fetched from this address.
    Pending(GhostWish, String),
    Here(Box<Ghost>),
}

impl GhostSlot {
    /// Advances the ghost to the displayed moment.
    fn advance(&mut self, replica: &Replica, clock: fn() -> f64) {
        if let GhostSlot::Here(ghost) = self {
            let until_ms = clock() + GHOST_MS;
            ghost.advance(replica.room.round(), replica.room.display, || clock() < until_ms);
        }
    }
}

/// The player whom a spectator follows.
#[derive(Default)]
pub struct Followed {
    pub seat: Option<Seat>,
    /// Whether `followed` was chosen, by the spectator or because of the screen size.
    has_chosen: bool,
}

impl Followed {
    /// Starts with the best player if the whole scene would look tiny, and chooses again when the followed player
    /// leaves.
    fn choose(&mut self, replica: &Replica, pixels: [u32; 2]) {
        let is_here = |seat| replica.room.players().iter().any(|player| player.seat == seat);
        if self.has_chosen && self.seat.is_none_or(is_here) {
            return;
        }
        let Some(best) = replica.room.ranking().into_iter().next() else { return };
        self.seat = Some(best.seat).filter(|_| begins_with_a_hero(&replica.room.scene, pixels));
        self.has_chosen = true;
    }
}

pub struct GameScreen {
    pub connection: Connection,
    pub input: GameInput,
    pub emotes: ShownEmotes,
    /// The seat and the room's state, once the welcome has arrived.
    pub membership: Option<RoomMembership>,
    /// The ghost in a game played alone.
    ghost: Option<GhostSlot>,
    /// The highlights, while they are shown instead of the room.
    pub showing: Option<Showing>,
    /// The end of the last round whose highlights began by themselves or were asked for.
    shown_end: Option<u32>,
    view: GameView,
    pub followed: Followed,
    /// The editor whose scene is being played.
    pub edited: Option<Box<EditScreen>>,
}

impl GameScreen {
    /// A game in a room on the server, with or without a seat.
    pub fn join(ctx: &mut Context, code: &str, appearance: Appearance, role: Role) -> GameScreen {
        let link = Link::Server(RoomSocket::new(ctx.now_ms, ctx.storage.over_http()));
        let mut game = GameScreen::new(ctx, code, appearance, link);
        game.connection.role = role;
        game.connection.connect(ctx);
        game
    }

    /// A game played alone, in a room inside the page.
    pub fn alone(
        ctx: &mut Context,
        scene: Arc<Scene>,
        wish: PlayOptions,
        appearance: Appearance,
    ) -> GameScreen {
        let bots = wish.bots_in(&scene);
        let ghost = wish.ghost.map(|ghost| (ghost, ghost.file(&scene.name)));
        let room = RoomInPage::alone(scene, wish.seed.unwrap_or(1), bots);
        let link = Link::InPage(Box::new(room));
        let mut game = GameScreen::new(ctx, ALONE, appearance, link);
        game.connection.hello(ctx);
        if let Some((ghost, file)) = ghost.filter(|_| !ctx.site.is_static) {
            ctx.request(Effect::FetchReplay(file.clone()));
            game.ghost = Some(GhostSlot::Pending(ghost, file));
        }
        game
    }

    /// A demo, which may be frozen for a screenshot.
    pub fn demo(
        ctx: &mut Context,
        scene: Arc<Scene>,
        request: &DemoRequest,
        appearance: Appearance,
    ) -> GameScreen {
        let frozen = request.ticks.is_some();
        let room = RoomInPage::new(scene, request.seed, request.bots, frozen);
        // A frozen picture must not depend on the player.
        let neutral = || Appearance { name: "Jo".into(), color: 0 };
        let appearance = if frozen { neutral() } else { appearance };
        let link = Link::InPage(Box::new(room));
        let mut game = GameScreen::new(ctx, "demo", appearance, link);
        game.connection.hello(ctx);
        if let Some(ticks) = request.ticks {
            game.freeze_at(ctx, ticks);
        }
        game
    }

    fn new(ctx: &Context, code: &str, appearance: Appearance, link: Link) -> GameScreen {
        GameScreen {
            connection: Connection::new(ctx, code, appearance, link),
            input: GameInput::default(),
            emotes: ShownEmotes::default(),
            membership: None,
            ghost: None,
            showing: None,
            shown_end: None,
            view: GameView::new(ctx.now_ms),
            followed: Followed::default(),
            edited: None,
        }
    }

    /// Handles an event that concerns only the game.
    pub fn update(&mut self, ctx: &mut Context, event: Event) {
        let was_lost = self.connection.status.state == State::Reconnecting;
        match event {
            Event::Pulse { hidden } => {
                if !hidden {
                    self.connection.look_for_next(ctx);
                }
                if let Some(membership) = &self.membership {
                    self.connection.plot(membership.clock.delay_ticks() * TICK_MS);
                }
                self.connection.keep_connected(ctx);
                self.connection.send_look(ctx);
            }
            Event::Drawn(true) => self.connection.meter.drawn(ctx.now_ms),
            Event::Online => self.connection.hurry(),
            Event::Socket(session, event) => self.on_socket(ctx, session, event),
            Event::ConnectionCut => self.connection.drop_socket(ctx),
            // The seat is left to the next tab that opens the room's link. The socket is closed, because a browser may
            // keep the page in its back/forward cache with the socket open, which would leave an idle player in the
            // room. When the page is shown again, it reconnects.
            Event::Closing => {
                ctx.storage.leave_seat_behind(&self.connection.code);
                self.connection.drop_socket(ctx);
            }
            Event::KeyUp(key) => self.key_up(ctx, &key.code),
            Event::Pointer(pointer) => self.point(ctx, &pointer),
            Event::ToolArmed(buttons) => self.input.fingers.armed = buttons,
            Event::ToolPressed(buttons, down) => self.press(ctx, buttons, down),
            _ => {}
        }
        if !was_lost && self.connection.status.state == State::Reconnecting {
            self.input.controls.release();
        }
    }

    pub fn watches(&self) -> bool {
        self.connection.watches()
    }

    /// Makes a spectator follow a player. Choosing the same player again, or `None`, shows the whole scene.
    pub fn follow_player(&mut self, seat: Option<Seat>) {
        if self.watches() {
            self.followed.seat = seat.filter(|_| self.followed.seat != seat);
            self.followed.has_chosen = true;
            self.view.follows = None;
        }
    }

    /// The replica of the room, once it exists.
    pub fn replica(&self) -> Option<&Replica> {
        self.membership.as_ref().map(|membership| &membership.replica)
    }

    /// Carries out the action that the host confirmed.
    pub fn carry_out(&mut self, ctx: &mut Context, question: &Question) {
        match question {
            &Question::Kick { seat, network, .. } => self.remove(ctx, seat, network),
            Question::CloseRoom => {
                self.connection.status.closes = true;
                self.connection.send(ctx, &ClientMessage::CloseRoom);
            }
        }
    }

    /// Removes a player from the room, and shuts out the player's network if `network` says so.
    pub fn remove(&mut self, ctx: &mut Context, seat: Seat, network: bool) {
        let message = if network {
            ClientMessage::KickNetwork { seat }
        } else {
            ClientMessage::Kick { seat }
        };
        self.connection.send(ctx, &message);
        if let Some(membership) = &mut self.membership {
            membership.replica.room.removed.push(seat);
        }
    }

    /// Takes the sound cues reported since the previous call.
    pub fn take_cues(&mut self) -> Vec<Cue> {
        let take = |replica: &mut Replica| std::iter::from_fn(|| replica.next_cue()).collect();
        let live = self.membership.as_mut().map_or(Vec::new(), |live| take(&mut live.replica));
        // While highlights are shown, the live room is silent.
        self.showing.as_mut().map_or(live, |showing| take(&mut showing.player.replica))
    }

    /// The view of the most recent frame.
    pub fn view(&self) -> &View {
        &self.view.view
    }

    pub fn is_in_page(&self) -> bool {
        matches!(self.connection.link, Link::InPage(_))
    }

    /// Whether the game is frozen for a screenshot.
    pub fn is_frozen(&self) -> bool {
        self.connection.status.state == State::Frozen
    }

    /// Whether the game is played alone.
    pub fn is_alone(&self) -> bool {
        self.is_in_page() && self.connection.code == ALONE
    }

    /// The name of the site's scene that is being played alone, if the server keeps its best runs.
    pub fn ranked_scene<'a>(&self, ctx: &'a Context) -> Option<&'a str> {
        let is_ranked = self.is_alone() && self.edited.is_none() && !ctx.site.is_static;
        ctx.site.alone().0.filter(|_| is_ranked)
    }

    pub fn is_round_over(&self) -> bool {
        let round = self.replica().and_then(|replica| replica.room.round());
        round.is_some_and(|round| round.phase == RoundPhase::Over)
    }

    /// Handles a fetched replay; `false` if it was requested for the ghost but cannot be used.
    pub fn take_ghost(&mut self, file: &str, fetched: Fetched) -> bool {
        let is_awaited =
            |slot: &mut GhostSlot| matches!(slot, GhostSlot::Pending(_, own) if own == file);
        let Some(GhostSlot::Pending(wish, _)) = self.ghost.take_if(is_awaited) else { return true };
        let bytes = match fetched {
            Fetched::Bytes(bytes) => bytes,
            Fetched::Refused(_) | Fetched::Nothing => Vec::new(),
        };
        let scene = self.connection.room_in_page().map(RoomInPage::scene);
        let ghost = scene.and_then(|scene| Ghost::new(bytes, wish, scene));
        self.ghost = ghost.map(|ghost| GhostSlot::Here(Box::new(ghost)));
        self.ghost.is_some()
    }

    /// The ghost, once its replay has been fetched.
    pub fn ghost(&self) -> Option<&Ghost> {
        match &self.ghost {
            Some(GhostSlot::Here(ghost)) => Some(ghost),
            _ => None,
        }
    }

    /// The ghost's body, if visible.
    pub fn ghost_body(&self) -> Option<&FrameBody> {
        self.ghost()?.shown.as_ref()
    }

    /// Whether highlights are available.
    pub fn has_highlights(&self) -> bool {
        let highlights = self.replica().and_then(|replica| replica.highlights.as_ref());
        highlights.is_some_and(|highlights| !highlights.is_empty())
    }

    /// Shows the newest highlights that fit into the time before the next round, or stops showing them.
    pub fn toggle_highlights(&mut self, ctx: &mut Context) {
        if self.showing.take().is_some_and(|showing| !showing.is_auto) {
            return self.view.cut();
        }
        self.begin_highlights(ctx, false);
    }

    /// Whether highlights are shown that the player asked for.
    pub fn shows_asked(&self) -> bool {
        self.showing.as_ref().is_some_and(|showing| !showing.is_auto)
    }

    /// Shows highlights behind the result of a round that ended a moment ago, once.
    pub fn offer_highlights(&mut self, ctx: &mut Context) {
        let due = self.replica().and_then(highlights::due);
        if due.is_some() && due != self.shown_end && self.has_highlights() && self.showing.is_none()
        {
            self.begin_highlights(ctx, true);
        }
    }

    fn begin_highlights(&mut self, ctx: &mut Context, is_auto: bool) {
        if self.is_frozen() {
            return;
        }
        let Some(membership) = &mut self.membership else { return };
        self.shown_end = membership.replica.room.round().map(|round| round.since);
        let showing = Showing::begin(ctx, &mut membership.replica);
        self.showing = showing.map(|showing| Showing { is_auto, ..showing });
        self.view.cut();
    }

    /// Advances the highlights. They end after the last one, or when the next round starts.
    fn advance_highlights(&mut self, ctx: &mut Context) {
        let Some(showing) = &mut self.showing else { return };
        let live = self.membership.as_ref().map(|membership| &membership.replica);
        let eye = self.view.eye(&self.input.controls, live);
        let begins = showing.advance(ctx, live, eye);
        if begins.is_none() {
            self.showing = None;
        }
        if begins != Some(false) {
            self.view.cut();
        }
    }

    /// The replica in the picture and its number: that of the current highlight, or of the room.
    fn pictured(&self) -> Option<(&Replica, u32)> {
        match (&self.showing, &self.membership) {
            (Some(showing), _) => Some((&showing.player.replica, showing.copy.1)),
            (None, Some(membership)) => Some((&membership.replica, membership.copy)),
            (None, None) => None,
        }
    }

    /// The replica in the picture.
    pub fn pictured_replica(&self) -> Option<&Replica> {
        self.pictured().map(|(replica, _)| replica)
    }

    /// Advances the display, but only during play.
    fn move_display(&mut self, now_ms: f64) {
        if self.connection.status.state != State::Playing {
            return;
        }
        let eye = self.view.eye(&self.input.controls, self.replica());
        if let Some(membership) = &mut self.membership {
            membership.move_display(now_ms, eye);
        }
    }

    /// Switches prediction on or off. It is never used in an in-page room.
    pub fn set_prediction(&mut self, on: bool) {
        let on = on && !self.is_in_page() && !self.watches();
        if let Some(membership) = &mut self.membership {
            membership.set_prediction(on);
        }
    }

    /// Advances everything to the current time: in-page room, display, input, and the camera on a canvas.
    pub fn advance(&mut self, ctx: &mut Context, canvas: Option<Canvas>) {
        let now_ms = ctx.now_ms;
        let elapsed_s = ((now_ms - self.view.framed_ms) / 1000.0).clamp(0.0, 0.25) as f32;
        self.view.framed_ms = now_ms;
        if !self.is_frozen() {
            if let Link::InPage(room) = &mut self.connection.link
                && self.connection.status.stalled_ms.is_none()
            {
                self.connection.status.stalled_ms = stalled(room.advance(now_ms, ctx.clock));
            }
            self.receive_in_page(ctx);
            self.move_display(now_ms);
            if let (Some(ghost), Some(membership)) = (&mut self.ghost, &self.membership) {
                ghost.advance(&membership.replica, ctx.clock);
            }
            self.advance_highlights(ctx);
        }
        if let Some(Canvas { pixels, top, bottom, .. }) = canvas {
            let watches = self.watches();
            let live = self.membership.as_ref().map(|membership| &membership.replica);
            if let Some(live) = live.filter(|_| watches) {
                self.followed.choose(live, pixels);
            }
            let replica = self.showing.as_ref().map(|showing| &showing.player.replica).or(live);
            let hero = || replica?.room.hero_of(self.followed.seat?);
            let followed = watches.then(hero);
            self.view.aim(replica, followed, Target { pixels, hero: None, top, bottom, elapsed_s });
        }
        self.send_due(ctx);
    }

    /// Runs a scripted demo to its end as fast as possible and freezes it there.
    fn freeze_at(&mut self, ctx: &mut Context, ticks: u32) {
        self.receive_in_page(ctx);
        for _ in 0..ticks.max(1) {
            let Link::InPage(room) = &mut self.connection.link else { return };
            room.tick();
            self.receive_in_page(ctx);
            let eye = Eye { pointer: None, bounds: self.view.bounds(self.replica()) };
            if let Some(RoomMembership { replica, .. }) = &mut self.membership
                && let Some(tick) = replica.room.newest().map(|snapshot| snapshot.tick)
            {
                replica.advance(f64::from(tick), eye);
            }
        }
        self.connection.status.state = State::Frozen;
    }

    /// The frame to draw now; `None` before the first snapshot, and while a moment holds the picture. `time` is the time since the page opened, seconds.
    pub fn frame(&self, time: f32, calm: bool) -> Option<Frame<'_>> {
        let (replica, copy) = self.pictured()?;
        replica.room.newest()?;
        let frozen = self.is_frozen();
        // A calm picture neither stops nor shakes.
        let jolts = !calm && self.connection.status.state == State::Playing;
        if jolts && replica.moments.holds(replica.room.display) {
            return None;
        }
        let mut view = self.view.view;
        if jolts {
            view.center += replica.moments.shake(replica.room.display) * view.height;
        }
        let tick_s = (replica.room.display / f64::from(TICKS_PER_SECOND)) as f32;
        Some(Frame {
            view,
            world_size: replica.room.scene.size,
            room: &replica.picture.drawn,
            particles: replica.particles(),
            particle_lead: if frozen { 0.0 } else { replica.particle_lead() },
            time: if frozen { tick_s } else { time },
            bounds: self.view.bounds(Some(replica)),
            calm,
            copy,
            dimmed: !matches!(
                self.connection.status.state,
                State::Playing | State::Moving | State::Frozen
            ),
            sketch: None,
            ghost: self.ghost_body().filter(|_| self.showing.is_none()),
        })
    }
}
