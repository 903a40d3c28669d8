//! Replays on the page: dropping files, playing, seeking, comparing tick by tick, and drawing the same pictures as the
//! native program.

use super::pictures::{check, goldens};
use anyhow::{Context, Result, anyhow, ensure};
use jostle_client_web::world::room_in_page::scripted_input;
use jostle_game::Scene;
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Record, Replay, header};
use jostle_room::{Playback, Room};
use jostle_server::Config;
use jostle_server::log::Settings;
use jostle_tests::runner::{Stage, is_long};
use jostle_tests::scripts::HASTE;
use jostle_tests::server::{Server, patient};
use jostle_tests::state::{Shown, State};
use jostle_tests::tab::{Screen, Tab};
use std::path::Path;
use std::sync::Arc;

/// Ten seconds.
const TICKS: u32 = 600;
const NAMES: [&str; 3] = ["Ada", "Grace", "Alan"];
/// The tick and view (centre, height and pixels) of the golden picture.
const PICTURE_TICK: u32 = 240;
const PICTURE_VIEW: ([f32; 2], f32, [u32; 2]) = ([160.0, 44.1], 275.4, [640, 360]);
/// Hides everything in front of the world.
const HIDE_HUD: &str = "(() => { const style = document.createElement('style'); \
    style.textContent = '.hud, #tags, .deck { visibility: hidden !important }'; \
    document.head.append(style); return true; })()";

/// Records a game with three scripted players in the arena.
pub fn records() -> Result<Vec<Record>> {
    let found = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
    let scene = Arc::new(found.context("the arena")?);
    let mut room = Room::new("browser", Arc::clone(&scene), 11);
    room.record("test", 0);
    let mut seats = Vec::new();
    for (color, name) in (0..).zip(NAMES) {
        let look = Appearance::new(name, color).map_err(|error| anyhow!("{error}"))?;
        let joined = room.join(look, None);
        seats.push(joined.map_err(|refusal| anyhow!("{refusal:?}"))?.claim.seat);
    }
    for tick in 0..TICKS {
        for &seat in &seats {
            room.input(seat, tick + 1, scripted_input(&scene, seat, tick));
        }
        room.tick();
    }
    Ok(room.stop_recording())
}

pub fn file(records: &[Record]) -> Vec<u8> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}

/// Drops a file onto the page.
pub async fn drop_file(tab: &Tab, name: &str, bytes: &[u8]) -> Result<()> {
    let numbers = serde_json::to_string(bytes)?;
    tab.eval::<bool>(&format!(
        "(() => {{ const data = new DataTransfer(); \
         data.items.add(new File([new Uint8Array({numbers})], '{name}')); \
         document.body.dispatchEvent(new DragEvent('drop', \
         {{dataTransfer: data, bubbles: true, cancelable: true}})); return true; }})()"
    ))
    .await
    .map(drop)
}

/// Opens the lobby and drops a file onto it.
async fn watch(stage: &Stage, bytes: &[u8], screen: Screen) -> Result<Tab> {
    let tab = stage.visit("/", screen).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    drop_file(&tab, "game.jostle", bytes).await?;
    tab.until("the replay", |s| s.state == "replay" && s.replay.is_some()).await?;
    Ok(tab)
}

async fn press(tab: &Tab, key: &str) -> Result<()> {
    tab.key_down(key).await?;
    tab.key_up(key).await
}

/// Waits until the displayed replay satisfies `test`.
pub async fn until(tab: &Tab, wanted: &str, test: impl Fn(&Shown) -> bool) -> Result<Shown> {
    let seen = |state: &State| state.replay.as_ref().is_some_and(&test);
    tab.until(wanted, seen).await?.replay.context("a replay")
}

/// Moves the slider to a tick.
async fn slide_to(tab: &Tab, tick: u32) -> Result<Shown> {
    tab.eval::<bool>(&format!(
        "(() => {{ const slider = document.querySelector('#seek'); slider.value = {tick}; \
         return slider.dispatchEvent(new Event('input', {{bubbles: true}})); }})()"
    ))
    .await?;
    until(tab, &format!("tick {tick}"), |shown| !shown.seeking && shown.tick == tick).await
}

fn hash_at(playback: &mut Playback, tick: u32) -> Result<Option<String>> {
    playback.seek(tick)?;
    Ok(Some(format!("{:016x}", playback.game().hash())))
}

