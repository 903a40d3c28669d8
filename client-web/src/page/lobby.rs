//! The lobby: name, colour, the big button, open rooms, scenes. The forms are in `index.html`;
//! here they are filled and listened to.

use super::app;
use super::{dom, http, profile};
use crate::api::{self, Opened, ReplayCard, Replays, Room, Rooms, SceneCard, Scenes};
use crate::name;
use crate::words;
use jostle_protocol::{Appearance, Token};
use wasm_bindgen::JsCast;
use web_sys::{
    Event, HtmlElement, HtmlImageElement, HtmlInputElement, InputEvent, MouseEvent, PointerEvent,
};

/// Rooms are asked for so often, milliseconds.
const REFRESH_MS: f64 = 3000.0;
/// Replays are asked for so often, milliseconds: each answer may be long.
const REPLAYS_MS: f64 = 15_000.0;
/// Said while rooms are asked for in vain.
const UNANSWERED: &str = "The server does not answer; the list may be old.";

/// What the lobby knows.
#[derive(Default)]
pub struct Lobby {
    rooms: Vec<Room>,
    scenes: Vec<SceneCard>,
    replays: Vec<ReplayCard>,
    asked_ms: f64,
    replays_asked_ms: Option<f64>,
    busy: bool,
}

/// Listens to the lobby's forms.
pub fn listen() {
    dom::listen(&dom::by_id::<HtmlElement>("join"), "submit", |event: Event| {
        event.prevent_default();
        if remember() {
            app::with(|app| app.lobby.play());
        }
    });
    dom::listen(&dom::by_id::<HtmlElement>("join"), "input", |event: Event| {
        // What is still being composed is the input method's until it is done.
        if !event.dyn_ref::<InputEvent>().is_some_and(InputEvent::is_composing) {
            fit_name();
        }
        remember();
    });
    dom::listen(&dom::by_id::<HtmlElement>("name"), "compositionend", |_: Event| {
        fit_name();
    });
    for list in ["room-list", "replay-list"] {
        dom::listen(&dom::by_id::<HtmlElement>(list), "click", |event: MouseEvent| {
            let plain = !(event.ctrl_key() || event.meta_key() || event.shift_key());
            let link = dom::target_within(&event, "a").filter(|_| plain);
            if let Some(word) = link.and_then(|link| link.get_attribute("data-code")) {
                event.prevent_default();
                app::enter(&word);
            }
        });
    }
    dom::listen(&dom::by_id::<HtmlElement>("scene-list"), "click", |event: MouseEvent| {
        let button = dom::target_within(&event, "button");
        if let Some(scene) = button.and_then(|button| button.get_attribute("data-scene")) {
            app::with(|app| app.lobby.open(&scene));
        }
    });
    dom::listen(&dom::by_id::<HtmlElement>("lobby"), "pointermove", |event: PointerEvent| {
        follow(&event);
    });
}

/// The wordmark's hero looks at the pointer.
fn follow(event: &PointerEvent) {
    let Ok(Some(hero)) = dom::document().query_selector(".block.hero") else { return };
    let place = hero.get_bounding_client_rect();
    let dx = f64::from(event.client_x()) - (place.left() + place.width() * 0.5);
    let dy = f64::from(event.client_y()) - (place.top() + place.height() * 0.5);
    let length = (dx * dx + dy * dy).sqrt().max(60.0);
    if let Ok(hero) = hero.dyn_into::<HtmlElement>() {
        dom::style(&hero, "--gaze-x", &format!("{:.2}", dx / length));
        dom::style(&hero, "--gaze-y", &format!("{:.2}", dy / length));
    }
}

/// Cuts what is in the field to a name's length; the browser would count halves of characters.
fn fit_name() {
    let input: HtmlInputElement = dom::by_id("name");
    let typed = input.value();
    let fitting = name::fit(&typed);
    if fitting.len() < typed.len() {
        let caret = input.selection_end().ok().flatten();
        input.set_value(fitting);
        if let Some(caret) = caret {
            let _ = input.set_selection_range(caret, caret);
        }
    }
}

/// Reads name and colour from the form and remembers them; `false` if the name is none, which is
/// said below the form.
fn remember() -> bool {
    let input: HtmlInputElement = dom::by_id("name");
    let checked = dom::document().query_selector("#colors input:checked").ok().flatten();
    let color = checked.and_then(|e| e.get_attribute("value")).and_then(|v| v.parse().ok());
    let color = color.unwrap_or(0);
    wear(color);
    match Appearance::new(name::finished(&input.value()), color) {
        Ok(appearance) => {
            let _ = input.remove_attribute("aria-invalid");
            say("", false);
            profile::save(&appearance);
            app::with(|app| app.appearance = appearance);
            true
        }
        Err(error) => {
            dom::set(&input, "aria-invalid", "true");
            say(&error.to_string(), true);
            false
        }
    }
}

