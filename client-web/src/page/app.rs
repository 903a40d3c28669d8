//! The page as a whole: which screen is on, the loop of frames, and the routes between them.
//! `/` is the lobby, `/CODE` a room, `/replay/NAME` a replay of the server, `/?demo=SCENE` a room
//! in the page.

use super::graphics::{self, Graphics};
use super::hud::{Hud, Tags};
use super::lobby::{self, Lobby};
use super::network::{self, Panel};
use super::play::{Canvas, Play, State};
use super::socket::SocketEvent;
use super::touchpad::Touchpad;
use super::watch::Screening;
use super::{ask, deck, dom, files, modal, notice, profile, socket};
use crate::api;
use crate::demo::{Demo, DemoRequest};
use crate::lag::Lag;
use crate::quality::Quality;
use crate::render::Made;
use crate::words::{self, Notice, Way};
use jostle_protocol::Appearance;
use jostle_sim::{Buttons, Scene};
use std::cell::RefCell;
use std::sync::Arc;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::HtmlElement;

/// Duties besides frames (reconnecting, refreshing the lobby) are looked at so often.
const PULSE_MS: i32 = 200;

/// In the address while a file of this machine is watched.
const FILE_HASH: &str = "#file";

/// A lost drawing context that does not come back for so long is spoken of, milliseconds.
const CONTEXT_WAIT_MS: f64 = 5000.0;

/// The page.
pub struct App {
    /// Who plays.
    pub appearance: Appearance,
    /// The lobby.
    pub lobby: Lobby,
    /// The game that is on, if one is.
    pub play: Option<Play>,
    /// The replay that is on, if one is.
    pub screening: Option<Screening>,
    /// What is said of a replay.
    pub card: Option<Notice>,
    /// Thumbs.
    pub touchpad: Touchpad,
    /// The hud.
    pub hud: Hud,
    /// The network panel.
    pub network: Panel,
    /// Frames drawn since the page was opened.
    pub drawn_frames: u64,
    tags: Tags,
    graphics: Option<Graphics>,
    /// Why there are no graphics, once it was tried.
    unsupported: bool,
    /// When the browser took the drawing context, until it gives it back.
    context_lost_ms: Option<f64>,
    quality: Quality,
    /// All pixels are drawn, however long they take.
    sharp: bool,
    shown: Option<&'static str>,
    /// A frame of the game that is on was drawn.
    world_shown: bool,
    calm: bool,
    keep_pixels: bool,
}

thread_local! {
    static APP: RefCell<Option<App>> = const { RefCell::new(None) };
}

/// Works on the app. Does nothing when called from within such work, which only events of our own
/// making (a focus that moves) could do.
pub fn with<R>(work: impl FnOnce(&mut App) -> R) -> Option<R> {
    APP.with(|cell| {
        let mut guard = cell.try_borrow_mut().ok()?;
        guard.as_mut().map(work)
    })
}

/// Builds the app, listens to the page, shows what the address asks for.
pub fn start() {
    notice::listen();
    let query = dom::window().location().search().unwrap_or_default();
    // A bad network for tests, and for links to one: `?lag=150,30` or `?lag=300,100,stalls`.
    socket::set_lag(api::query_value(&query, "lag").and_then(Lag::parse).unwrap_or(Lag::OFF));
    let appearance = profile::load();
    lobby::wear(appearance.color);
    let app = App {
        appearance,
        lobby: Lobby::default(),
        play: None,
        screening: None,
        card: None,
        touchpad: Touchpad::default(),
        hud: Hud::default(),
        network: Panel::default(),
        drawn_frames: 0,
        tags: Tags::default(),
        graphics: None,
        unsupported: false,
        context_lost_ms: None,
        quality: Quality::default(),
        // For who would rather wait than see fewer pixels: `?sharp=1`.
        sharp: api::query_value(&query, "sharp") == Some("1"),
        shown: None,
        world_shown: false,
        calm: dom::media("(prefers-reduced-motion: reduce)"),
        keep_pixels: false,
    };
    APP.with(|cell| *cell.borrow_mut() = Some(app));
    lobby::listen();
    super::controls::listen();
    network::listen();
    deck::listen();
    files::listen();
    graphics::watch_context(
        || {
            with(App::lose_graphics);
        },
        || {
            with(|app| {
                app.context_lost_ms = None;
                app.show_state();
            });
        },
    );
    dom::listen(&dom::window(), "popstate", |_: web_sys::Event| {
        with(App::route);
    });
    dom::listen(&dom::window(), "online", |_: web_sys::Event| {
        with(|app| app.play.as_mut().map(Play::hurry));
    });
    dom::every(PULSE_MS, || {
        with(App::pulse);
    });
    with(App::route);
    run_frames();
}

