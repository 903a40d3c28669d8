//! The lobby: name, colour, the big button, open rooms, scenes, replays. The forms are in `index.html`;
//! here they are filled and listened to.

use crate::language::{fill, say};
use crate::net::api::bots_alone;
use crate::page::app::App;
use crate::page::best_runs::Records;
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::dom::records::on_card;
use crate::page::event::{Event, Form};
use crate::page::lobby::Lobby;
use crate::page::queue::Events;
use crate::page::{name, strings};
use jostle_protocol::web::{ReplayCard, RoomCard, SceneCard};
use jostle_sim::TICKS_PER_SECOND;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlElement, HtmlInputElement, InputEvent, MouseEvent, PointerEvent};

/// Shelves and the lists that show them.
const CATEGORIES: [(&str, &str); 3] =
    [("games", "game-list"), ("playgrounds", "playground-list"), ("book", "book-list")];

/// Replays that a folded list shows: the style sheet hides the others.
const FOLDED: usize = 6;

/// The lobby as it was shown last.
pub struct LobbyView {
    /// With the number of the screen.
    shown: Option<(u32, Lobby, Records)>,
    rooms: List,
    scenes: [(&'static str, List); 3],
    replays: List,
}

impl LobbyView {
    /// Nothing was shown yet.
    pub fn new() -> LobbyView {
        let [rooms, replays] = ["room-list", "replay-list"].map(List::new);
        let scenes = CATEGORIES.map(|(category, id)| (category, List::new(id)));
        LobbyView { shown: None, rooms, scenes, replays }
    }

    /// Has everything made again.
    pub fn clear(&mut self) {
        self.shown = None;
        let scenes = self.scenes.iter_mut().map(|(_, list)| list);
        [&mut self.rooms, &mut self.replays]
            .into_iter()
            .chain(scenes)
            .for_each(|list| list.show([]));
    }

    pub fn show(&mut self, app: &App) {
        load_visible();
        let (lobby, records) = (&app.lobby, &app.records);
        let screen = self.shown.as_ref().map(|shown| shown.0);
        if screen != Some(app.screen) {
            dom::by_id::<HtmlInputElement>("name").set_value(&app.appearance.name);
            dom::check("colors", &app.appearance.color.to_string());
        } else if self.shown.as_ref().is_some_and(|shown| (&shown.1, &shown.2) == (lobby, records))
        {
            return;
        }
        let before = self.shown.replace((app.screen, lobby.clone(), records.clone()));
        let before = before.map(|(_, lobby, _)| lobby.note);
        dom::text("lobby-note", say(&lobby.note.text));
        // What went wrong is seen wherever the page was scrolled to.
        if lobby.note.bad && before.as_ref() != Some(&lobby.note) {
            dom::html("lobby-note").scroll_into_view_with_bool(false);
            if lobby.name_invalid {
                let _ = dom::html("name").focus();
            }
        }
        let class = if lobby.note.bad { "note bad" } else { "note" };
        dom::set(&dom::html("lobby-note"), "class", Some(class));
        dom::set(&dom::html("name"), "aria-invalid", lobby.name_invalid.then_some("true"));
        dom::set(&dom::html("play"), "aria-busy", lobby.busy.then_some("true"));
        dom::show("no-rooms", lobby.rooms_known && lobby.rooms.is_empty());
        for (category, list) in &mut self.scenes {
            let on_it = lobby.scenes.iter().filter(|scene| category_of(scene) == *category);
            list.show(on_it.map(|scene| scene_entry(scene, records)));
        }
        self.rooms.show(lobby.rooms.iter().map(|room| room_entry(lobby, room)));
        self.replays.show(lobby.replays.iter().map(|replay| replay_entry(lobby, replay)));
        let is_folded = dom::html("replay-list").class_list().contains("folded");
        dom::show("all-replays", is_folded && lobby.replays.len() > FOLDED);
    }
}

/// Loads the pictures of scenes that are in view. Browsers load lazy ones from far below, and few visits get that
/// far. The page pulses, so that this follows what is scrolled.
fn load_visible() {
    let height = f64::from(dom::root().client_height());
    let waiting = dom::document().query_selector_all("img[data-src]").expect("a valid selector");
    for at in 0..waiting.length() {
        let Some(image) = waiting.item(at).and_then(|node| node.dyn_into::<Element>().ok()) else {
            continue;
        };
        let place = image.get_bounding_client_rect();
        if place.height() > 0.0 && place.top() < height {
            dom::set(&image, "src", image.get_attribute("data-src").as_deref());
            dom::set(&image, "data-src", None);
        }
    }
}

pub fn form() -> Form {
    let checked = dom::query::<HtmlInputElement>("#colors input:checked");
    Form {
        name: dom::by_id::<HtmlInputElement>("name").value(),
        color: checked.and_then(|radio| radio.value().parse().ok()).unwrap_or(0),
        private: dom::by_id::<HtmlInputElement>("private").checked(),
        bots: dom::by_id::<HtmlInputElement>("bots").checked(),
    }
}

pub fn listen(events: Events) {
    let join = dom::html("join");
    dom::listen(&join, "submit", move |event: web_sys::Event| {
        event.prevent_default();
        events.push(Event::PlayClicked(form()));
    });
    dom::listen(&join, "input", move |event: web_sys::Event| {
        // Text that is still being composed belongs to the input method until it is done.
        if !event.dyn_ref::<InputEvent>().is_some_and(InputEvent::is_composing) {
            fit_name();
        }
        events.push(Event::FormChanged(form()));
    });
    dom::listen(&dom::html("name"), "compositionend", |_: web_sys::Event| fit_name());
    dom::listen(&dom::html("all-replays"), "click", |_: MouseEvent| {
        let _ = dom::html("replay-list").class_list().remove_1("folded");
        dom::show("all-replays", false);
        let next =
            dom::query::<HtmlElement>(&format!("#replay-list li:nth-child({}) a", FOLDED + 1));
        next.into_iter().for_each(|link| drop(link.focus()));
    });
    dom::listen(&dom::html("lobby"), "pointermove", |event: PointerEvent| follow(&event));
}

/// The wordmark's hero looks at the pointer.
fn follow(event: &PointerEvent) {
    let Some(hero) = dom::query::<Element>(".block.hero") else { return };
    let bounds = hero.get_bounding_client_rect();
    let dx = f64::from(event.client_x()) - (bounds.left() + bounds.width() * 0.5);
    let dy = f64::from(event.client_y()) - (bounds.top() + bounds.height() * 0.5);
    let length = (dx * dx + dy * dy).sqrt().max(60.0);
    dom::style(&hero, "--gaze-x", &format!("{:.2}", dx / length));
    dom::style(&hero, "--gaze-y", &format!("{:.2}", dy / length));
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

fn replay_entry(lobby: &Lobby, replay: &ReplayCard) -> Item {
    let scene = lobby.scenes.iter().find(|scene| scene.name == replay.scene);
    let title = scene.map_or(&replay.scene, |scene| &scene.title);
    let ago = strings::ago(js_sys::Date::now() / 1000.0 - replay.unix_s as f64);
    let length = match replay.seconds {
        Some(seconds) => strings::clock(f64::from(seconds) * f64::from(TICKS_PER_SECOND), false),
        None => strings::size(replay.bytes),
    };
    let length = match replay.players {
        0 => length,
        1 => fill("1 player, {length}", &[("length", &length)]),
        many => {
            let count = many.to_string();
            fill("{count} players, {length}", &[("count", &count), ("length", &length)])
        }
    };
    let when = if replay.unix_s == 0 { &replay.name } else { &ago };
    link(Item::new("replay-item", &replay.name), &format!("replay/{}", replay.name), scene)
        .text("strong", say(title))
        .text(".code", format!("/{} \u{b7} {when}", replay.room))
        .text(".seats span", length)
        .with(".live", "hidden", (!replay.recording).then(String::new))
}

fn room_entry(lobby: &Lobby, room: &RoomCard) -> Item {
    let scene = lobby.scenes.iter().find(|scene| scene.name == room.scene);
    let full = room.players >= room.players_max;
    let [players, players_max] = [room.players, room.players_max].map(|count| count.to_string());
    let seats = fill("{count} of {all}", &[("count", &players), ("all", &players_max)]);
    let watching = strings::watching(room.spectators);
    let share = 100.0 * f64::from(room.players) / f64::from(room.players_max.max(1));
    link(Item::new("room-item", &room.code), &room.code, scene)
        .with("a", "aria-disabled", full.then(|| "true".to_owned()))
        .text("strong", say(&room.title))
        .text(".code", format!("/{}", room.code))
        .with(".seats", "aria-label", fill("{seats} seats taken", &[("seats", &seats)]))
        .text(".seats span", seats + &watching)
        .with(".watch", "href", format!("/{}?watch=1", room.code))
        .with(".watch", "data-value", room.code.clone())
        .with(".watch", "aria-label", fill("Watch {scene}", &[("scene", say(&room.title))]))
        .with(".bar", "--share", format!("{share:.0}%"))
}

/// With a link to a word of this server, and the picture of a scene.
fn link(item: Item, word: &str, scene: Option<&SceneCard>) -> Item {
    let picture = scene.and_then(|scene| scene.picture.as_ref());
    let item = item.with("a", "href", format!("/{word}")).with("a", "data-value", word.to_owned());
    item.with(".thumb", "--picture", picture.map(|picture| format!("url({picture:?})")))
}

/// The category that a scene is shown on; a server may know more of them.
fn category_of(scene: &SceneCard) -> &'static str {
    let known = CATEGORIES
        .iter()
        .map(|(category, _)| *category)
        .find(|category| *category == scene.category);
    known.unwrap_or("playgrounds")
}

/// How a scene is played, in a few words: by how many, in teams, for how long.
fn manner(scene: &SceneCard) -> String {
    let seats = match (scene.players_min, scene.players_max) {
        _ if dom::is_static() => String::new(),
        (_, 1) => say("1 player").to_owned(),
        (..=1, many) => fill("Up to {count} players", &[("count", &many.to_string())]),
        (few, many) => fill(
            "{count} to {most} players",
            &[("count", &few.to_string()), ("most", &many.to_string())],
        ),
    };
    let bots = if scene.fill > 0 && !dom::is_static() { say(" and bots") } else { "" };
    let teams =
        (scene.teams > 1).then(|| fill("{count} teams", &[("count", &scene.teams.to_string())]));
    let minutes = (scene.round_s > 0)
        .then(|| fill("{count} min", &[("count", &scene.round_s.div_ceil(60).to_string())]));
    let parts = [Some(seats + bots), teams, minutes].into_iter().flatten();
    parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

fn scene_entry(scene: &SceneCard, records: &Records) -> Item {
    let pictured = scene.picture.is_some();
    let bots = strings::bots(bots_alone(scene));
    let alone = fill("Play alone {bots}", &[("bots", &bots)]);
    let name = fill("Play {scene} alone {bots}", &[("scene", say(&scene.title)), ("bots", &bots)]);
    let item = Item::new("scene-item", &scene.name);
    on_card(item, records, &scene.name, scene.heroes)
        .with("button", "data-value", scene.name.clone())
        .with("a.edit", "data-value", scene.name.clone())
        .with("a.edit", "href", format!("#edit={}", scene.name))
        .with("a.edit", "aria-label", fill("Edit {scene}", &[("scene", say(&scene.title))]))
        .with("img", "hidden", (!pictured).then(String::new))
        .with("img", "data-src", scene.picture.clone())
        .with("span.picture", "hidden", pictured.then(String::new))
        .text("strong", say(&scene.title))
        .text(".about", say(&scene.about))
        .text(".go span", manner(scene))
        .with(".go span", "data-bots", (!bots.is_empty()).then_some(bots))
        .with(".alone", "data-value", scene.name.clone())
        .with(".alone", "aria-label", name.trim_end().to_owned())
        .text(".alone", alone.trim_end())
}