/// The page takes the player's colour.
pub fn wear(color: u8) {
    dom::style(&dom::root(), "--own", &format!("var(--player-{color})"));
}

fn say(text: &str, bad: bool) {
    let note: HtmlElement = dom::by_id("lobby-note");
    dom::set_text(&note, text);
    let _ = note.class_list().toggle_with_force("bad", bad);
}

/// Takes a note back, if it is the one that is shown.
fn unsay(text: &str) {
    if dom::by_id::<HtmlElement>("lobby-note").text_content().as_deref() == Some(text) {
        say("", false);
    }
}

impl Lobby {
    /// Fills the form for a player and asks the server what there is.
    pub fn show(&mut self, appearance: &Appearance, now_ms: f64) {
        dom::by_id::<HtmlInputElement>("name").set_value(&appearance.name);
        let selector = format!("#colors input[value='{}']", appearance.color);
        if let Ok(Some(swatch)) = dom::document().query_selector(&selector)
            && let Ok(swatch) = swatch.dyn_into::<HtmlInputElement>()
        {
            swatch.set_checked(true);
        }
        self.set_busy(false);
        say("", false);
        self.replays_asked_ms = None;
        self.ask(now_ms);
    }

    /// Asks for the rooms again if it is time.
    pub fn refresh(&mut self, now_ms: f64) {
        if now_ms - self.asked_ms >= REFRESH_MS && !dom::document().hidden() {
            self.ask(now_ms);
        }
    }

    /// Asks for the rooms, and for the scenes until they are known.
    fn ask(&mut self, now_ms: f64) {
        self.asked_ms = now_ms;
        if self.scenes.is_empty() {
            http::call("GET", "/api/scenes", None, |answer| {
                app::with(|app| app.lobby.take_scenes(answer));
            });
        }
        http::call("GET", "/api/rooms", None, |answer| {
            app::with(|app| app.lobby.take_rooms(answer));
        });
        if self.replays_asked_ms.is_none_or(|asked_ms| now_ms - asked_ms >= REPLAYS_MS) {
            self.replays_asked_ms = Some(now_ms);
            http::call("GET", "/api/replays", None, |answer| {
                app::with(|app| app.lobby.take_replays(answer));
            });
        }
    }

    fn take_replays(&mut self, answer: Option<String>) {
        let replays = answer.and_then(|text| serde_json::from_str::<Replays>(&text).ok());
        let Some(Replays { replays }) = replays else { return };
        if replays != self.replays {
            self.replays = replays;
            self.list_replays();
        }
    }

    fn take_rooms(&mut self, answer: Option<String>) {
        let rooms = answer.and_then(|text| serde_json::from_str::<Rooms>(&text).ok());
        let Some(Rooms { rooms }) = rooms else {
            return say(UNANSWERED, true);
        };
        unsay(UNANSWERED);
        if rooms != self.rooms {
            self.rooms = rooms;
            self.list_rooms();
        }
    }

    fn take_scenes(&mut self, answer: Option<String>) {
        let scenes = answer.and_then(|text| serde_json::from_str::<Scenes>(&text).ok());
        let Some(Scenes { scenes }) = scenes else { return };
        if scenes != self.scenes {
            self.scenes = scenes;
            self.list_scenes();
            self.list_rooms();
            self.list_replays();
        }
    }

    fn list_rooms(&self) {
        list_links("room-list", self.rooms.iter().map(|room| self.room_link(room)));
        dom::show(&dom::by_id("no-rooms"), self.rooms.is_empty());
    }

    fn list_replays(&self) {
        list_links("replay-list", self.replays.iter().map(|replay| self.replay_link(replay)));
    }

    fn replay_link(&self, replay: &ReplayCard) -> HtmlElement {
        let link = self.link_with_picture(&format!("replay/{}", replay.name), &replay.scene);
        let scene = self.scenes.iter().find(|scene| scene.name == replay.scene);
        let title = scene.map_or(&replay.scene, |scene| &scene.title);
        dom::append(&link, &dom::labelled("strong", "", title));
        let ago = words::ago(js_sys::Date::now() / 1000.0 - replay.unix_s as f64);
        let when = if replay.unix_s == 0 { replay.name.clone() } else { ago };
        let about = format!("/{} \u{b7} {when}", replay.room);
        dom::append(&link, &dom::labelled("span", "code", &about));
        let size = dom::element("span", "seats");
        dom::append(&size, &dom::labelled("span", "", &words::size(replay.bytes)));
        if replay.recording {
            dom::append(&size, &dom::labelled("span", "live", "recording"));
        }
        dom::append(&link, &size);
        link
    }

