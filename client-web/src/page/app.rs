//! The page's state, and the one place where it changes: [`App::update`]. Plain Rust: events come in,
//! effects go out, and everything else that the browser shows is read from here.

mod clicks;

use crate::net::api::{self, Request, query_value};
use crate::net::report::Fetched;
use crate::net::scene_link;
use crate::net::simulated_link::NetworkConditions;
use crate::page::address::{Awaited, Destination, Site, Wish};
use crate::page::best_runs::Records;
use crate::page::context::Context;
use crate::page::dialogs::Dialogs;
use crate::page::dialogs::Layer;
use crate::page::edit_screen::{self, EditScreen};
use crate::page::event::{Address, Canvas, Effect, Event, Form, PointerChange};
use crate::page::game::GameScreen;
use crate::page::lobby::Lobby;
use crate::page::name;
use crate::page::replay_screen::Opening;
use crate::page::screen::Screen;
use crate::page::settings::Settings;
use crate::page::sound_desk::Gesture;
use crate::page::sound_desk::SoundDesk;
use crate::page::storage::{self, Storage};
use crate::page::strings;
use crate::sound::task::SoundEvent;
use crate::world::replica::News;
use crate::world::room_in_page::{DemoRequest, RoomInPage};
use jostle_game::Scene;
use jostle_protocol::{Appearance, Role, limits};
use std::collections::VecDeque;
use std::sync::Arc;

/// Lines of news on display.
const NEWS_LINES_MAX: usize = 6;
/// Name of a scene whose file is not known, only its text.
const LINKED: &str = "scene.toml";
/// The copy button says for this long what came of it, milliseconds.
const COPIED_MS: i32 = 1500;

/// Panels that the player opens and closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Panels {
    /// Figures (F3).
    pub figures: bool,
    /// The network (F4).
    pub network: bool,
    pub sound: bool,
    /// A spectator hid everything but the picture.
    pub clean: bool,
}

/// State of the drawing context. One that comes back is good until it is tried.
#[derive(Clone, Copy, Debug, Default)]
pub struct GraphicsStatus {
    /// The browser offers none, or none that works.
    pub failed: bool,
    /// When the browser took it, until it gives it back.
    pub lost_ms: Option<f64>,
}

impl GraphicsStatus {
    /// Whether drawing may be tried.
    pub fn is_good(&self) -> bool {
        !self.failed && self.lost_ms.is_none()
    }
}

/// Facts about the browser when the page is opened.
#[derive(Debug, Default)]
pub struct Startup {
    /// Values of earlier visits, and of other tabs.
    pub storage: Storage,
    pub query: String,
    /// Seed of everything that is left to chance.
    pub seed: u64,
    /// The page has no server.
    pub is_static: bool,
    /// The part of all its addresses before the path.
    pub origin: String,
    /// The player prefers less motion.
    pub calm: bool,
    /// Fingers are the pointer of this machine.
    pub touched: bool,
    /// The language that the browser is set to, like `de-AT`.
    pub language: String,
}

/// Everything that begins anew with each screen.
#[derive(Debug, Default)]
pub struct Visit {
    /// Number of the screen: games and replays that were begun or ended.
    pub number: u32,
    /// The colour that the page wears.
    pub own_color: u8,
    /// A scene that may be too heavy, while the player is asked.
    pub(super) heavy: Option<(Arc<Scene>, Wish)>,
    pub dialogs: Dialogs,
    pub news: NewsLog,
    /// Whether the link was copied, for a moment after it was asked for.
    pub copied: Option<bool>,
}

/// The newest news, the oldest first.
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
    /// Frames drawn since the page was opened or a demo or replay began.
    pub drawn_frames: u64,
    /// A frame of this screen was drawn.
    pub world_shown: bool,
    /// Whether the controls are shown over a frozen demo, if one is on.
    pub frozen_hud: Option<bool>,
}

impl CanvasPicture {
    /// Takes what happened to the drawing context.
    fn update(&mut self, ctx: &mut Context, event: &Event) {
        match event {
            Event::GraphicsFailed => self.graphics.failed = true,
            Event::ContextRestored => self.graphics = GraphicsStatus::default(),
            _ => {
                self.graphics.lost_ms.get_or_insert(ctx.now_ms);
                ctx.request(Effect::DropGraphics);
            }
        }
    }
}

