//! Sound: when the audio context is created, which settings are remembered, and how loud two games are.
//!
//! `JOSTLE_UPDATE_GOLDENS=1` updates the levels in `tests/goldens/sound`; review the changes before committing them.

use super::pictures::goldens;
use anyhow::{Context, Result, anyhow, ensure};
use data_encoding::BASE64;
use jostle_client_web::world::room_in_page::scripted_input;
use jostle_game::Scene;
use jostle_protocol::Appearance;
use jostle_protocol::replay::header;
use jostle_room::Room;
use jostle_tests::runner::{Stage, is_long};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// Two games that together contain every sound except those of breaking and losing.
const GAMES: [&str; 2] = ["arena", "hill"];
const NAMES: [&str; 3] = ["Ada", "Grace", "Alan"];
const MINUTE_S: u32 = 60;
/// Number of seconds of a game that ordinary runs compare. Rendering a second takes a third of a second of processor
/// time.
const HEARD_S: u32 = 15;
const SEED: u64 = 11;
/// Maximum difference between a level and the golden one.
const OFF_DB_MAX: f64 = 1.0;
/// Levels below this are inaudible and are raised to this value.
const FLOOR_DB: f64 = -70.0;
/// Maximum level at the default volume; louder games would be unpleasant.
const LOUD_DB_MAX: f64 = -28.0;

/// Counts the audio contexts that are created.
const COUNT_CONTEXTS: &str = "window.contexts = 0; \
    window.AudioContext = class extends AudioContext { \
        constructor(...given) { super(...given); window.contexts += 1; } };";

/// Returns, for each half second, the levels of the left and right channels and of their low frequencies in dB, and the
/// highest sample overall.
const LEVELS: &str = r#"async (game, seconds) => {
    const bytes = Uint8Array.from(atob(game), digit => digit.charCodeAt(0));
    const sound = await window.jostle.rendered_sound(bytes, seconds);
    const rate = sound.sampleRate, length = rate / 2;
    const channels = [0, 1].map(channel => sound.getChannelData(channel));
    // A first-order filter with a cutoff at 400 Hz.
    const share = 1 - Math.exp(-2 * Math.PI * 400 / rate);
    const low = channels.map(samples => {
        let level = 0;
        return samples.map(sample => level += share * (sample - level));
    });
    const levels = [];
    for (let start = 0; start + length <= sound.length; start += length)
        levels.push([...channels, ...low].map(samples => {
            let power = 0;
            for (let at = start; at < start + length; at += 1) power += samples[at] ** 2;
            return 10 * Math.log10(power / length + 1e-12);
        }));
    const peak = Math.max(...channels.map(samples => samples.reduce(
        (peak, sample) => Math.max(peak, Math.abs(sample)), 0)));
    return {levels, peak};
}"#;

#[derive(serde::Deserialize)]
struct Rendered {
    levels: Vec<Vec<f64>>,
    peak: f64,
}

pub async fn sound_begins_with_play_and_rests_while_hidden(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit_changed(COUNT_CONTEXTS, "/").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.fill("#name", "Ada").await?;
    let lobby = tab.state().await?;
    assert_eq!((&*lobby.sound.context, lobby.sound.volume), ("none", 40));
    assert_eq!(
        tab.eval::<u32>("contexts").await?,
        0,
        "no context before a click that leads to a game"
    );

    tab.click_on("#play").await?;
    assert_eq!(tab.eval::<u32>("contexts").await?, 1, "made in the click on Play");
    tab.until("a hero of one's own", State::plays).await?;
    tab.until("sound", |s| s.sound.context == "running").await?;
    tab.key_down("d").await?;
    tab.until("something to hear", |s| s.sound.started > 0).await?;
    tab.key_up("d").await?;

    hide(&tab, true).await?;
    let hidden = tab.until("silence", |s| s.sound.context == "suspended").await?;
    tab.key_down("d").await?;
    let later = tab.ticks(60).await?;
    tab.key_up("d").await?;
    assert_eq!(later.sound.started, hidden.sound.started, "a hidden page starts no voices");
    hide(&tab, false).await?;
    tab.until("sound", |s| s.sound.context == "running").await?;

    tab.click_on("#menu").await?;
    tab.click_on("#leave").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until("silence", |s| s.sound.context == "suspended").await?;
    assert_eq!(tab.eval::<u32>("contexts").await?, 1, "one context for good");
    Ok(())
}

