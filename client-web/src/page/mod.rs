//! Everything that touches the browser. Exists on wasm only.

mod app;
mod ask;
mod controls;
mod deck;
mod dom;
mod files;
mod graphics;
mod hooks;
mod http;
mod hud;
mod lobby;
mod modal;
mod network;
mod notice;
mod play;
mod players;
mod profile;
mod socket;
mod touchpad;
mod watch;

use wasm_bindgen::prelude::wasm_bindgen;

/// Called once, when the wasm is loaded.
#[wasm_bindgen(start)]
fn main() {
    // A panic ends this instance; without a word it would only say "unreachable". The app may be
    // borrowed for good: only what needs no app works from here on.
    std::panic::set_hook(Box::new(|info| {
        web_sys::console::error_1(&wasm_bindgen::JsValue::from_str(&info.to_string()));
        notice::show(&crate::words::CRASHED);
        let _ = dom::root().dataset().set("state", "refused");
    }));
    app::start();
}