pub struct App {
    /// The context of every handler.
    pub(super) ctx: Context,
    pub screen: Screen,
    /// A replay that takes the place of the screen once it is read.
    pub opening: Option<Opening>,
    pub visit: Visit,
    pub lobby: Lobby,
    pub records: Records,
    pub appearance: Appearance,
    /// The editor whose scene is played now.
    pub(super) edited: Option<Box<EditScreen>>,
    pub panels: Panels,
    pub sound: SoundDesk,
    pub conditions: NetworkConditions,
    pub picture: CanvasPicture,
    pub settings: Settings,
}

impl App {
    /// A page that shows nothing yet: the first event says where it is.
    pub fn new(startup: Startup) -> App {
        let Startup { storage, query, seed, calm, touched, is_static, origin, language } = startup;
        let predicts = storage.predicts(query_value(&query, "predict"));
        let site = Site { address: Address::default(), origin, is_static };
        let mut ctx = Context::new(storage, site, predicts, seed);
        let mut settings = Settings::new(&ctx.storage, &language, calm);
        settings.touched = touched;
        settings.ask_language(&mut ctx);
        let appearance = recall(&mut ctx);
        let sound = SoundDesk::new(&ctx.storage);
        // For tests, and for links to a bad network: `?lag=150,30` or `?lag=300,100,stalls`.
        let conditions = query_value(&query, "lag").and_then(NetworkConditions::parse);
        let conditions = conditions.unwrap_or(NetworkConditions::OFF);
        ctx.request(Effect::SetConditions(conditions));
        App {
            ctx,
            screen: Screen::Lobby,
            opening: None,
            edited: None,
            visit: Visit { own_color: appearance.color, ..Visit::default() },
            lobby: Lobby::default(),
            records: Records::default(),
            appearance,
            panels: Panels::default(),
            sound,
            conditions,
            picture: CanvasPicture::default(),
            settings,
        }
    }

    /// Gives the page the browser's clock.
    pub fn set_clock(&mut self, clock: fn() -> f64) {
        self.ctx.clock = clock;
    }