    /// A link to a word of this server, with the picture of a scene.
    fn link_with_picture(&self, word: &str, scene: &str) -> HtmlElement {
        let link = dom::element("a", "");
        dom::set(&link, "href", &format!("/{word}"));
        dom::set(&link, "data-code", word);
        let thumb = dom::element("span", "thumb");
        let scene = self.scenes.iter().find(|known| known.name == scene);
        if let Some(picture) = scene.and_then(|scene| scene.picture.as_ref()) {
            dom::style(&thumb, "background-image", &format!("url({picture:?})"));
        }
        dom::append(&link, &thumb);
        link
    }

    fn room_link(&self, room: &Room) -> HtmlElement {
        let link = self.link_with_picture(&room.code, &room.scene);
        if room.players >= room.players_max {
            dom::set(&link, "aria-disabled", "true");
        }
        dom::append(&link, &dom::labelled("strong", "", &room.title));
        dom::append(&link, &dom::labelled("span", "code", &format!("/{}", room.code)));
        let seats = dom::element("span", "seats");
        let text = format!("{} of {}", room.players, room.players_max);
        dom::set(&seats, "aria-label", &format!("{text} seats taken"));
        dom::append(&seats, &dom::labelled("span", "", &text));
        let (bar, level) = (dom::element("span", "bar"), dom::element("i", ""));
        let share = 100.0 * f64::from(room.players) / f64::from(room.players_max.max(1));
        dom::style(&level, "width", &format!("{share:.0}%"));
        dom::append(&bar, &level);
        dom::append(&seats, &bar);
        dom::append(&link, &seats);
        link
    }

    fn list_scenes(&self) {
        let list: HtmlElement = dom::by_id("scene-list");
        list.set_text_content(None);
        for scene in &self.scenes {
            let item = dom::element("li", "");
            dom::append(&item, &scene_button(scene));
            dom::append(&list, &item);
        }
    }

    /// Joins the liveliest room with a free seat, or opens the first scene.
    pub fn play(&mut self) {
        match api::liveliest(&self.rooms) {
            Some(room) => {
                let code = room.code.clone();
                dom::later(move || app::enter(&code));
            }
            None => self.open(api::FIRST_SCENE),
        }
    }

    /// Opens a room with a scene and enters it, as its host: one that is in no list, if that was
    /// ticked.
    pub fn open(&mut self, scene: &str) {
        if self.busy {
            return;
        }
        let private = dom::by_id::<HtmlInputElement>("private").checked();
        self.set_busy(true);
        say("Opening a room\u{2026}", false);
        http::call("POST", "/api/rooms", Some(&api::open_room(scene, private)), |answer| {
            app::with(|app| app.lobby.set_busy(false));
            let opened = answer.and_then(|text| serde_json::from_str::<Opened>(&text).ok());
            match opened {
                Some(Opened::Code { code, host_key }) => {
                    profile::set_host_key(&code, Token::parse(&host_key));
                    app::enter(&code);
                }
                Some(Opened::Error { error }) => say(&error, true),
                None => say("The server does not answer: check the connection.", true),
            }
        });
    }

    fn set_busy(&mut self, busy: bool) {
        self.busy = busy;
        let play: HtmlElement = dom::by_id("play");
        if busy {
            dom::set(&play, "aria-busy", "true");
        } else {
            let _ = play.remove_attribute("aria-busy");
        }
    }
}

/// Fills a list anew. Who goes through it by keys stays where they are.
fn list_links(id: &str, links: impl Iterator<Item = HtmlElement>) {
    let list: HtmlElement = dom::by_id(id);
    let focused = dom::document().active_element().and_then(|e| e.get_attribute("data-code"));
    list.set_text_content(None);
    for link in links {
        let item = dom::element("li", "");
        dom::append(&item, &link);
        dom::append(&list, &item);
        if focused.is_some() && focused == link.get_attribute("data-code") {
            let _ = link.focus();
        }
    }
}

fn scene_button(scene: &SceneCard) -> HtmlElement {
    let button = dom::element("button", "");
    dom::set(&button, "type", "button");
    dom::set(&button, "data-scene", &scene.name);
    match &scene.picture {
        Some(picture) => {
            let image = dom::element("img", "picture");
            dom::set(&image, "alt", "");
            dom::set(&image, "loading", "lazy");
            dom::set(&image, "width", "640");
            dom::set(&image, "height", "360");
            if let Some(image) = image.dyn_ref::<HtmlImageElement>() {
                image.set_src(picture);
            }
            dom::append(&button, &image);
        }
        None => dom::append(&button, &dom::element("span", "picture")),
    }
    dom::append(&button, &dom::labelled("strong", "", &scene.title));
    dom::append(&button, &dom::labelled("span", "about", &scene.about));
    let go = dom::element("span", "go");
    let seats = match scene.players_max {
        1 => "1 player".to_owned(),
        many => format!("up to {many} players"),
    };
    dom::append(&go, &dom::labelled("span", "", &seats));
    dom::append(&go, &dom::labelled("b", "", "Open"));
    dom::append(&button, &go);
    button
}