/// Calls `App::frame` for every frame of the browser.
fn run_frames() {
    thread_local! {
        static FRAME: Closure<dyn FnMut(f64)> = Closure::new(|_: f64| {
            with(App::frame);
            run_frames();
        });
    }
    FRAME.with(|closure| {
        dom::window()
            .request_animation_frame(closure.as_ref().unchecked_ref())
            .expect("a window draws frames");
    });
}

/// Enters a room from the lobby: the address becomes the room's link.
pub fn enter(code: &str) {
    go_to(&format!("/{code}"));
}

/// Back to the lobby.
pub fn leave() {
    go_to("/");
}

/// Watches a file; going back leads to where one was.
pub fn open_file(name: String, bytes: Vec<u8>) {
    with(|app| app.open_replay(None, name, bytes));
    let watching = with(|app| app.watch().is_some_and(|watch| watch.name.is_none()));
    let here = dom::window().location().hash().unwrap_or_default();
    if watching == Some(true) && here != FILE_HASH {
        let history = dom::window().history().expect("a page has a history");
        let _ = history.push_state_with_url(&JsValue::NULL, "", Some(&format!("/{FILE_HASH}")));
    }
}

fn go_to(path: &str) {
    let history = dom::window().history().expect("a page has a history");
    if history.push_state_with_url(&JsValue::NULL, "", Some(path)).is_ok() {
        with(App::route);
    }
}

fn report(generation: u32, event: SocketEvent) {
    with(|app| {
        if let Some(play) = &mut app.play {
            play.on_socket(generation, event);
        }
        app.show_state();
    });
}

impl App {
    /// Shows what the address asks for.
    fn route(&mut self) {
        let location = dom::window().location();
        let path = location.pathname().unwrap_or_default();
        let query = location.search().unwrap_or_default();
        self.end_play();
        if let Some(request) = DemoRequest::parse(&query) {
            self.start_demo(&request);
        } else if let Some(name) = api::replay_name(&path) {
            self.fetch_replay(name);
        } else if let Some(code) = room_code(&path) {
            self.play = Some(Play::join(code, self.appearance.clone(), report));
        } else {
            self.lobby.show(&self.appearance, dom::now_ms());
        }
        self.show_state();
        if self.play.is_some() {
            let _ = dom::by_id::<HtmlElement>("stage").focus();
        }
    }

    /// Leaves game or replay.
    pub fn end_play(&mut self) {
        self.screening = None;
        self.card = None;
        if let Some(play) = self.play.take() {
            play.leave();
        }
        self.world_shown = false;
        self.quality = Quality::default();
        dom::root().dataset().delete("world");
        self.hud.clear();
        self.network.clear();
        self.tags.clear();
        self.touchpad.release();
        ask::withdraw();
        notice::hide();
        modal::set_help(false);
    }

    fn start_demo(&mut self, request: &DemoRequest) {
        let mut scenes = Scene::built_in();
        let Some(place) = scenes.iter().position(|scene| scene.name == request.scene) else {
            return notice::show(&words::NO_SUCH_SCENE);
        };
        let scene = Arc::new(scenes.swap_remove(place));
        let demo = Demo::new(scene, request.seed, request.bots, request.ticks.is_some());
        let appearance = match request.ticks {
            // The picture must not depend on who looks at it.
            Some(_) => Appearance { name: "Jo".into(), color: 0 },
            None => self.appearance.clone(),
        };
        let mut play = Play::demo(demo, appearance);
        self.keep_pixels = true;
        if let Some(ticks) = request.ticks {
            play.freeze_at(ticks);
            lobby::wear(0);
            dom::set(&dom::root(), "data-hud", if request.hud { "yes" } else { "no" });
            self.drawn_frames = 0;
        }
        self.play = Some(play);
    }