/// Makes the page believe that it is hidden, as the browser does when another tab is in front.
async fn hide(tab: &Tab, hidden: bool) -> Result<()> {
    tab.eval::<bool>(&format!(
        "(Object.defineProperty(document, 'hidden', {{value: {hidden}, configurable: true}}), \
         document.dispatchEvent(new Event('visibilitychange')))"
    ))
    .await
    .map(drop)
}

pub async fn volume_and_captions_are_remembered(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("arena", Screen::LAPTOP).await?;
    let speaker = "document.querySelector('#speaker')";
    tab.until_true(&format!("{speaker}.ariaLabel === 'Sound, volume 40 %'")).await?;
    tab.click_on("#speaker").await?;
    tab.until_true(&format!("{speaker}.ariaExpanded === 'true'")).await?;
    tab.click_on("#captions-on").await?;
    tab.eval::<bool>(
        "(() => { const slider = document.querySelector('#volume'); slider.value = 75; \
         return slider.dispatchEvent(new Event('input', {bubbles: true})); })()",
    )
    .await?;
    tab.until("another volume", |s| s.sound.volume == 75).await?;
    tab.until_true("document.querySelector('#volume-shown').value === '75 %'").await?;
    tab.key_down("d").await?;
    tab.until_true("document.querySelector('#captions li')").await?;
    tab.key_up("d").await?;
    tab.keep("sound-1280").await?;

    tab.go(&tab.link().await?).await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.until("the chosen volume", |s| s.sound.volume == 75 && s.sound.on).await?;
    tab.key_down("m").await?;
    tab.key_up("m").await?;
    tab.until("muted", |s| !s.sound.on).await?;
    tab.until_true(&format!("{speaker}.ariaLabel === 'Sound, off'")).await?;
    tab.go(&tab.link().await?).await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.until("still muted", |s| s.sound.volume == 75 && !s.sound.on).await?;
    tab.click_on("#speaker").await?;
    tab.until_true("document.querySelector('#captions-on').checked").await?;
    tab.until_true("!document.querySelector('#sound-on').checked").await?;

    let phone = stage.play("hill", Screen::PHONE).await?;
    phone.click_on("#speaker").await?;
    phone.until_true("document.querySelector('#volume').value === '40'").await?;
    phone.until_true("document.documentElement.scrollWidth <= innerWidth").await?;
    let still =
        "document.querySelector('#sound').getAnimations().every(a => a.playState === 'finished')";
    phone.until_true(still).await?;
    phone.keep("sound-360").await?;
    phone.click_on("#captions-on").await?;
    phone.click_on("#sound-close").await?;
    phone.until_true("document.querySelector('#captions li')").await?;
    phone.keep("captions-360").await?;
    Ok(())
}

pub async fn a_page_without_sound_says_so(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit_changed("delete window.AudioContext;", "/arena").await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.key_down("d").await?;
    tab.key_up("d").await?;
    tab.until("no sound", |s| !s.sound.on && s.sound.context == "none").await?;
    tab.click_on("#speaker").await?;
    tab.until_true("!document.querySelector('#sound-missing').hidden").await?;
    tab.until_true("document.querySelector('#sound').innerText.includes('play sound')").await
}

/// Number of seconds to render: all of them if `JOSTLE_LONG` is set or the golden levels are being updated.
fn seconds() -> u32 {
    let is_updated = std::env::var_os("JOSTLE_UPDATE_GOLDENS").is_some_and(|value| value == "1");
    if is_long() || is_updated { MINUTE_S } else { HEARD_S }
}

