//! The root of the page, which passes queued events to the app, performs the effects, and lets the views show the
//! result.

use crate::browser;
use crate::net::api::{FILES, Request, scene_file};
use crate::net::http;
use crate::net::report::Fetched;
use crate::net::report::SocketEvent;
use crate::net::socket::{Conditions, Socket};
use crate::page::app::{App, Startup};
use crate::page::dom;
use crate::page::dom::editor;
use crate::page::dom::listeners;
use crate::page::dom::settings;
use crate::page::dom::views::Views;
use crate::page::drafts::DraftStore;
use crate::page::event::{Address, Effect, Event, SettingsEvent};
use crate::page::queue::{self, Events, QueuedEvent};
use crate::page::storage::Storage;
use crate::sound::player::{Player, Silence};
use crate::sound::task::{SoundEvent, SoundTask};
use std::cell::RefCell;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{DragEvent, HtmlInputElement};

/// Interval of the pulse that reconnects and refreshes, milliseconds.
const PULSE_MS: i32 = 200;
/// Close code for a socket that the browser refused to open (RFC 6455: no close frame).
const NOT_OPENED: u16 = 1006;

pub struct Page {
    pub app: App,
    pub views: Views,
    events: Events,
    socket: Option<Socket>,
    conditions: Conditions,
    pub player: Player,
    files: Files,
}

/// The folder that contains all files. Without a server, the document specifies its location.
#[derive(Clone)]
struct Files(Option<String>);

impl Files {
    fn folder(&self) -> &str {
        self.0.as_deref().unwrap_or(FILES)
    }

    /// The HTTP method and address of a request. Without a server, the list of scenes is a file.
    fn target(&self, request: &Request) -> (&'static str, String) {
        match (request, &self.0) {
            (Request::Scenes, Some(folder)) => ("GET", format!("{folder}/scenes.json")),
            _ => request.target(),
        }
    }
}

thread_local! {
    static PAGE: RefCell<Option<Page>> = const { RefCell::new(None) };
}

/// Called once when the wasm module is loaded.
#[wasm_bindgen(start)]
fn main() {
    // A panic ends this instance, and without this hook would be reported only as "unreachable". The page may stay
    // borrowed forever, so from here on only code that does not need the page works.
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&JsValue::from_str(&info.to_string()));
        if !browser::is_in_attempt() {
            queue::crash();
            dom::crash::show();
        }
    }));
    let query = browser::window().location().search().unwrap_or_default();
    let files = Files(dom::root().get_attribute("data-static"));
    let startup = Startup {
        storage: Storage {
            local: browser::stored(browser::local_storage().as_ref()),
            session: browser::stored(browser::session_storage().as_ref()),
            writes: Vec::new(),
        },
        seed: (js_sys::Math::random() * 2f64.powi(53)) as u64,
        calm: browser::media("(prefers-reduced-motion: reduce)"),
        touched: browser::media("(pointer: coarse)"),
        is_static: files.0.is_some(),
        is_framed: browser::is_framed(),
        origin: browser::window().location().origin().unwrap_or_default(),
        language: browser::window().navigator().language().unwrap_or_default(),
        query,
    };
    let mut app = App::new(startup);
    app.ctx.clock = browser::now_ms;
    app.ctx.unix_s = || js_sys::Date::now() / 1000.0;
    let events = Events::new(drain);
    let views = Views::new(events, &app);
    let (socket, conditions) = (None, Conditions::default());
    let player = Player::default();
    PAGE.set(Some(Page { app, views, events, socket, conditions, player, files }));
    listeners::all(events);
    dom::listen(&browser::window(), "popstate", move |_: web_sys::Event| {
        events.push(Event::Navigated(address()));
    });
    browser::every(PULSE_MS, move || {
        events.push(Event::Pulse { hidden: dom::document().hidden() });
    });
    events.push(Event::Navigated(address()));
    run_frames();
}

fn address() -> Address {
    let location = browser::window().location();
    Address {
        path: location.pathname().unwrap_or_default(),
        query: location.search().unwrap_or_default(),
        hash: location.hash().unwrap_or_default(),
    }
}

