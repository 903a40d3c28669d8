//! Listens to keys, pointers and buttons of the game and turns them into controls.

use super::app::{self, App};
use super::ask::{self, Question};
use super::{deck, dom, modal, network, players};
use crate::fingers::Touched;
use crate::input;
use crate::layers::Layer;
use crate::stick;
use jostle_sim::{Buttons, Vec2};
use wasm_bindgen::JsCast;
use web_sys::{
    Element, Event, HtmlElement, HtmlInputElement, KeyboardEvent, MouseEvent, PointerEvent,
};

/// Starts listening.
pub fn listen() {
    listen_keys();
    listen_pointer();
    listen_buttons();
    for (target, kind) in
        [("window", "blur"), ("window", "pagehide"), ("document", "visibilitychange")]
    {
        let release = |_: Event| {
            app::with(App::release);
        };
        match target {
            "window" => dom::listen(&dom::window(), kind, release),
            _ => dom::listen(&dom::document(), kind, release),
        }
    }
}

fn listen_keys() {
    dom::listen_active(&dom::window(), "keydown", |event: KeyboardEvent| {
        note_tabbing(event.code() == "Tab");
        key_down(&event);
    });
    dom::listen(&dom::window(), "keyup", |event: KeyboardEvent| {
        key(&event, false);
    });
}

/// Whether the focus moves by Tab: the browser shows it after any key.
fn note_tabbing(tabs: bool) {
    let data = dom::root().dataset();
    if tabs {
        let _ = data.set("tabbing", "yes");
    } else if data.get("tabbing").is_some() {
        data.delete("tabbing");
    }
}

fn key_down(event: &KeyboardEvent) {
    if app::with(|app| app.watch().is_some()).unwrap_or(false) {
        return film_key_down(event);
    }
    if !app::with(|app| app.play.is_some()).unwrap_or(false)
        || (typing(event) && !is_function(event))
    {
        return;
    }
    // With these held, the system takes keys whose release never comes.
    if event.ctrl_key() || event.meta_key() || event.alt_key() {
        app::with(App::release);
        return;
    }
    if let Some(command) = command(event) {
        event.prevent_default();
        if !event.repeat() {
            command();
        }
        return;
    }
    let on_button = dom::target_within(event, "button, a").is_some();
    let presses_it = on_button && matches!(event.code().as_str(), "Space" | "Enter");
    if !presses_it && modal::top() == Layer::Page && key(event, true) {
        event.prevent_default();
    }
}

fn film_key_down(event: &KeyboardEvent) {
    match (event.code().as_str(), event.key().as_str()) {
        ("F2", _) if !event.repeat() => deck::toggle_bounds(),
        (_, "?") if !event.repeat() => toggle_help(),
        ("Escape", _) if modal::top() == Layer::Help => toggle_help(),
        _ => return deck::key_down(event),
    }
    event.prevent_default();
}

/// Whether it is one of the keys that no field of the page has a use for.
fn is_function(event: &KeyboardEvent) -> bool {
    matches!(event.code().as_str(), "F2" | "F3" | "F4")
}

/// Whether a key belongs to a text field.
fn typing(event: &Event) -> bool {
    let Some(target) = event.target() else { return false };
    if target.dyn_ref::<HtmlInputElement>().is_some() {
        return true;
    }
    target
        .dyn_ref::<Element>()
        .is_some_and(|e| e.closest("[contenteditable]").ok().flatten().is_some())
}

/// What a key does to the page, if it does not belong to the world.
fn command(event: &KeyboardEvent) -> Option<fn()> {
    match (event.code().as_str(), event.key().as_str()) {
        ("F2", _) => Some(toggle_bounds),
        ("F3", _) => Some(toggle_figures),
        ("F4", _) => Some(network::toggle),
        (_, "?") => Some(toggle_help),
        ("Escape", _) if modal::top() == Layer::Help => Some(toggle_help),
        ("Escape", _) if modal::top() == Layer::Ask => Some(ask::withdraw),
        _ => None,
    }
}

fn toggle_bounds() {
    app::with(|app| {
        if let Some(play) = &mut app.play {
            play.bounds_toggled = !play.bounds_toggled;
        }
    });
}

fn toggle_figures() {
    app::with(|app| app.hud.toggle_figures());
}

/// Presses or lets go of what a key stands for; `false` if that is nothing.
fn key(event: &KeyboardEvent, down: bool) -> bool {
    let (place, letter) = (event.code(), event.key());
    if event.repeat() {
        return input::meaning(&place, &letter).is_some();
    }
    let known = app::with(|app| {
        let play = app.play.as_mut()?;
        let known = play.controls.key(&place, &letter, down);
        play.speak(dom::now_ms());
        Some(known)
    });
    known.flatten().unwrap_or(false)
}

fn toggle_help() {
    app::with(App::release);
    // Under a card that waits for an answer there is nothing to help with.
    match modal::top() {
        Layer::Page => modal::set_help(true),
        Layer::Help => modal::set_help(false),
        Layer::Ask | Layer::Notice => {}
    }
}

