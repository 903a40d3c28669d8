//! What tests may ask of the page: `window.jostle` is made of these.

use super::app;
use super::play::Play;
use super::watch::Watch;
use crate::render::Made;
use crate::replica::Replica;
use crate::witness;
use jostle_protocol::PlayerState;
use jostle_sim::Vec2;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use wasm_bindgen::prelude::wasm_bindgen;

/// What is on display now, as JSON.
#[wasm_bindgen]
pub fn state() -> String {
    app::with(|app| describe(app).to_string()).unwrap_or_default()
}

fn describe(app: &app::App) -> Value {
    let now = super::dom::now_ms();
    let watch = app.watch();
    let replica = match watch {
        Some(watch) => Some(watch.film.replica()),
        None => app.play.as_ref().and_then(|play| play.replica()),
    };
    let particles = watch.map(|watch| watch.film.particles());
    let particles = particles.or(replica.map(Replica::particles));
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
    let meter = app.play.as_ref().map(|play| &play.meter).or(watch.map(|watch| &watch.meter));
    let players = replica.map_or(&[][..], |replica| replica.players());
    json!({
        "state": app.state(),
        "seat": replica.filter(|_| watch.is_none()).map(|replica| replica.seat.0),
        "room": replica.map(|replica| replica.room.clone()),
        "tick": replica.map(|replica| replica.display()),
        "newest_tick": replica.and_then(|r| r.newest()).map(|snapshot| snapshot.tick),
        "bodies": bodies,
        "particles": particles.map_or(0, |particles| particles.len()),
        "particle_digest": particles.map(|particles| hex(particles.digest())),
        "emitters": particles.map_or(0, |particles| particles.emitter_count()),
        "players": players.iter().map(player).collect::<Vec<_>>(),
        "fps": meter.map_or(0, |meter| meter.frames_a_second(now)),
        "drawn_frames": app.drawn_frames,
        "gpu": app.made().map(gpu),
        "sections": meter.map(|meter| meter.sections()),
        "emitter_events": meter.map_or(0, |meter| meter.emitters()),
        "hash": app.play.as_ref().and_then(|play| play.state_hash()).map(hex),
        "told_place": replica.filter(|_| watch.is_none()).and_then(told_place),
        "prediction": app.play.as_ref().and_then(prediction),
        "replay": watch.map(replay),
    })
}

/// Where the server's newest word has the own hero.
fn told_place(replica: &Replica) -> Option<[f32; 2]> {
    replica.told_place().map(|at| [at.x, at.y])
}

/// What is predicted, and what the server's newest word is.
fn prediction(play: &Play) -> Option<Value> {
    let predictor = play.predictor()?;
    Some(json!({
        "error": predictor.error(),
        "lead_ticks": predictor.lead_ticks(),
        "unacknowledged": predictor.unacknowledged(),
    }))
}

fn gpu(made: Made) -> Value {
    let textures = made.textures.iter().map(|(name, bytes)| (*name, *bytes));
    json!({
        "pipelines": made.pipelines,
        "textures": textures.collect::<BTreeMap<_, _>>(),
    })
}

fn replay(watch: &Watch) -> Value {
    let (film, view) = (&watch.film, watch.view());
    json!({
        "tick": film.tick(),
        "playhead": film.playhead(),
        "first": film.first_tick(),
        "last": film.last_tick(),
        "playing": film.is_playing(),
        "speed": film.speed(),
        "seeking": film.is_seeking(),
        "hash": film.hash().map(hex),
        "agrees_until": film.checks().agrees_until(),
        "differs_at": film.checks().differs_at(),
        "compared": film.checks().count(),
        "followed": film.followed().map(|seat| seat.0),
        "view": { "center": [view.center.x, view.center.y], "height": view.height,
            "pixels": view.pixels },
    })
}

/// Where the last frame drew the own hero, world units: `[x, y]`, or nothing.
#[wasm_bindgen]
pub fn own_place() -> Option<js_sys::Array> {
    let place = app::with(|app| app.play.as_ref()?.replica()?.own_hero().map(|hero| hero.center));
    place.flatten().map(|at| js_sys::Array::of2(&at.x.into(), &at.y.into()))
}

/// Sets out for a tick of the replay, standing still; `state().replay.seeking` says when it is there.
#[wasm_bindgen]
pub fn seek(tick: u32) {
    super::watch::with_film(|film| {
        film.pause();
        film.aim(tick);
    });
}

/// Hears a recording, see [`witness`]: `[[tick, digits], ...]` as JSON, or what is wrong with it.
#[wasm_bindgen]
pub fn particle_digests(scene: &str, recording: &[u8]) -> String {
    match witness::particle_digests(scene, recording) {
        Ok(digests) => {
            let digests = digests.into_iter().map(|(tick, digest)| json!([tick, hex(digest)]));
            digests.collect::<Value>().to_string()
        }
        Err(error) => error,
    }
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
        let view = match app.watch() {
            Some(watch) => *watch.view(),
            None => *app.play.as_ref()?.view(),
        };
        Some(view.to_pixel(Vec2::new(x, y)) * app::css_per_pixel(view.pixels))
    });
    let at = at.flatten().unwrap_or(Vec2::ZERO);
    js_sys::Array::of2(&at.x.into(), &at.y.into())
}
