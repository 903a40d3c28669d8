//! The page's state and [`App::update`], the only function that changes it. This is plain Rust: events come in, effects
//! go out, and everything else that the browser shows is read from here.

mod clicks;
mod screens;

use crate::editor::field_words;
use crate::language::say;
use crate::net::api::{self, Request, query_value};
use crate::net::simulated_link::NetworkConditions;
use crate::page::address::{PlayOptions, Site};
use crate::page::bests::OwnResult;
use crate::page::context::Context;
use crate::page::dialogs::{Card, Dialogs, Layer};
use crate::page::event::{Address, Canvas, Effect, Event, PointerChange};
use crate::page::frame_clock::FrameClock;
use crate::page::game::GameScreen;
use crate::page::game::connection::State;
use crate::page::lobby::Lobby;
use crate::page::name;
use crate::page::records::Records;
use crate::page::replay_screen::Opening;
use crate::page::screen::Screen;
use crate::page::settings::Settings;
use crate::page::sound_desk::{Gesture, SoundDesk};
use crate::page::storage::{self, Storage};
use crate::page::strings;
use crate::sound::task::SoundEvent;
use crate::world::replica::{News, Replica};
use jostle_game::Scene;
use jostle_protocol::web::Posted;
use jostle_protocol::{Appearance, limits};
use std::collections::VecDeque;
use std::sync::Arc;

/// How long the copy button shows the result, milliseconds.
const COPIED_MS: i32 = 1500;
/// Maximum number of news lines on display.
const NEWS_LINES_MAX: usize = 6;
/// How long a drawing context may be lost before that is reported, milliseconds.
const CONTEXT_WAIT_MS: f64 = 5000.0;

/// Panels that the player opens and closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Panels {
    /// Statistics (F3).
    pub figures: bool,
    /// Network conditions (F4).
    pub network: bool,
    pub sound: bool,
    /// Whether a spectator has hidden everything but the picture.
    pub clean: bool,
}

impl Panels {
    fn toggle_network(&mut self) {
        (self.network, self.sound) = (!self.network, false);
    }

    fn toggle_sound(&mut self) {
        (self.network, self.sound) = (false, !self.sound);
    }
}

/// The state of the drawing context. A restored context is considered good until drawing fails.
#[derive(Clone, Copy, Debug, Default)]
pub struct GraphicsStatus {
    /// Whether the browser has no working drawing context.
    pub failed: bool,
    /// The time at which the browser took the context away; `None` while it is available.
    pub lost_ms: Option<f64>,
}

impl GraphicsStatus {
    /// Whether drawing can be attempted.
    pub fn is_good(&self) -> bool {
        !self.failed && self.lost_ms.is_none()
    }
}

/// Facts about the browser when the page opens.
#[derive(Debug, Default)]
pub struct Startup {
    /// Values stored during earlier visits or by other tabs.
    pub storage: Storage,
    pub query: String,
    /// Seed for all random choices.
    pub seed: u64,
    /// Whether the page has no server.
    pub is_static: bool,
    /// Whether another page shows this one in a frame.
    pub is_framed: bool,
    /// The part of the page's addresses that precedes the path.
    pub origin: String,
    /// Whether the player prefers less motion.
    pub calm: bool,
    /// Whether touch is the machine's main pointing method.
    pub touched: bool,
    /// The browser's language, such as `de-AT`.
    pub language: String,
}

/// State that is reset with each screen.
#[derive(Debug, Default)]
pub struct Visit {
    /// The number of the screen, which counts games and replays that began or ended.
    pub number: u32,
    /// The colour that the page uses for the player.
    pub own_color: u8,
    /// A scene that may be too heavy, while the player is being asked about it.
    pub(super) heavy: Option<(Arc<Scene>, PlayOptions)>,
    pub dialogs: Dialogs,
    pub news: NewsLog,
    /// Whether copying the link succeeded; set only briefly after the attempt.
    pub copied: Option<bool>,
}

