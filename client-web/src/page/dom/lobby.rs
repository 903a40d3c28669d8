//! The lobby: name, colour, the big button, open rooms, scenes, replays. The forms are in `index.html`;
//! here they are filled and listened to.

use crate::net::api::{ReplayCard, Room, SceneCard};
use crate::page::app::App;
use crate::page::dom;
use crate::page::event::{Event, Form};
use crate::page::lobby::{Lobby, Note};
use crate::page::queue::Events;
use crate::page::{name, strings};
use jostle_protocol::Appearance;
use wasm_bindgen::JsCast;
use web_sys::{
    HtmlElement, HtmlImageElement, HtmlInputElement, InputEvent, MouseEvent, PointerEvent,
};

/// The lobby as it was shown last.
#[derive(Default)]
pub struct LobbyView {
    rooms: Vec<Room>,
    scenes: Vec<SceneCard>,
    replays: Vec<ReplayCard>,
    note: Note,
    /// Number of the screen whose form was filled.
    screen: Option<u32>,
}

impl LobbyView {
    /// Shows the lobby.
    pub fn show(&mut self, app: &App) {
        let lobby = &app.lobby;
        if self.screen != Some(app.screen) {
            self.screen = Some(app.screen);
            fill_form(&app.appearance);
        }
        if self.note != lobby.note {
            self.note.clone_from(&lobby.note);
            let note: HtmlElement = dom::by_id("lobby-note");
            dom::set_text(&note, &lobby.note.text);
            let _ = note.class_list().toggle_with_force("bad", lobby.note.bad);
        }
        flag("name", "aria-invalid", lobby.name_invalid);
        flag("play", "aria-busy", lobby.busy);
        self.show_lists(lobby);
    }

    fn show_lists(&mut self, lobby: &Lobby) {
        let scenes_changed = self.scenes != lobby.scenes;
        if scenes_changed {
            self.scenes.clone_from(&lobby.scenes);
            let list: HtmlElement = dom::by_id("scene-list");
            list.set_text_content(None);
            for scene in &lobby.scenes {
                let item = dom::element("li", "");
                dom::append(&item, &scene_button(scene));
                dom::append(&list, &item);
            }
        }
        if scenes_changed || self.rooms != lobby.rooms {
            self.rooms.clone_from(&lobby.rooms);
            list_links("room-list", lobby.rooms.iter().map(|room| room_link(lobby, room)));
            dom::show(&dom::by_id("no-rooms"), lobby.rooms.is_empty());
        }
        if scenes_changed || self.replays != lobby.replays {
            self.replays.clone_from(&lobby.replays);
            let links = lobby.replays.iter().map(|replay| replay_link(lobby, replay));
            list_links("replay-list", links);
        }
    }
}

/// Sets an attribute to "true", or removes it.
fn flag(id: &str, name: &str, on: bool) {
    let element: HtmlElement = dom::by_id(id);
    match (on, element.has_attribute(name)) {
        (true, false) => dom::set(&element, name, "true"),
        (false, true) => _ = element.remove_attribute(name),
        _ => {}
    }
}

fn fill_form(appearance: &Appearance) {
    dom::by_id::<HtmlInputElement>("name").set_value(&appearance.name);
    let selector = format!("#colors input[value='{}']", appearance.color);
    if let Ok(Some(swatch)) = dom::document().query_selector(&selector)
        && let Ok(swatch) = swatch.dyn_into::<HtmlInputElement>()
    {
        swatch.set_checked(true);
    }
}

/// Reads the form.
fn form() -> Form {
    let checked = dom::document().query_selector("#colors input:checked").ok().flatten();
    let color = checked.and_then(|e| e.get_attribute("value")).and_then(|v| v.parse().ok());
    Form {
        name: dom::by_id::<HtmlInputElement>("name").value(),
        color: color.unwrap_or(0),
        private: dom::by_id::<HtmlInputElement>("private").checked(),
    }
}

/// Listens to the lobby's forms and lists.
pub fn listen(events: Events) {
    let join: HtmlElement = dom::by_id("join");
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
    dom::listen(&dom::by_id::<HtmlElement>("name"), "compositionend", |_: web_sys::Event| {
        fit_name();
    });
    for list in ["room-list", "replay-list"] {
        dom::listen(&dom::by_id::<HtmlElement>(list), "click", move |event: MouseEvent| {
            let plain = !(event.ctrl_key() || event.meta_key() || event.shift_key());
            let link = dom::target_within(&event, "a").filter(|_| plain);
            if let Some(word) = link.and_then(|link| link.get_attribute("data-code")) {
                event.prevent_default();
                events.push(Event::LinkFollowed(word));
            }
        });
    }
    dom::listen(&dom::by_id::<HtmlElement>("scene-list"), "click", move |event: MouseEvent| {
        let button = dom::target_within(&event, "button");
        if let Some(scene) = button.and_then(|button| button.get_attribute("data-scene")) {
            events.push(Event::SceneClicked(scene, form()));
        }
    });
    dom::listen(&dom::by_id::<HtmlElement>("lobby"), "pointermove", |event: PointerEvent| {
        follow(&event);
    });
}

/// The wordmark's hero looks at the pointer.
fn follow(event: &PointerEvent) {
    let Ok(Some(hero)) = dom::document().query_selector(".block.hero") else { return };
    let bounds = hero.get_bounding_client_rect();
    let dx = f64::from(event.client_x()) - (bounds.left() + bounds.width() * 0.5);
    let dy = f64::from(event.client_y()) - (bounds.top() + bounds.height() * 0.5);
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

fn replay_link(lobby: &Lobby, replay: &ReplayCard) -> HtmlElement {
    let link = link_with_picture(lobby, &format!("replay/{}", replay.name), &replay.scene);
    let scene = lobby.scenes.iter().find(|scene| scene.name == replay.scene);
    let title = scene.map_or(&replay.scene, |scene| &scene.title);
    dom::append(&link, &dom::labelled("strong", "", title));
    let ago = strings::ago(js_sys::Date::now() / 1000.0 - replay.unix_s as f64);
    let when = if replay.unix_s == 0 { replay.name.clone() } else { ago };
    let about = format!("/{} \u{b7} {when}", replay.room);
    dom::append(&link, &dom::labelled("span", "code", &about));
    let size = dom::element("span", "seats");
    dom::append(&size, &dom::labelled("span", "", &strings::size(replay.bytes)));
    if replay.recording {
        dom::append(&size, &dom::labelled("span", "live", "recording"));
    }
    dom::append(&link, &size);
    link
}

/// A link to a word of this server, with the picture of a scene.
fn link_with_picture(lobby: &Lobby, word: &str, scene: &str) -> HtmlElement {
    let link = dom::element("a", "");
    dom::set(&link, "href", &format!("/{word}"));
    dom::set(&link, "data-code", word);
    let thumb = dom::element("span", "thumb");
    let scene = lobby.scenes.iter().find(|known| known.name == scene);
    if let Some(picture) = scene.and_then(|scene| scene.picture.as_ref()) {
        dom::style(&thumb, "background-image", &format!("url({picture:?})"));
    }
    dom::append(&link, &thumb);
    link
}

fn room_link(lobby: &Lobby, room: &Room) -> HtmlElement {
    let link = link_with_picture(lobby, &room.code, &room.scene);
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

/// Fills a list again. The keyboard focus stays where it was.
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
    dom::append(&go, &dom::labelled("b", "", "Start"));
    dom::append(&button, &go);
    button
}