/// Handles every animation frame.
fn run_frames() {
    thread_local! {
        static FRAME: Closure<dyn FnMut(f64)> = Closure::new(|_: f64| {
            if !queue::has_crashed() {
                with(Page::frame);
                drain();
                run_frames();
            }
        });
    }
    FRAME.with(|closure| {
        browser::window()
            .request_animation_frame(closure.as_ref().unchecked_ref())
            .expect("a window draws frames");
    });
}

/// Calls `work` with the page, unless the page is already borrowed.
pub fn with<R>(work: impl FnOnce(&mut Page) -> R) -> Option<R> {
    PAGE.with(|cell| cell.try_borrow_mut().ok()?.as_mut().map(work))
}

/// Adds an event to the page's queue.
pub fn push(event: Event) {
    let events = with(|page| page.events);
    if let Some(events) = events {
        events.push(event);
    }
}

/// Handles all queued events, then shows the result.
fn drain() {
    with(|page| {
        let mut had_events = false;
        while let Some(arrival) = page.events.pop() {
            page.handle(arrival);
            had_events = true;
        }
        page.views.show(&page.app, had_events);
        // Showing may move the focus, which can trigger more events.
        while let Some(arrival) = page.events.pop() {
            page.handle(arrival);
            page.views.show(&page.app, true);
        }
    });
}

impl Page {
    fn handle(&mut self, QueuedEvent { event, source }: QueuedEvent) {
        for effect in self.app.update(browser::now_ms(), event) {
            self.perform(effect, source.as_ref());
        }
    }

    fn handle_own(&mut self, event: Event) {
        self.handle(QueuedEvent { event, source: None });
    }

    fn frame(&mut self) {
        if self.app.settings.has_pad {
            self.handle_own(Event::Settings(SettingsEvent::Pad(settings::pad_state())));
        }
        let canvas = self.views.canvas(&self.app);
        self.handle_own(Event::Frame(canvas));
        if canvas.is_some()
            && let Some(drawn) = self.views.draw(&self.app)
        {
            self.handle_own(Event::Drawn(drawn));
        }
        self.views.show_frame(&self.app);
    }

    fn perform(&mut self, effect: Effect, source: Option<&web_sys::Event>) {
        let events = self.events;
        match effect {
            Effect::PreventDefault => {
                source.into_iter().for_each(web_sys::Event::prevent_default);
            }
            Effect::OfferDrop(takes) => offer_drop(source, takes),
            Effect::PushAddress(path) => {
                let history = browser::window().history().expect("a page has a history");
                let _ = history.push_state_with_url(&JsValue::NULL, "", Some(&path));
            }
            Effect::Reload => _ = browser::window().location().reload(),
            Effect::ChooseFile => dom::by_id::<HtmlInputElement>("file").click(),
            Effect::CopyAddress => {
                dom::copy_address(move |copied| events.push(Event::Copied(copied)));
            }
            Effect::FocusStage => self.views.focus_stage = true,
            Effect::Connect { path, session, origin, over_http } => {
                self.connect(origin, &path, over_http, session);
            }
            Effect::Send(bytes) => self.socket.iter().for_each(|socket| socket.send(&bytes)),
            Effect::Disconnect { leaving } => match self.socket.take() {
                Some(socket) if leaving => socket.leave(),
                socket => drop(socket),
            },
            Effect::SetConditions(conditions) => self.conditions.set(conditions),
            Effect::Request(request) => call(events, &self.files, request),
            Effect::FetchScene(name) => fetch_scene(events, &self.files, name),
            Effect::FetchReplay(file) => fetch_replay(events, file),
            Effect::StoreLocal(key, value) => {
                store(browser::local_storage(), &key, value.as_deref());
            }
            Effect::StoreSession(key, value) => {
                store(browser::session_storage(), &key, value.as_deref());
            }
            Effect::StoreDraft(draft) => {
                let kept = browser::local_storage().and_then(|mut store| draft.keep(&mut store));
                events.push(Event::DraftKept(draft, kept));
            }
            Effect::SaveFile(name, text) => editor::save(&name, &text),
            Effect::SaveClip(bytes) => editor::save_bytes("clip.jostle", &bytes),
            Effect::CopyLink(link) => {
                dom::copy(&link, move |copied| events.push(Event::Copied(copied)));
            }
            Effect::FocusText(at) => self.views.focus_text = Some(at),
            Effect::DropGraphics => self.views.stage.drop_graphics(),
            Effect::FetchLanguage(language) => fetch_language(events, language),
            Effect::FetchWords => fetch_words(events),
            Effect::FullScreen(wanted) => settings::full_screen(wanted),
            Effect::Sound(task) => self.sound(&task),
            Effect::After(delay_ms, event) => {
                browser::after(delay_ms, move || events.push(event));
            }
            Effect::Warn(text) => browser::warn(&text),
        }
    }