impl Visit {
    /// Takes over the room's news and the player's current colour. `wished` is the colour that the player chose.
    fn note_room(&mut self, replica: &mut Replica, wished: u8, is_frozen: bool) {
        while let Some(news) = replica.news.pop_front() {
            self.news.push(news);
        }
        self.dialogs.withdraw_moot(replica.room.players());
        let worn = self.own_color;
        if let Some(color) = replica.room.own_color().filter(|color| *color != worn && !is_frozen) {
            self.own_color = color;
            let look = replica.room.own_look();
            // A team's colour says nothing about the player's own choice.
            if let Some(look) = look.filter(|look| look.color == color && color != wished) {
                self.news.push(News::Recolored(look.clone(), wished));
            }
        }
    }
}

/// The latest news, oldest first.
#[derive(Debug, Default)]
pub struct NewsLog {
    /// The lines, numbered from 1.
    pub lines: VecDeque<(usize, News)>,
}

impl NewsLog {
    pub fn push(&mut self, news: News) {
        let number = self.lines.back().map_or(1, |newest| newest.0 + 1);
        if self.lines.len() == NEWS_LINES_MAX {
            self.lines.pop_front();
        }
        self.lines.push_back((number, news));
    }
}

/// The picture on the canvas.
#[derive(Debug, Default)]
pub struct CanvasPicture {
    pub graphics: GraphicsStatus,
    /// Number of frames drawn since the page opened, or since a demo or replay began.
    pub drawn_frames: u64,
    /// Whether a frame of this screen has been drawn.
    pub world_shown: bool,
    /// Whether the frozen demo shows the controls; `None` if there is no frozen demo.
    pub frozen_hud: Option<bool>,
}

impl CanvasPicture {
    /// Records changes of the drawing context and drawn frames.
    fn update(&mut self, ctx: &mut Context, event: &Event) {
        match event {
            Event::GraphicsFailed => self.graphics.failed = true,
            Event::ContextRestored => self.graphics = GraphicsStatus::default(),
            Event::ContextLost => {
                self.graphics.lost_ms.get_or_insert(ctx.now_ms);
                ctx.request(Effect::DropGraphics);
            }
            Event::Drawn(true) => {
                self.world_shown = true;
                self.drawn_frames += 1;
            }
            _ => {}
        }
    }
}

pub struct App {
    /// The context passed to every handler.
    pub(super) ctx: Context,
    clock: FrameClock,
    pub screen: Screen,
    /// The last game inside the page that the player left through the browser's history, and its address. Coming back
    /// the same way continues it.
    set_aside: Option<(Address, Box<GameScreen>)>,
    /// A replay that replaces the screen once it has been read.
    pub opening: Option<Opening>,
    pub visit: Visit,
    pub lobby: Lobby,
    pub records: Records,
    pub own_result: OwnResult,
    pub appearance: Appearance,
    pub panels: Panels,
    pub sound: SoundDesk,
    pub conditions: NetworkConditions,
    pub picture: CanvasPicture,
    pub settings: Settings,
}

impl App {
    /// Creates a page that shows nothing yet; the first event gives it its address.
    pub fn new(startup: Startup) -> App {
        let Startup { storage, query, seed, calm, touched, is_static, .. } = startup;
        let Startup { is_framed, origin, language, .. } = startup;
        let predicts = storage.predicts(query_value(&query, "predict"));
        let site = Site { address: Address::default(), origin, is_static, is_framed };
        let mut ctx = Context::new(storage, site, predicts, seed);
        let mut settings = Settings::new(&ctx.storage, &language, calm);
        settings.touched = touched;
        settings.ask_language(&mut ctx);
        let appearance = recall(&mut ctx);
        let sound = SoundDesk::new(&ctx.storage);
        // Used by tests and by links that simulate a bad network: `?lag=150,30` or `?lag=300,100,stalls`.
        let conditions = query_value(&query, "lag").and_then(NetworkConditions::parse);
        let conditions = conditions.unwrap_or(NetworkConditions::OFF);
        ctx.request(Effect::SetConditions(conditions));
        App {
            ctx,
            clock: FrameClock::default(),
            screen: Screen::Lobby,
            set_aside: None,
            opening: None,
            visit: Visit { own_color: appearance.color, ..Visit::default() },
            lobby: Lobby::default(),
            records: Records::default(),
            own_result: OwnResult::default(),
            appearance,
            panels: Panels::default(),
            sound,
            conditions,
            picture: CanvasPicture::default(),
            settings,
        }
    }

