//! What tests may ask of the page: `window.jostle` is made of these.

use super::app;
use jostle_protocol::PlayerState;
use jostle_sim::Vec2;
use serde_json::{Value, json};
use wasm_bindgen::prelude::wasm_bindgen;

/// What is on display now, as JSON.
#[wasm_bindgen]
pub fn state() -> String {
    app::with(|app| describe(app).to_string()).unwrap_or_default()
}

fn describe(app: &app::App) -> Value {
    let now = super::dom::now_ms();
    let replica = app.play.as_ref().and_then(|play| play.replica());
    let bodies: Vec<Value> = replica.map_or(Vec::new(), |replica| {
        let bodies = replica.samples().iter().map(|body| {
            json!({
                "id": body.id.index,
                "generation": body.id.generation,
                "kind": body.kind.name(),
                "owner": body.owner.map(|seat| seat.0),
                "pos": [body.center.x, body.center.y],
            })
        });
        bodies.collect()
    });
    let players = replica.map_or(&[][..], |replica| replica.players());
    json!({
        "state": app.state(),
        "seat": replica.map(|replica| replica.seat.0),
        "room": replica.map(|replica| replica.room.clone()),
        "tick": replica.map(|replica| replica.display()),
        "newest_tick": replica.and_then(|r| r.newest()).map(|snapshot| snapshot.tick),
        "bodies": bodies,
        "particles": replica.map_or(0, |replica| replica.particles().len()),
        "particle_digest": replica.map(|replica| hex(replica.particles().digest())),
        "emitters": replica.map_or(0, |replica| replica.particles().emitter_count()),
        "players": players.iter().map(player).collect::<Vec<_>>(),
        "fps": app.play.as_ref().map_or(0, |play| play.meter.frames_a_second(now)),
        "drawn_frames": app.drawn_frames,
        "hash": app.play.as_ref().and_then(|play| play.state_hash()).map(hex),
    })
}

/// 16 digits: numbers of JavaScript do not hold 64 bits.
fn hex(digest: u64) -> String {
    format!("{digest:016x}")
}

fn player(player: &PlayerState) -> Value {
    json!({
        "seat": player.seat.0,
        "name": player.appearance.name,
        "color": player.appearance.color,
        "score": player.score,
        "connected": player.connected,
        "hero": player.hero.map(|id| id.index),
        "selected": player.selected.map(|id| id.index),
        "held": player.held.map(|id| id.index),
    })
}

/// Closes the socket as a broken network would; the page reconnects by itself.
#[wasm_bindgen]
pub fn drop_socket() {
    app::with(|app| app.play.as_mut().map(|play| play.drop_socket()));
}

/// The place of a world point on the page: `[x, y]` in CSS pixels.
#[wasm_bindgen]
pub fn to_page(x: f32, y: f32) -> js_sys::Array {
    let at = app::with(|app| {
        let view = *app.play.as_ref()?.view();
        Some(view.to_pixel(Vec2::new(x, y)) * app::css_per_pixel(view.pixels))
    });
    let at = at.flatten().unwrap_or(Vec2::ZERO);
    js_sys::Array::of2(&at.x.into(), &at.y.into())
}