    /// What `data-state` says now. A frozen picture counts once it is drawn.
    pub fn state(&self) -> &'static str {
        match &self.screening {
            Some(Screening::On(_)) if self.unsupported => return "unsupported",
            Some(Screening::On(_)) => return "replay",
            Some(Screening::Fetching(_)) => return "connecting",
            Some(Screening::Failed) => return "refused",
            None => {}
        }
        match &self.play {
            _ if self.unsupported && self.play.is_some() => "unsupported",
            Some(play) if play.state() == State::Frozen && self.drawn_frames == 0 => "connecting",
            Some(play) => play.state().name(),
            None if notice::is_shown() => "refused",
            None => "lobby",
        }
    }

    /// Tells the page's styles, tests and reader what state it is in.
    pub fn show_state(&mut self) {
        let state = self.state();
        if self.shown != Some(state) {
            self.shown = Some(state);
            let _ = dom::root().dataset().set("state", state);
        }
        match &self.screening {
            Some(Screening::Fetching(_)) => notice::show(&words::FETCHING),
            Some(Screening::On(_)) if self.unsupported => notice::show(&words::NO_WEBGL2),
            Some(Screening::On(_)) if self.context_is_gone() => notice::show(&words::GRAPHICS_LOST),
            Some(Screening::On(_)) if self.card.is_none() => notice::hide(),
            _ => {}
        }
        let Some(play) = &self.play else { return };
        match (state, &play.notice) {
            ("unsupported", _) => notice::show(&words::NO_WEBGL2),
            ("refused", Some(reason)) => notice::show(reason),
            _ if self.context_is_gone() => notice::show(&words::GRAPHICS_LOST),
            ("connecting", _) if play.state() == State::Connecting => {
                notice::show(&words::connecting(play.attempts()));
            }
            ("reconnecting", _) => notice::show(play.loss()),
            _ => notice::hide(),
        }
    }

    /// What does not wait for a frame.
    fn pulse(&mut self) {
        let now = dom::now_ms();
        if let Some(play) = &mut self.play {
            if play.wants_socket(now) {
                play.connect(report);
            }
        } else if self.screening.is_none() && !notice::is_shown() {
            self.lobby.refresh(now);
        }
        self.show_state();
    }

    /// One frame of the browser.
    fn frame(&mut self) {
        if self.watch().is_some() {
            return self.frame_of_film();
        }
        if self.play.is_none() {
            return;
        }
        self.ready_graphics();
        let now = dom::now_ms();
        let frozen = self.play.as_ref().is_some_and(|play| play.state() == State::Frozen);
        let share = if frozen || self.sharp { 1.0 } else { self.quality.frame(now) };
        let size = self.graphics.as_mut().and_then(|graphics| graphics.fit(share));
        let bottom_css = self.hud.bottom_css();
        let canvas = size.map(|pixels| {
            let bottom = (bottom_css / css_per_pixel(pixels)) as u32;
            Canvas { pixels, bottom }
        });
        let Some(play) = &mut self.play else { return };
        play.advance(now, canvas);
        if let Some(replica) = play.replica() {
            self.touchpad.adopt_scene(&replica.scene);
            let _ = dom::root().dataset().set("tick", &format!("{:.0}", replica.display().floor()));
        }
        if size.is_some() && self.context_lost_ms.is_none() {
            self.draw(now);
        }
        if let Some(play) = &mut self.play
            && self.hud.update(play, now)
        {
            self.network.update(play, now);
        }
        self.show_state();
    }

    /// One frame of the browser while a film is on.
    fn frame_of_film(&mut self) {
        let anew = self.graphics.is_none();
        self.ready_graphics();
        let now = dom::now_ms();
        let playing = self.watch().is_some_and(|watch| watch.film.is_playing());
        // What stands still has the time to be sharp.
        let share = if playing && !self.sharp { self.quality.frame(now) } else { 1.0 };
        let size = self.graphics.as_mut().and_then(|graphics| graphics.fit(share));
        let covered = dom::by_id::<HtmlElement>("deck").get_bounding_client_rect();
        let stage_css = f64::from(dom::by_id::<HtmlElement>("stage").client_height());
        let bottom_css = (stage_css - covered.top()).max(0.0) as f32;
        let canvas = size.map(|pixels| {
            let bottom = (bottom_css / css_per_pixel(pixels)) as u32;
            Canvas { pixels, bottom }
        });
        let ready = size.is_some() && self.context_lost_ms.is_none();
        let Some(Screening::On(watch)) = &mut self.screening else { return };
        watch.advance(now, canvas);
        if anew {
            watch.forget_drawn();
        }
        let _ = dom::root().dataset().set("tick", &watch.film.tick().to_string());
        if ready {
            self.draw_film(now);
        }
        if let Some(Screening::On(watch)) = &mut self.screening {
            watch.deck.update(&mut watch.film, now);
        }
        self.show_state();
    }

    fn draw_film(&mut self, now_ms: f64) {
        let (Some(Screening::On(watch)), Some(graphics)) =
            (&mut self.screening, &mut self.graphics)
        else {
            return;
        };
        graphics.prepare(&watch.film.replica().plan);
        let Some(frame) = watch.picture(self.calm) else { return };
        let drawn = graphics.draw(&frame);
        let view = frame.view;
        self.tags.update(watch.film.replica(), &view, css_per_pixel(view.pixels));
        if !drawn {
            return watch.forget_drawn();
        }
        watch.meter.drawn(now_ms);
        self.note_drawn();
    }

    fn note_drawn(&mut self) {
        if !self.world_shown {
            self.world_shown = true;
            let _ = dom::root().dataset().set("world", "yes");
            modal::rescue_focus();
        }
        self.drawn_frames += 1;
    }

    fn draw(&mut self, now_ms: f64) {
        let (Some(play), Some(graphics)) = (&mut self.play, &mut self.graphics) else { return };
        let Some(picture) = play.picture((now_ms / 1000.0) as f32, self.calm) else { return };
        graphics.prepare(&picture.replica.plan);
        let drawn = graphics.draw(&picture.frame);
        let css_per_pixel = css_per_pixel(picture.frame.view.pixels);
        self.tags.update(picture.replica, &picture.frame.view, css_per_pixel);
        if drawn {
            play.meter.drawn(now_ms);
            self.note_drawn();
        }
    }

    /// What the graphics have made, while there are any.
    pub fn made(&self) -> Option<Made> {
        self.graphics.as_ref().map(Graphics::made)
    }

    /// Sets up drawing when it is first needed.
    fn ready_graphics(&mut self) {
        if self.graphics.is_none() && !self.unsupported && self.context_lost_ms.is_none() {
            self.graphics = Graphics::new(self.keep_pixels);
            self.unsupported = self.graphics.is_none();
        }
    }

    /// The browser took the context: nothing that was made with it works, also not once there is
    /// another. The next frame after that makes everything anew.
    fn lose_graphics(&mut self) {
        self.context_lost_ms.get_or_insert(dom::now_ms());
        self.graphics = None;
    }

    fn context_is_gone(&self) -> bool {
        self.context_lost_ms.is_some_and(|since| dom::now_ms() - since >= CONTEXT_WAIT_MS)
    }

    /// Presses or lets go of buttons that are not keys, and says so at once.
    pub fn press(&mut self, buttons: Buttons, down: bool) {
        if let Some(play) = &mut self.play {
            play.controls.press(buttons, down);
            play.speak(dom::now_ms());
        }
    }

    /// Lets go of everything: no key may stick when its release is never seen.
    pub fn release(&mut self) {
        self.touchpad.release();
        if let Some(play) = &mut self.play {
            play.controls.release();
            play.speak(dom::now_ms());
        }
    }

    /// Does what the button of a notice says, as far as it concerns this page.
    pub fn take_way(&mut self, way: Way) {
        match way {
            Way::Stay => {
                self.card = None;
                notice::hide();
            }
            Way::Refetch => self.route(),
            _ => {}
        }
        let Some(play) = &mut self.play else { return };
        match (way, play.state()) {
            (Way::Again, State::Refused) => play.connect(report),
            (Way::Again, _) => play.hurry(),
            _ => {}
        }
        self.show_state();
    }
}

/// CSS pixels a device pixel.
pub fn css_per_pixel(pixels: [u32; 2]) -> f32 {
    let stage: HtmlElement = dom::by_id("stage");
    stage.client_width() as f32 / pixels[0].max(1) as f32
}

/// The room that a path names.
fn room_code(path: &str) -> Option<&str> {
    let code = path.trim_matches('/');
    (!code.is_empty() && code != "index.html").then_some(code)
}