/// Waits until the badge that shows the result of the comparison has a given text.
async fn until_verdict(tab: &Tab, verdict: &str, text: &str) -> Result<()> {
    let check = "document.querySelector('#check')";
    tab.until_true(&format!(
        "{check}.dataset.verdict === '{verdict}' && ({check}.innerText + {check}.title).includes('{text}')"
    ))
    .await
}

pub async fn a_dropped_replay_plays_and_every_tick_is_equal(stage: Arc<Stage>) -> Result<()> {
    let bytes = file(&records()?);
    let mut native = Playback::new(Arc::new(Replay::read(bytes.clone())?))?;
    let tab = watch(&stage, &bytes, Screen::SMALL).await?;
    until(&tab, "playing", |shown| shown.playing && shown.tick > 5).await?;
    tab.until_true("document.querySelectorAll('#cast button').length === 3").await?;
    // A click into the bar changes the time, not whether the replay plays.
    tab.click_on("#seek").await?;
    let sought = |shown: &Shown| !shown.seeking && shown.tick > TICKS / 2 - 20;
    let shown = until(&tab, "the middle", sought).await?;
    ensure!(shown.playing || shown.tick == TICKS, "paused at tick {}", shown.tick);
    press(&tab, " ").await?;
    let paused = until(&tab, "a pause", |shown| !shown.playing).await?;
    assert_eq!(paused.hash, hash_at(&mut native, paused.tick)?, "tick {}", paused.tick);

    let middle = slide_to(&tab, TICKS / 2).await?;
    assert_eq!(middle.hash, hash_at(&mut native, TICKS / 2)?, "sought");
    let digits = middle.hash.context("a hash")?;
    until_verdict(&tab, "equal", "Verified").await?;
    until_verdict(&tab, "equal", &format!("tick {}, state hash {digits}", TICKS / 2)).await?;
    for (key, tick) in [(".", TICKS / 2 + 1), (",", TICKS / 2), (",", TICKS / 2 - 1)] {
        press(&tab, key).await?;
        let shown = until(&tab, "one tick", |s| !s.seeking && s.tick == tick).await?;
        assert_eq!((shown.playing, shown.hash), (false, hash_at(&mut native, tick)?), "{key}");
    }

    let whole = until(&tab, "the whole world", |shown| shown.followed.is_none()).await?.view.height;
    tab.click_on("#cast button").await?;
    let near = |shown: &Shown| shown.followed == Some(0) && shown.view.height < 0.8 * whole;
    until(&tab, "a followed player, from near", near).await?;
    tab.click_on("#cast button").await?;
    until(&tab, "the whole world again", |shown| shown.view.height == whole).await?;

    tab.click_on("#speeds label:last-child").await?;
    tab.click_on("#play-pause").await?;
    until(&tab, "eight times as fast", |shown| shown.playing && shown.speed == 8.0).await?;
    let end = until(&tab, "the end", |s| !s.playing && s.tick == TICKS).await?;
    assert_eq!(end.hash, hash_at(&mut native, TICKS)?, "the end");
    until_verdict(&tab, "whole", "Fully verified").await?;
    let end = until(&tab, "all compared", |shown| shown.compared == TICKS).await?;
    assert_eq!((end.agrees_until, end.differs_at), (TICKS, None));
    tab.click_on("#menu").await?;
    tab.click_on("#leave").await?;
    tab.until("the lobby", |s| s.state == "lobby").await.map(drop)
}

/// Plays one file after another in one page, as fast as it can: all files before a release, otherwise every fourth.
/// Other tests always play all files natively, and every scene both in the page and natively.
pub async fn the_page_plays_golden_replays(stage: Arc<Stage>) -> Result<()> {
    let mut files = std::fs::read_dir(goldens().join("replays"))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>>>()?;
    files.sort();
    ensure!(!files.is_empty(), "no golden replays");
    let tab = stage.visit_link_changed(HASTE, &stage.server.link("/"), Screen::TINY).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    let mut wrong = Vec::new();
    for path in files.into_iter().step_by(if is_long() { 1 } else { 4 }) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if let Err(error) = the_page_plays_a_golden_replay(&tab, &path, &name).await {
            stage.note(format!("{name}: {error:#}"));
            wrong.push(name);
        }
    }
    ensure!(wrong.is_empty(), "played differently: {}", wrong.join(", "));
    Ok(())
}

