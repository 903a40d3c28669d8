//! Functions for tests, exposed as `window.jostle`.

use crate::net::meter::Meter;
use crate::net::timeline::Sample;
use crate::page::app::App;
use crate::page::dom::{self, stage, views};
use crate::page::event::Event;
use crate::page::game::GameScreen;
use crate::page::replay_screen::OpenReplay;
use crate::page::shell::{self, Page};
use crate::page::sound_desk::SoundDesk;
use crate::page::storage::Storage;
use crate::replay::player::ReplayPlayer;
use crate::sound::player;
use crate::sound::witness::voices_of;
use crate::view::render::Made;
use crate::world::particle_probe;
use crate::world::replica::Replica;
use jostle_protocol::PlayerState;
use jostle_sim::Vec2;
use js_sys::JsString;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

/// The page's state, as JSON.
#[wasm_bindgen]
pub fn state() -> Option<JsString> {
    json(&shell::with(|page| describe(page))?)
}

fn describe(page: &Page) -> JsValue {
    let app = &page.app;
    let (game, replay) = (app.screen.game(), app.screen.replay());
    let replica = app.screen.replica();
    let played = replica.filter(|_| replay.is_none());
    let seated = played.filter(|_| !game.is_some_and(|game| game.watches()));
    let particles = replay.map(|replay| replay.player.particles().0);
    let particles = particles.or(replica.map(Replica::particles));
    let meter = game.map(|game| &game.connection.meter).or(replay.map(|replay| &replay.meter));
    let players = replica.map_or(&[][..], |replica| replica.room.players());
    object([
        ("state", app.state().into()),
        ("seat", seated.map(|replica| replica.room.seat.0).into()),
        ("tick", replica.map(|replica| replica.room.display).into()),
        (
            "bodies",
            array(replica.map_or(&[][..], |replica| &replica.room.samples).iter().map(body)),
        ),
        ("particles", particles.map_or(0, |particles| particles.len()).into()),
        ("particle_digest", particles.map(|particles| hex(particles.digest())).into()),
        ("emitters", particles.map_or(0, |particles| particles.emitter_count()).into()),
        ("players", array(players.iter().map(player))),
        ("drawn_frames", count(app.picture.drawn_frames)),
        (
            "gpu",
            page.views.stage.graphics.as_ref().map(|graphics| gpu(graphics.renderer.made())).into(),
        ),
        ("sections", meter.map(sections).into()),
        ("emitter_events", count(meter.map_or(0, |meter| meter.emitters))),
        (
            "hash",
            game.and_then(|game| Some(game.connection.room_in_page()?.state_hash()))
                .map(hex)
                .into(),
        ),
        (
            "hash_tick",
            game.and_then(|game| Some(game.connection.room_in_page()?.tick_count())).into(),
        ),
        ("told_place", played.and_then(|replica| replica.room.told_place()).map(point).into()),
        ("prediction", game.and_then(prediction).into()),
        ("ghost", game.and_then(|game| game.ghost_body()).map(|ghost| point(ghost.center)).into()),
        ("replay", replay.map(shown_replay).into()),
        ("sound", sound(page)),
    ])
}

fn sound(page: &Page) -> JsValue {
    object([
        ("context", page.player.state().into()),
        ("started", count(page.player.started)),
        ("volume", page.app.sound.volume.into()),
        ("on", page.app.sound.is_on().into()),
    ])
}

/// Renders the sound of the first seconds of a replay at the default volume, without playing it. Returns a promise of
/// an `AudioBuffer`.
#[wasm_bindgen]
pub fn rendered_sound(replay: Vec<u8>, seconds: u32) -> Result<js_sys::Promise, JsValue> {
    let player = ReplayPlayer::open(replay).map_err(|error| error.to_string())?;
    let gain = SoundDesk::new(&Storage::default()).gain();
    player::rendered(&voices_of(player, seconds), seconds, gain)
}

/// Creates a JavaScript object; undefined fields are omitted from its JSON.
fn object<const FIELDS: usize>(fields: [(&str, JsValue); FIELDS]) -> JsValue {
    let object = js_sys::Object::new();
    for (name, value) in fields {
        set(&object, name, &value);
    }
    object.into()
}

fn set(object: &js_sys::Object, name: &str, value: &JsValue) {
    js_sys::Reflect::set(object, &name.into(), value).expect("a plain object takes any field");
}

fn array(values: impl Iterator<Item = JsValue>) -> JsValue {
    values.collect::<js_sys::Array>().into()
}

fn point(at: Vec2) -> JsValue {
    array([at.x, at.y].into_iter().map(JsValue::from))
}