    /// Handles an event at `now_ms` and returns the effects for the browser to perform.
    pub fn update(&mut self, now_ms: f64, event: Event) -> Vec<Effect> {
        self.ctx.now_ms = self.clock.read(now_ms, matches!(event, Event::Frame(_)));
        let gesture = Gesture::of(&event);
        if let Event::FocusLost | Event::Closing | Event::Sound(SoundEvent::Hidden(_)) = event {
            self.screen.release_input(&mut self.ctx);
        }
        self.handle(event);
        self.sound.settle(&mut self.ctx, self.screen.has_sound(), gesture);
        self.ctx.take_effects()
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Navigated(address) => self.navigate(address),
            Event::Frame(canvas) => self.advance(canvas),
            Event::KeyDown(key) => self.key_down(&key),
            Event::Clicked(action, value) => self.click(action, &value),
            Event::FormChanged(form) => _ = self.read_form(&form),
            Event::LookChosen(name, color) => self.choose_look(&name, color),
            Event::PlayClicked(form) => self.play(&form),
            Event::SceneClicked(scene, form) => {
                if self.read_form(&form) {
                    self.lobby.open(&mut self.ctx, &scene, form.private);
                }
            }
            Event::AloneClicked(scene, form) => self.play_scene_alone(&scene, &form),
            Event::Answered(request, answer) => self.take_answer(&request, answer.as_deref()),
            Event::SceneFetched(name, fetched) => self.take_scene(&name, fetched),
            Event::ReplayFetched(name, fetched) => self.take_fetched(&name, fetched),
            Event::ReplayRead(file, contents) => {
                // A game in progress does not end because a file was opened.
                if self.screen.takes_files() {
                    self.open_replay(None, file, contents);
                }
            }
            Event::SceneRead(file, contents) => self.take_scene_file(&file, contents),
            Event::FileDragged => self.ctx.request(Effect::OfferDrop(self.screen.takes_files())),
            Event::Copied(copied) => {
                self.visit.copied = Some(copied);
                self.ctx.request(Effect::After(COPIED_MS, Event::CopyShown));
            }
            Event::CopyShown => self.visit.copied = None,
            Event::PredictionChosen(on) => {
                self.ctx.storage.keep_flag(storage::PREDICT, on);
                self.screen.set_prediction(&mut self.ctx, on);
            }
            Event::ConditionsChosen(conditions) => {
                self.conditions = conditions;
                self.ctx.request(Effect::SetConditions(conditions));
            }
            Event::Sound(event) => self.sound.update(&mut self.ctx, event),
            Event::Settings(event) => {
                let played = self.settings.update(&mut self.ctx, event);
                played.iter().for_each(|state| self.play_by_pad(state));
            }
            Event::StoredElsewhere(key, value) => self.take_stored(&key, value),
            Event::WordsCame([docs, fields]) => field_words::learn(&docs, &fields),
            Event::DraftKept(draft, kept) => {
                let card = self.screen.note_draft(&mut self.ctx, draft, kept);
                card.into_iter().for_each(|card| self.visit.dialogs.show(card));
            }
            event => self.update_screen(event),
        }
    }

    /// Handles an event that mainly concerns the screen.
    fn update_screen(&mut self, event: Event) {
        match &event {
            Event::Pulse { hidden: false }
                if matches!(self.screen, Screen::Lobby) && self.visit.dialogs.card.is_none() =>
            {
                self.lobby.refresh(&mut self.ctx);
            }
            // The first touch shows the stick and the tool buttons, even if a mouse is present.
            Event::Pointer(pointer) => {
                self.settings.touched |= pointer.touch && pointer.change == PointerChange::Down;
            }
            _ => self.picture.update(&mut self.ctx, &event),
        }
        self.screen.update(&mut self.ctx, event);
    }

    /// Advances everything to the current time.
    fn advance(&mut self, canvas: Option<Canvas>) {
        self.read_on();
        let plays = self.top() == Layer::Page;
        match &mut self.screen {
            Screen::Game(game) => {
                game.advance(&mut self.ctx, canvas);
                if !self.settings.calm {
                    game.offer_highlights(&mut self.ctx);
                }
                let is_frozen = game.is_frozen();
                if let Some(membership) = &mut game.membership {
                    game.input.adopt(&membership.replica.room.scene);
                    let wished = self.appearance.color;
                    self.visit.note_room(&mut membership.replica, wished, is_frozen);
                }
                self.own_result.note(&mut self.ctx, game);
                self.records.send_run(&mut self.ctx, game);
            }
            Screen::Replay(replay) => {
                replay.advance(self.ctx.now_ms, canvas, plays, self.ctx.clock);
                // Skipped events are not reported as news.
                let jumped = replay.has_jumped();
                while let Some(news) = replay.player.next_news() {
                    if !jumped {
                        self.visit.news.push(news);
                    }
                }
            }
            Screen::Edit(screen) => screen.advance(canvas),
            _ => {}
        }
        if let Some((cues, view)) = self.screen.take_cues() {
            self.sound.play(&mut self.ctx, cues, &view);
        }
    }

    /// Takes another name and colour, in the room too.
    fn choose_look(&mut self, name: &str, color: u8) {
        match Appearance::new(name::finished(name), color) {
            Ok(appearance) => {
                self.settings.note.clear();
                self.ctx.storage.keep_player(&appearance.name, color);
                self.appearance = appearance.clone();
                if let Screen::Game(game) = &mut self.screen {
                    game.connection.wear(&mut self.ctx, appearance);
                }
            }
            Err(error) => self.settings.note = say(&error.to_string()).to_owned(),
        }
    }

    fn take_answer(&mut self, request: &Request, answer: Option<&str>) {
        if let (Request::Rooms, Some(_), Screen::Game(game)) = (request, answer, &mut self.screen) {
            game.connection.answered();
        }
        let is_track = self.lobby.busy && matches!(self.screen, Screen::Lobby);
        if let Request::Next(_) = request {
            let next = answer.and_then(api::parse::<Posted>).and_then(|next| next.code);
            if let (Some(code), Screen::Game(game)) = (next, &mut self.screen) {
                game.connection.offer_next(code);
            }
        } else if let (Request::OpenGuest(text), false) = (request, is_track) {
            self.take_guest_room(text, answer);
        } else if !self.records.take(&mut self.ctx, request, answer) {
            let code = self.lobby.take(&mut self.ctx, request, answer);
            self.enter(code);
        }
    }

    /// Adopts a value written by another tab.
    fn take_stored(&mut self, key: &str, value: Option<String>) {
        self.ctx.storage.take(key, value);
        let (name, color) = self.ctx.storage.player();
        let known = Appearance::new(name, color.unwrap_or(self.appearance.color));
        // The next game in this tab starts with the new name and colour, which the form also shows.
        if let Ok(appearance) = known
            && self.appearance != appearance
        {
            self.appearance = appearance;
            if let Screen::Lobby = self.screen {
                self.visit.own_color = self.appearance.color;
                self.visit.number += 1;
            }
        }
        self.sound.recall(&self.ctx.storage);
        self.sound.set_gain(&mut self.ctx);
        self.settings.recall(&self.ctx.storage);
        self.settings.ask_language(&mut self.ctx);
        if key == storage::PREDICT {
            let predicts = self.ctx.storage.predicts(None);
            self.screen.set_prediction(&mut self.ctx, predicts);
        }
    }

    /// The value of `data-state`. A frozen picture is reported only once it has been drawn.
    pub fn state(&self) -> &'static str {
        match &self.screen {
            Screen::Game(_) | Screen::Replay(_) | Screen::Edit(_)
                if self.picture.graphics.failed =>
            {
                "unsupported"
            }
            Screen::Edit(_) => "editing",
            Screen::Replay(_) => "replay",
            Screen::Fetching { .. } | Screen::FetchingScene(_) => "connecting",
            _ if self.opening.is_some() => "connecting",
            Screen::NoReplay => "refused",
            Screen::Game(game) if game.is_frozen() && self.picture.drawn_frames == 0 => {
                "connecting"
            }
            Screen::Game(game) => game.connection.status.state.name(),
            Screen::Lobby if self.visit.dialogs.card.is_some() => "refused",
            Screen::Lobby => "lobby",
        }
    }

    /// The notice in the middle of the page.
    pub fn notice(&self) -> Option<Card> {
        let lost = self.picture.graphics.lost_ms;
        let lost = lost.is_some_and(|since| self.ctx.now_ms - since >= CONTEXT_WAIT_MS);
        if let Some(opening) = &self.opening {
            return Some(strings::reading(opening.reader.progress()));
        }
        match &self.screen {
            Screen::Fetching { .. } => Some(strings::FETCHING),
            Screen::FetchingScene(_) => Some(strings::connecting(0)),
            Screen::Game(_) | Screen::Replay(_) | Screen::Edit(_)
                if self.picture.graphics.failed =>
            {
                Some(strings::NO_WEBGL2)
            }
            Screen::Edit(_) if lost => Some(strings::GRAPHICS_LOST),
            Screen::Edit(screen) => {
                let card = self.visit.dialogs.card.clone();
                let other = screen.other_draft(&self.ctx.storage);
                card.or_else(|| other.map(|_| strings::OTHER_DRAFT))
            }
            Screen::Game(game) => {
                let card = game_notice(game, lost).or_else(|| self.visit.dialogs.card.clone());
                let stalled_ms = game.connection.status.stalled_ms;
                card.or_else(|| Some(strings::stalled(stalled_ms?, game.edited.is_some())))
            }
            Screen::Replay(_) if lost => Some(strings::GRAPHICS_LOST),
            Screen::Replay(replay) => {
                let card = self.visit.dialogs.card.clone();
                card.or_else(|| Some(strings::stalled(replay.stalled_ms?, false)))
            }
            _ => self.visit.dialogs.card.clone(),
        }
    }

    /// The layer that receives keys and clicks.
    pub fn top(&self) -> Layer {
        self.visit.dialogs.layers(self.notice().as_ref()).top()
    }
}

fn game_notice(game: &GameScreen, context_lost: bool) -> Option<Card> {
    match (game.connection.status.state, &game.connection.status.notice) {
        (State::Refused, Some(notice)) => Some(notice.clone()),
        _ if context_lost => Some(strings::GRAPHICS_LOST),
        (State::Connecting, _) if game.connection.status.blocked => Some(strings::NO_SOCKET),
        (State::Connecting, _) => Some(strings::connecting(game.connection.attempts())),
        (State::Reconnecting, _) => Some(game.connection.loss()),
        _ => None,
    }
}

/// The stored player, or one with a random name and colour, which are then stored.
fn recall(ctx: &mut Context) -> Appearance {
    let (name, color) = ctx.storage.player();
    let name = name.to_owned();
    let color = color
        .filter(|color| *color < limits::COLORS)
        .unwrap_or_else(|| (ctx.random_bits() % u32::from(limits::COLORS)) as u8);
    Appearance::new(name::finished(&name), color).unwrap_or_else(|_| {
        let name = name::friendly_name(ctx.random_bits());
        ctx.storage.keep_player(&name, color);
        Appearance { name: name.into(), color }
    })
}

#[cfg(test)]
mod tests;