fn listen_pointer() {
    let stage: HtmlElement = dom::by_id("stage");
    dom::listen_active(&stage, "contextmenu", |event: MouseEvent| event.prevent_default());
    dom::listen_active(&stage, "pointerdown", |event: PointerEvent| {
        event.prevent_default();
        note_tabbing(false);
        let stage: HtmlElement = dom::by_id("stage");
        let _ = stage.focus();
        // Fails for a pointer that is gone again already.
        let _ = stage.set_pointer_capture(event.pointer_id());
        notice_touch(&event);
        app::with(|app| app.pointer_down(&event));
    });
    dom::listen(&stage, "pointermove", |event: PointerEvent| {
        app::with(|app| app.pointer_moved(&event));
    });
    for kind in ["pointerup", "pointercancel"] {
        dom::listen(&stage, kind, |event: PointerEvent| {
            app::with(|app| app.pointer_up(&event));
        });
    }
    dom::listen(&stage, "pointerleave", |event: PointerEvent| {
        if event.pointer_type() != "touch" {
            app::with(App::pointer_left);
        }
    });
}

/// The first touch brings the stick and the tool buttons, also where a mouse is present.
fn notice_touch(event: &PointerEvent) {
    let touch = event.pointer_type() == "touch";
    if touch && dom::root().dataset().get("touch").is_none() {
        let _ = dom::root().dataset().set("touch", "yes");
    }
}

fn place(event: &PointerEvent) -> Vec2 {
    Vec2::new(event.offset_x() as f32, event.offset_y() as f32)
}

impl App {
    fn pointer_down(&mut self, event: &PointerEvent) {
        if self.play.is_none() {
            return;
        }
        if event.pointer_type() == "touch" {
            let stage: HtmlElement = dom::by_id("stage");
            let size = Vec2::new(stage.client_width() as f32, stage.client_height() as f32);
            let touched = self.touchpad.down(event.pointer_id(), place(event), size);
            return self.touched(touched, event);
        }
        self.point(Some(place(event)));
        if matches!(event.button(), 0 | 2) {
            self.press(Buttons::FIRE, true);
        }
    }

    fn pointer_moved(&mut self, event: &PointerEvent) {
        if event.pointer_type() == "touch" {
            let touched = self.touchpad.moved(event.pointer_id(), place(event));
            return self.touched(touched, event);
        }
        self.point(Some(place(event)));
        // A second button that goes down or up while one is held only shows up as a move.
        if event.button() >= 0 {
            self.press(Buttons::FIRE, event.buttons() & 0b11 != 0);
        }
    }

    fn pointer_up(&mut self, event: &PointerEvent) {
        if event.pointer_type() == "touch" {
            let touched = self.touchpad.up(event.pointer_id());
            return self.touched(touched, event);
        }
        self.press(Buttons::FIRE, event.buttons() & 0b11 != 0);
    }

    fn pointer_left(&mut self) {
        self.press(Buttons::FIRE, false);
        self.point(None);
    }

    fn touched(&mut self, touched: Touched, event: &PointerEvent) {
        match touched {
            Touched::Grip(_) | Touched::Loose => self.steer(Buttons::default()),
            Touched::Lean(offset) => self.steer(stick::directions(offset)),
            Touched::Aim(buttons, down) => {
                self.point(Some(place(event)));
                self.press(buttons, down);
            }
            Touched::Move => self.point(Some(place(event))),
            Touched::Nothing => {}
        }
    }

    fn steer(&mut self, directions: Buttons) {
        if let Some(play) = &mut self.play {
            play.controls.steer(directions);
            play.speak(dom::now_ms());
        }
    }

    fn point(&mut self, css: Option<Vec2>) {
        let Some(play) = &mut self.play else { return };
        let scale = app::css_per_pixel(play.view().pixels).max(f32::MIN_POSITIVE);
        play.controls.point(css.map(|at| at / scale));
        play.speak(dom::now_ms());
    }
}

fn listen_buttons() {
    dom::listen(&dom::by_id::<HtmlElement>("leave"), "click", |_: Event| app::leave());
    dom::listen(&dom::by_id::<HtmlElement>("copy"), "click", |event: MouseEvent| {
        copy_link();
        back_to_stage(&event);
    });
    dom::listen(&dom::by_id::<HtmlElement>("help-button"), "click", |event: MouseEvent| {
        back_to_stage(&event);
        toggle_help();
    });
    dom::listen(&dom::by_id::<HtmlElement>("close-room"), "click", |event: MouseEvent| {
        back_to_stage(&event);
        app::with(App::release);
        ask::ask(Question::CloseRoom);
    });
    players::listen();
    ask::listen();
    dom::listen(&dom::by_id::<HtmlElement>("help-close"), "click", |_: Event| toggle_help());
    dom::listen(&dom::by_id::<HtmlElement>("signal"), "click", |event: MouseEvent| {
        network::toggle();
        back_to_stage(&event);
    });
    if dom::media("(pointer: coarse)") {
        let _ = dom::root().dataset().set("touch", "yes");
    }
}

/// After a click (not after a key on a focused button) keys belong to the game again.
pub fn back_to_stage(event: &MouseEvent) {
    if event.detail() > 0 {
        let _ = dom::by_id::<HtmlElement>("stage").focus();
    }
}

/// Puts the page's address into the clipboard and says so on the button, which `style.css` keeps as
/// wide as the longest of these texts.
fn copy_link() {
    let button: HtmlElement = dom::by_id("copy");
    dom::copy_address(move |copied| {
        dom::set_text(&button, if copied { "Copied" } else { "Not copied" });
        let title = if copied { "" } else { "The browser forbids it: copy the address above" };
        dom::set(&button, "title", title);
        let button = button.clone();
        dom::after(1500, move || dom::set_text(&button, "Copy link"));
    });
}