async fn the_page_plays_a_golden_replay(tab: &Tab, path: &Path, name: &str) -> Result<()> {
    let bytes = std::fs::read(path)?;
    let last = Replay::read(bytes.clone())?.last_tick();
    drop_file(tab, name, &bytes).await?;
    let title = format!("document.querySelector('#room-code').innerText === '{name}'");
    tab.until_true(&title).await?;
    let shown = until(tab, name, |shown| shown.compared == last).await?;
    let found = (shown.differs_at, shown.agrees_until);
    ensure!(
        found == (None, last),
        "the first tick that differs, and the last equal one: {found:?}"
    );
    Ok(())
}

/// Waits until the card in the middle of the page contains all the given texts.
async fn until_card(tab: &Tab, texts: &[&str]) -> Result<()> {
    let texts = serde_json::to_string(texts)?;
    tab.until_true(&format!(
        "!document.querySelector('#notice').hidden && \
         {texts}.every(text => document.querySelector('#notice').innerText.includes(text))"
    ))
    .await
}

pub async fn a_server_lists_its_replays_and_links_to_them(stage: Arc<Stage>) -> Result<()> {
    let dir = std::env::temp_dir().join(format!("jostle-replays-{}", std::process::id()));
    std::fs::create_dir_all(&dir)?;
    let name = "arena-browser-20260102-030405";
    std::fs::write(dir.join(format!("{name}.jostle")), file(&records()?))?;
    let config = Config { replays: Some(Settings::new(dir.clone())), ..patient() };
    let server = Server::start(config).await?;
    let tab = stage.visit_link(&server.link("/"), Screen::LAPTOP).await?;
    tab.until_true("document.querySelectorAll('#replay-list a').length === 1").await?;
    tab.click_on("#replay-list a").await?;
    until(&tab, "playing", |shown| shown.playing && shown.tick > 5).await?;
    assert_eq!(tab.link().await?, server.link(&format!("/replay/{name}")));
    tab.until_true("document.querySelector('#copy').offsetWidth > 0").await?;
    // The link alone opens it as well.
    let other = stage.visit_link(&tab.link().await?, Screen::SMALL).await?;
    until(&other, "playing", |shown| shown.playing && shown.tick > 5).await?;
    other.go(&server.link("/replay/arena-gone-20260102-030405")).await?;
    until_card(&other, &["Replay not found", "arena-gone"]).await?;
    other.ignore_errors(|error| error.contains("Failed to load resource"));
    other.click_on("#notice-button").await?;
    other.until("the lobby", |s| s.state == "lobby").await?;
    stage.clear().await?;
    server.stop().await?;
    std::fs::remove_dir_all(dir).context("the replays")
}

/// Compares with the golden picture that is also used by the tests of `jostle-picture`, which draws this tick natively
/// in the same view.
pub async fn a_paused_replay_looks_as_it_did(stage: Arc<Stage>) -> Result<()> {
    let bytes = std::fs::read(goldens().join("replays/arena.jostle"))?;
    let tab = watch(&stage, &bytes, Screen::SMALL.sharp()).await?;
    tab.eval::<bool>(HIDE_HUD).await?;
    until(&tab, "something to see", |shown| shown.tick > 200).await?;
    press(&tab, " ").await?;
    let shown = until(&tab, "a pause", |shown| !shown.playing).await?;
    let played = tab.steady_picture().await?;
    slide_to(&tab, 10).await?;
    slide_to(&tab, shown.tick).await?;
    // A replay may be drawn at a lower resolution while it is playing than while it is paused.
    let sought = tab.steady_picture().await?;
    let apart = played.compare(&sought, 0)?;
    ensure!(apart.max == 0, "sought as played, tick {}: {apart:?}", shown.tick);
    let shown = slide_to(&tab, PICTURE_TICK).await?;
    let (center, height, pixels) = PICTURE_VIEW;
    let far = |shown: f32, wanted: f32| (shown - wanted).abs() > 1e-3;
    let view = shown.view;
    let differs = far(view.center[0], center[0]) || far(view.center[1], center[1]);
    ensure!(!differs && !far(view.height, height) && view.pixels == pixels, "{view:?}");
    check(&stage, "replay", &tab.steady_picture().await?)
}