/// Converts a count to a JavaScript number, which is exact up to 2^53. A `u64` would become a `BigInt`, which JSON does
/// not support.
fn count(count: u64) -> JsValue {
    (count as f64).into()
}

fn json(value: &JsValue) -> Option<JsString> {
    js_sys::JSON::stringify(value).ok()
}

fn body(body: &Sample) -> JsValue {
    object([
        ("id", body.id.index.into()),
        ("generation", body.id.generation.into()),
        ("kind", body.kind.name().into()),
        ("owner", body.owner.map(|seat| seat.0).into()),
        ("pos", point(body.center)),
    ])
}

/// Sections received so far, and in how many snapshots each occurred.
fn sections(meter: &Meter) -> JsValue {
    let sections = js_sys::Object::new();
    for &(name, snapshots) in &meter.sections {
        set(&sections, name, &count(snapshots));
    }
    sections.into()
}

fn prediction(game: &GameScreen) -> Option<JsValue> {
    let predictor = game.membership.as_ref()?.predictor.as_ref()?;
    Some(object([
        ("error", predictor.error.into()),
        ("unacknowledged", predictor.unacknowledged().into()),
    ]))
}

fn gpu(made: Made) -> JsValue {
    let textures = js_sys::Object::new();
    for (name, bytes) in made.textures {
        set(&textures, name, &count(bytes));
    }
    let pipelines = array(made.pipelines.into_iter().map(JsValue::from));
    object([("pipelines", pipelines), ("textures", textures.into())])
}

fn shown_replay(replay: &OpenReplay) -> JsValue {
    let (player, view) = (&replay.player, replay.view);
    let pixels = array(view.pixels.into_iter().map(JsValue::from));
    object([
        ("tick", player.tick().into()),
        ("last", player.last_tick().into()),
        ("playing", player.playing.into()),
        ("speed", player.speed.into()),
        ("seeking", player.is_seeking().into()),
        ("hash", player.hash().map(hex).into()),
        ("agrees_until", player.checks.agrees_until().into()),
        ("differs_at", player.checks.differs_at.into()),
        ("compared", player.checks.count().into()),
        ("followed", player.followed.map(|seat| seat.0).into()),
        (
            "view",
            object([
                ("center", point(view.center)),
                ("height", view.height.into()),
                ("pixels", pixels),
            ]),
        ),
    ])
}

/// The position at which the last frame drew the player's hero, `[x, y]` in world units; `None` without a hero.
#[wasm_bindgen]
pub fn own_place() -> Option<js_sys::Array> {
    let center = |app: &App| Some(app.screen.game()?.replica()?.own_hero()?.center);
    let at = shell::with(|page| center(&page.app)).flatten()?;
    Some(js_sys::Array::of2(&at.x.into(), &at.y.into()))
}

/// Plays a recording, see [`witness`]. Returns `[[tick, digits], ...]` as JSON, or an error message.
#[wasm_bindgen]
pub fn particle_digests(scene: &str, recording: &[u8]) -> String {
    match particle_probe::particle_digests(scene, recording) {
        Ok(digests) => {
            let digests = digests
                .into_iter()
                .map(|(tick, digest)| array([tick.into(), hex(digest).into()].into_iter()));
            json(&array(digests)).map(String::from).unwrap_or_default()
        }
        Err(error) => error,
    }
}

/// Formats a hash as 16 hexadecimal digits, since JavaScript numbers cannot hold 64 bits.
fn hex(digest: u64) -> String {
    format!("{digest:016x}")
}

fn player(player: &PlayerState) -> JsValue {
    object([
        ("seat", player.seat.0.into()),
        ("name", (&*player.appearance.name).into()),
        ("connected", player.connected.into()),
        ("selected", player.selected.map(|id| id.index).into()),
        ("held", player.held.map(|id| id.index).into()),
    ])
}

/// Closes the socket as a network failure would; the page then reconnects.
#[wasm_bindgen]
pub fn drop_socket() {
    shell::push(Event::ConnectionCut);
}

/// The position of a world point on the page, `[x, y]` in CSS pixels.
#[wasm_bindgen]
pub fn to_page(x: f32, y: f32) -> js_sys::Array {
    let at = shell::with(|page| {
        let view = views::view(&page.app)?;
        let place = dom::html("stage").get_bounding_client_rect();
        let corner = Vec2::new(place.left() as f32, place.top() as f32);
        Some(corner + view.to_pixel(Vec2::new(x, y)) * stage::css_per_pixel(view.pixels))
    });
    let at = at.flatten().unwrap_or(Vec2::ZERO);
    js_sys::Array::of2(&at.x.into(), &at.y.into())
}