    fn sound(&mut self, task: &SoundTask) {
        let silence = match self.player.carry_out(task) {
            Ok(()) => return,
            Err(Silence::Missing) => SoundEvent::Missing,
            Err(Silence::Blocked) => SoundEvent::Blocked,
        };
        self.events.push(Event::Sound(silence));
    }

    fn connect(&mut self, origin: String, path: &str, over_http: bool, session: u32) {
        let events = self.events;
        let report = move |event| events.push(Event::Socket(session, event));
        self.socket = Socket::open(origin, path, over_http, &self.conditions, report);
        if self.socket.is_none() {
            events.push(Event::Socket(session, SocketEvent::Closed { code: NOT_OPENED }));
        }
    }
}

fn fetch_scene(events: Events, files: &Files, name: String) {
    http::fetch(&scene_file(files.folder(), &name), move |fetched| {
        events.push(Event::SceneFetched(name, fetched));
    });
}

fn fetch_replay(events: Events, file: String) {
    http::fetch(&file.clone(), move |fetched| events.push(Event::ReplayFetched(file, fetched)));
}

fn fetch_language(events: Events, language: String) {
    let came = move |language, file| {
        events.push(Event::Settings(SettingsEvent::LanguageCame(language, file)));
    };
    match settings::language_file(&language) {
        Some(address) => http::fetch(&address, move |fetched| {
            let text = match fetched {
                Fetched::Bytes(bytes) => String::from_utf8(bytes).ok(),
                _ => None,
            };
            came(language, text);
        }),
        None => came(language, None),
    }
}

fn fetch_words(events: Events) {
    let [docs, fields] = editor::word_files();
    http::fetch(&fields, move |fetched| {
        if let Fetched::Bytes(bytes) = fetched
            && let Ok(fields) = String::from_utf8(bytes)
        {
            events.push(Event::WordsCame([docs, fields]));
        }
    });
}

fn call(events: Events, files: &Files, request: Request) {
    let (method, path) = files.target(&request);
    http::call(&request.clone(), (method, &path), move |answer| {
        events.push(Event::Answered(request, answer));
    });
}

/// Writes a value. If storage is full or blocked, the value is simply missing on the next visit.
fn store(storage: Option<web_sys::Storage>, key: &str, value: Option<&str>) {
    storage.into_iter().for_each(|mut storage| _ = storage.write(key, value));
}

impl DraftStore for web_sys::Storage {
    fn read(&self, key: &str) -> Option<String> {
        self.get_item(key).ok().flatten()
    }

    fn write(&mut self, key: &str, value: Option<&str>) -> bool {
        let done = match value {
            Some(value) => self.set_item(key, value),
            None => self.remove_item(key),
        };
        done.is_ok()
    }
}

/// Indicates whether a dragged file would be accepted.
fn offer_drop(source: Option<&web_sys::Event>, takes: bool) {
    let data = source.and_then(|source| source.dyn_ref::<DragEvent>()?.data_transfer());
    if let Some(data) = data {
        data.set_drop_effect(if takes { "copy" } else { "none" });
    }
    dom::mark("data-dropping", takes);
}