    /// Handles an event at `now_ms`, and returns the effects for the browser to carry out.
    pub fn update(&mut self, now_ms: f64, event: Event) -> Vec<Effect> {
        self.ctx.now_ms = now_ms;
        let gesture = Gesture::of(&event);
        self.handle(event);
        self.sound.settle(&mut self.ctx, self.screen.has_sound(), gesture);
        self.ctx.take_effects()
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Navigated(address) => self.route(address),
            Event::Pulse { hidden } => self.pulse(hidden),
            Event::Frame(canvas) => {
                self.advance(canvas);
                self.send_run();
                if let Some((cues, view)) = self.screen.take_cues() {
                    self.sound.play(&mut self.ctx, cues, &view);
                }
            }
            Event::Drawn(drawn) => self.note_drawn(drawn),
            Event::FocusLost => self.screen.release_input(&mut self.ctx),
            Event::Closing => self.close_tab(),
            Event::KeyDown(key) => self.key_down(&key),
            Event::Pointer(pointer) => {
                // The first touch brings the stick and the tool buttons, also where a mouse is present.
                self.settings.touched |= pointer.touch && pointer.change == PointerChange::Down;
                self.screen.update(&mut self.ctx, Event::Pointer(pointer));
            }
            Event::Clicked(action, value) => self.click(action, &value),
            Event::FormChanged(form) => _ = self.read_form(&form),
            Event::PlayClicked(form) => self.play(&form),
            Event::SceneClicked(scene, form) => {
                if self.read_form(&form) {
                    self.lobby.open(&mut self.ctx, &scene, form.private);
                }
            }
            Event::AloneClicked(scene, form) => self.play_scene_alone(&scene, &form),
            Event::Answered(Request::OpenGuest(text), answer) => {
                self.take_guest_room(&text, answer.as_deref());
            }
            Event::Answered(request, answer) => {
                if !self.take_record(&request, answer.as_deref()) {
                    let code = self.lobby.take(&mut self.ctx, &request, answer.as_deref());
                    self.enter(code);
                }
            }
            Event::SceneFetched(name, fetched) => self.take_scene(&name, fetched),
            Event::ReplayFetched(name, fetched) => self.take_fetched(&name, fetched),
            Event::ReplayRead(file, contents) => self.take_file(file, contents),
            Event::SceneRead(file, contents) => self.take_scene_file(&file, contents),
            Event::FileDragged => {
                let takes = self.takes_files();
                self.ctx.request(Effect::OfferDrop(takes));
            }
            Event::Copied(copied) => self.note_copied(copied),
            Event::CopyShown => self.visit.copied = None,
            Event::GraphicsFailed | Event::ContextLost | Event::ContextRestored => {
                self.picture.update(&mut self.ctx, &event);
                self.screen.update(&mut self.ctx, event);
            }
            Event::Online
            | Event::KeyUp(_)
            | Event::ToolArmed(_)
            | Event::Socket(..)
            | Event::ConnectionCut
            | Event::ToolPressed(..)
            | Event::Wheel(..)
            | Event::Edited(_)
            | Event::FieldChanged(..)
            | Event::SeekChosen(_)
            | Event::SpeedChosen(_) => self.screen.update(&mut self.ctx, event),
            Event::PredictionChosen(on) => {
                self.ctx.storage.keep_flag(storage::PREDICT, on);
                self.set_prediction(on);
            }
            Event::ConditionsChosen(conditions) => {
                self.conditions = conditions;
                self.ctx.request(Effect::SetConditions(conditions));
            }
            Event::Sound(event) => self.take_sound(event),
            Event::Settings(event) => {
                let played = self.settings.update(&mut self.ctx, event);
                played.iter().for_each(|state| self.play_by_pad(state));
            }
            Event::StoredElsewhere(key, value) => self.take_stored(&key, value),
            Event::DraftKept(draft, kept) => self.note_draft(draft, kept),
        }
    }

    // Screens.

    /// Shows what an address asks for.
    pub(super) fn route(&mut self, address: Address) {
        self.end_screen();
        self.ctx.site.address = address.clone();
        match Destination::of(&address, self.ctx.site.is_static) {
            Destination::Lobby => self.lobby.show(&mut self.ctx),
            Destination::Room { code, watches } => {
                let role = if watches { Role::Spectator } else { Role::Player };
                let game = GameScreen::join(&mut self.ctx, code, self.appearance.clone(), role);
                self.screen = Screen::Game(Box::new(game));
            }
            Destination::Replay(name, file) => {
                self.screen = Screen::Fetching { name: name.to_owned(), file: file.clone() };
                self.ctx.request(Effect::FetchReplay(file));
            }
            Destination::Linked(link, wish) => match scene_link::decode(link) {
                Ok(source) => match Scene::parse(LINKED, &source) {
                    Ok(scene) => self.play_foreign(Arc::new(scene), wish),
                    Err(error) => self.visit.dialogs.card = Some(strings::bad_linked_scene(&error)),
                },
                Err(error) => self.visit.dialogs.card = Some(strings::bad_link(&error)),
            },
            Destination::Scene(awaited) => {
                let has_records = matches!(awaited, Awaited::Alone(..)) && !self.ctx.site.is_static;
                self.await_scene(awaited);
                if has_records {
                    self.ctx.request(Effect::Request(Request::Records));
                }
            }
            // With the draft of it, if there is one.
            Destination::Editor(origin) => match (self.ctx.storage.draft(origin), origin) {
                (None, Some(name)) => self.await_scene(Awaited::Edit(name.to_owned())),
                (draft, _) => {
                    self.edit(draft.unwrap_or_default().to_owned(), origin, edit_screen::SEED)
                }
            },
        }
        if let Screen::Game(_) = self.screen {
            self.ctx.request(Effect::FocusStage);
        }
    }

    /// Whether a file that is dropped is opened: a game on a server is not left for it.
    pub(super) fn takes_files(&self) -> bool {
        self.screen.game().is_none_or(GameScreen::is_in_page)
    }

    fn go_home(&mut self) {
        let home = self.ctx.site.home().to_owned();
        self.go(&home);
    }

    /// Goes to a path of this server.
    pub(super) fn go(&mut self, path: &str) {
        self.ctx.request(Effect::PushAddress(path.to_owned()));
        self.route(Address { path: path.to_owned(), ..Address::default() });
    }

    fn watch_room(&mut self, code: &str) {
        let (path, query) = (format!("/{code}"), "?watch=1".to_owned());
        self.ctx.request(Effect::PushAddress(path.clone() + &query));
        self.route(Address { path, query, ..Address::default() });
    }

    pub(super) fn enter(&mut self, code: Option<String>) {
        if let Some(code) = code {
            self.go(&format!("/{code}"));
        }
    }

    /// Leaves the seat to the next tab that opens the room's link, and closes the socket: a browser may
    /// keep the page in its back/forward cache with the socket open, as an idle player in the room. When
    /// the page is shown again, it reconnects.
    fn close_tab(&mut self) {
        self.screen.release_input(&mut self.ctx);
        self.keep_draft();
        if let Screen::Game(game) = &self.screen {
            self.ctx.storage.leave_seat_behind(&game.connection.code);
        }
        self.screen.with_game(&mut self.ctx, |game, ctx| game.update(ctx, Event::Closing));
    }

    /// Leaves game or replay.
    pub(super) fn end_screen(&mut self) {
        self.keep_draft();
        self.edited = None;
        let ended = std::mem::replace(&mut self.screen, Screen::Lobby);
        if let Screen::Game(game) = ended {
            game.connection.leave(&mut self.ctx);
        }
        self.opening = None;
        self.begin_screen();
        self.picture.world_shown = false;
    }

    /// Forgets what belongs to one screen alone.
    pub(super) fn begin_screen(&mut self) {
        let number = self.visit.number + 1;
        self.visit = Visit { number, own_color: self.appearance.color, ..Visit::default() };
        self.panels.network = false;
        self.panels.clean = false;
        self.settings.choice = None;
        self.sound.end();
        self.panels.sound = false;
        self.records.begin();
    }

    /// Starts the game in the page that waits for this scene.
    pub(super) fn take_scene(&mut self, name: &str, fetched: Fetched) {
        let Screen::FetchingScene(awaited) = &self.screen else { return };
        if awaited.scene() != name {
            return;
        }
        let awaited = awaited.clone();
        let source = match fetched {
            Fetched::Bytes(bytes) => String::from_utf8(bytes).unwrap_or_default(),
            _ => String::new(),
        };
        if let Ok(scene) = Scene::parse(name, &source) {
            match awaited {
                Awaited::Demo(request) => self.start_demo(&request, Arc::new(scene)),
                Awaited::Alone(_, wish) => self.play_alone(Arc::new(scene), wish),
                Awaited::Edit(name) => self.edit(source, Some(&name), edit_screen::SEED),
            }
            self.ctx.request(Effect::FocusStage);
        } else {
            self.screen = Screen::Lobby;
            self.visit.dialogs.card = Some(strings::NO_SCENE);
        }
    }

    fn start_demo(&mut self, request: &DemoRequest, scene: Arc<Scene>) {
        let frozen = request.ticks.is_some();
        let room = RoomInPage::new(scene, request.seed, request.bots, frozen);
        // A picture must not depend on the player.
        let neutral = || Appearance { name: "Jo".into(), color: 0 };
        let appearance = if frozen { neutral() } else { self.appearance.clone() };
        let mut game = GameScreen::in_page(&mut self.ctx, "demo", room, appearance);
        if let Some(ticks) = request.ticks {
            game.freeze_at(&mut self.ctx, ticks);
            self.visit.own_color = 0;
            self.picture.frozen_hud = Some(request.hud);
            self.picture.drawn_frames = 0;
        }
        self.screen = Screen::Game(Box::new(game));
    }

    /// Takes over what another tab has written.
    pub(super) fn take_stored(&mut self, key: &str, value: Option<String>) {
        self.ctx.storage.take(key, value);
        let storage = &self.ctx.storage;
        let (name, color) = storage.player();
        let predicts = storage.predicts(None);
        if let Ok(appearance) = Appearance::new(name, color.unwrap_or(self.appearance.color)) {
            self.take_player(appearance);
        }
        self.sound.recall(&self.ctx.storage);
        self.sound.set_gain(&mut self.ctx);
        self.settings.recall(&self.ctx.storage);
        self.settings.ask_language(&mut self.ctx);
        if key == storage::PREDICT {
            self.set_prediction(predicts);
        }
    }

    /// Another tab has renamed the player: the next game here is begun as that one, and the form says so.
    fn take_player(&mut self, appearance: Appearance) {
        if self.appearance == appearance {
            return;
        }
        self.appearance = appearance;
        if let Screen::Lobby = self.screen {
            self.visit.own_color = self.appearance.color;
            self.visit.number += 1;
        }
    }

    pub(super) fn set_prediction(&mut self, on: bool) {
        self.ctx.predicts = on;
        self.screen.with_game(&mut self.ctx, |game, _| game.set_prediction(on));
    }

    pub(super) fn toggle_settings(&mut self) {
        self.screen.release_input(&mut self.ctx);
        if let Screen::Game(game) = &mut self.screen {
            game.input.wheel = None;
        }
        self.settings.choice = None;
        self.settings.note.clear();
        self.visit.dialogs.toggle_settings(self.top());
    }

    // Time.

    fn pulse(&mut self, hidden: bool) {
        match &mut self.screen {
            Screen::Game(game) => game.update(&mut self.ctx, Event::Pulse { hidden }),
            Screen::Edit(_) => self.keep_draft(),
            Screen::Lobby if self.visit.dialogs.card.is_none() && !hidden => {
                self.lobby.refresh(&mut self.ctx);
            }
            _ => {}
        }
    }

    fn advance(&mut self, canvas: Option<Canvas>) {
        self.read_on();
        let plays = self.top() == Layer::Page;
        match &mut self.screen {
            Screen::Game(game) => {
                game.advance(&mut self.ctx, canvas);
                let is_frozen = game.is_frozen();
                let Some(membership) = &mut game.membership else { return };
                while let Some(news) = membership.replica.news.pop_front() {
                    self.visit.news.push(news);
                }
                self.visit.dialogs.withdraw_moot(membership.replica.room.players());
                let own_color = membership.replica.room.own_color();
                let (wished, worn) = (self.appearance.color, self.visit.own_color);
                if let Some(color) = own_color.filter(|color| *color != worn && !is_frozen) {
                    self.visit.own_color = color;
                    let look = membership.replica.room.own_look();
                    // A team's colour is nobody's wish.
                    if let Some(look) = look.filter(|look| look.color == color && color != wished) {
                        self.visit.news.push(News::Recolored(look.clone(), wished));
                    }
                }
                game.input.adopt(&membership.replica.room.scene);
            }
            Screen::Replay(replay) => {
                replay.advance(self.ctx.now_ms, canvas, plays, self.ctx.clock);
                // Events that were skipped are no news.
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
    }

    fn note_drawn(&mut self, drawn: bool) {
        self.screen.update(&mut self.ctx, Event::Drawn(drawn));
        if drawn {
            self.picture.world_shown = true;
            self.picture.drawn_frames += 1;
        }
    }

    fn take_sound(&mut self, event: SoundEvent) {
        if let SoundEvent::Hidden(_) = event {
            self.screen.release_input(&mut self.ctx);
        }
        self.sound.update(&mut self.ctx, event);
    }

    // The lobby's form.

    /// Takes name and colour from the form; `false` if the name cannot be used.
    pub(super) fn read_form(&mut self, form: &Form) -> bool {
        self.visit.own_color = form.color;
        let Some(appearance) = self.lobby.read(form) else { return false };
        self.ctx.storage.keep_player(&appearance.name, appearance.color);
        self.appearance = appearance;
        true
    }

    fn play(&mut self, form: &Form) {
        if self.ctx.site.is_static {
            self.play_scene_alone(api::FIRST_SCENE, form);
        } else if self.read_form(form) {
            let code = self.lobby.play(&mut self.ctx, form.private);
            self.enter(code);
        }
    }

    pub(super) fn toggle_network(&mut self) {
        self.panels.network = !self.panels.network;
        self.panels.sound = false;
    }

    pub(super) fn toggle_help(&mut self) {
        self.screen.release_input(&mut self.ctx);
        self.visit.dialogs.toggle_help(self.top());
    }

    fn note_copied(&mut self, copied: bool) {
        self.visit.copied = Some(copied);
        self.ctx.request(Effect::After(COPIED_MS, Event::CopyShown));
    }
}

/// The remembered player, or a random name and colour that are remembered from now on.
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