pub async fn a_golden_minute_sounds_as_it_did(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/", Screen::SMALL).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    let seconds = seconds();
    for name in GAMES {
        let game = BASE64.encode(&game(name, seconds)?);
        let Rendered { levels, peak } =
            tab.eval(&format!("({LEVELS})('{game}', {seconds})")).await?;
        assert_eq!(levels.len(), 2 * seconds as usize, "half seconds");
        ensure!((0.01..0.7).contains(&peak), "{name}: the highest sample is {peak}");
        let loudest = levels.iter().flatten().copied().fold(FLOOR_DB, f64::max);
        ensure!(loudest < LOUD_DB_MAX, "{name}: {loudest} dB at volume 40");
        let heard = levels.iter().filter(|level| level[0].max(level[1]) > -60.0).count();
        ensure!(heard > levels.len() / 2, "{name}: only {heard} half seconds have a sound");
        check(&stage, name, &levels)?;
    }
    Ok(())
}

/// Records the first seconds of a game with three scripted players.
fn game(name: &str, seconds: u32) -> Result<Vec<u8>> {
    let found = Scene::built_in().into_iter().find(|scene| scene.name == name);
    let scene = Arc::new(found.context("a shipped scene")?);
    let mut room = Room::new("sound", Arc::clone(&scene), SEED);
    room.record("test", 0);
    let mut seats = Vec::new();
    for (color, name) in (0..).zip(NAMES) {
        let look = Appearance::new(name, color).map_err(|error| anyhow!("{error}"))?;
        let joined = room.join(look, None);
        seats.push(joined.map_err(|refusal| anyhow!("{refusal:?}"))?.claim.seat);
    }
    for tick in 0..60 * seconds {
        for &seat in &seats {
            room.input(seat, tick + 1, scripted_input(&scene, seat, tick));
        }
        room.tick();
    }
    let mut bytes = header();
    room.stop_recording().iter().for_each(|record| bytes.extend(record.seal()));
    Ok(bytes)
}

/// Compares levels with the golden ones, or updates the golden ones.
fn check(stage: &Stage, name: &str, levels: &[Vec<f64>]) -> Result<()> {
    let path = goldens().join(format!("sound/{name}.txt"));
    if std::env::var_os("JOSTLE_UPDATE_GOLDENS").is_some_and(|value| value == "1") {
        stage.note(format!("took {}", path.display()));
        return std::fs::write(&path, text(levels)?).context("cannot write levels");
    }
    let golden = read(&path)?;
    assert_eq!(golden.len(), 2 * MINUTE_S as usize, "{name}: half seconds");
    for (index, (golden, level)) in golden.iter().zip(levels).enumerate() {
        for (golden, level) in golden.iter().zip(level) {
            let off = level.max(FLOOR_DB) - golden.max(FLOOR_DB);
            ensure!(
                off.abs() <= OFF_DB_MAX,
                "{name}, second {}: {level:.1} dB instead of {golden:.1}",
                index as f64 / 2.0
            );
        }
    }
    Ok(())
}

fn text(levels: &[Vec<f64>]) -> Result<String> {
    let mut text = "# Second, dB left and right, dB left and right below 400 Hz.\n".to_owned();
    for (index, level) in levels.iter().enumerate() {
        write!(text, "{:4.1}", index as f64 / 2.0)?;
        level.iter().try_for_each(|db| write!(text, " {:6.1}", db.max(FLOOR_DB)))?;
        text.push('\n');
    }
    Ok(text)
}

fn read(path: &Path) -> Result<Vec<Vec<f64>>> {
    let text = std::fs::read_to_string(path);
    let text = text.with_context(|| format!("cannot read {}", path.display()))?;
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let numbers = line.split_whitespace().skip(1).map(str::parse);
            numbers.collect::<Result<Vec<f64>, _>>().with_context(|| line.to_owned())
        })
        .collect()
}
