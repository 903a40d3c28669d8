//! Tests of watching: a page without a seat, on a phone and a large screen, and a player's clip.

use super::hands::ensure_named;
use super::replay::until;
use anyhow::{Context, Result, ensure};
use jostle_server::Config;
use jostle_server::log::Settings;
use jostle_tests::runner::{Case, Stage};
use jostle_tests::server::{Server, patient};
use jostle_tests::state::State;
use jostle_tests::tab::Screen;
use std::sync::Arc;

const PHONE: Screen = Screen { width: 360, height: 640, touch: true, scale: 0.5 };

pub fn cases() -> Vec<Case> {
    vec![
        Case::new("a_room_is_watched_on_a_phone", |stage| a_room_is_watched(stage, PHONE)),
        Case::new("the_link_of_a_clip_plays_it", the_link_of_a_clip_plays_it),
        // Listed separately from the case on a phone, since running both halls at the same time takes long.
        Case::new("a_room_is_watched_on_a_large_screen", |stage| {
            a_room_is_watched(stage, Screen::LARGE)
        }),
    ]
}

async fn a_room_is_watched(stage: Arc<Stage>, screen: Screen) -> Result<()> {
    let ada = stage.play("hall", Screen::TINY).await?;
    let width = screen.width;
    let eve = stage.visit("/hall?watch=1", screen).await?;
    let sees = |s: &State| s.state == "playing" && s.seat.is_none() && s.players.len() == 1;
    eve.until("the room", sees).await?;
    let shown = "['data-watching', 'data-world'].every(name => document.documentElement.hasAttribute(name))";
    eve.until_true(shown).await?;
    ensure_named(&eve).await?;
    // The hall is too wide to be shown whole by default. The list of players makes it possible to follow a player or
    // show the whole hall again; on a keyboard, digits do the same.
    let button = "#players [data-action=follow]";
    let pressed =
        |yes: &str| format!("document.querySelector('{button}')?.ariaPressed === '{yes}'");
    eve.until_true(&pressed("true")).await?;
    eve.click_on(button).await?;
    eve.until_true(&pressed("false")).await?;
    eve.keep(&format!("watch-whole-{width}")).await?;
    eve.click_on(button).await?;
    eve.until_true(&pressed("true")).await?;
    eve.keep(&format!("watch-followed-{width}")).await?;
    if !screen.touch {
        eve.press("1").await?;
        eve.until_true(&pressed("false")).await?;
        eve.press("k").await?;
        let said = "document.querySelector('#clip-text').textContent";
        eve.until_true(&format!("{said} === 'Only players can keep clips.'")).await?;
        eve.press("h").await?;
        let hidden =
            "![...document.querySelectorAll('.hud, #tags')].some(e => e.checkVisibility())";
        eve.until_true(hidden).await?;
        eve.keep(&format!("watch-clean-{width}")).await?;
        eve.press("h").await?;
        eve.until_true(&format!("!({hidden})")).await?;
    }
    let state = ada.state().await?;
    ensure!(state.players.len() == 1, "a spectator has a seat: {:?}", state.players);
    if screen.touch {
        eve.click_on("#menu").await?;
        eve.click_on("#join-room").await?;
        eve.until("a hero of one's own", State::plays).await?;
        eve.until_true("!document.documentElement.hasAttribute('data-watching')").await?;
    }
    Ok(())
}

async fn the_link_of_a_clip_plays_it(stage: Arc<Stage>) -> Result<()> {
    let dir = std::env::temp_dir().join(format!("jostle-clips-{}", std::process::id()));
    std::fs::create_dir_all(&dir)?;
    let config = Config { replays: Some(Settings::new(dir.clone())), ..patient() };
    let server = Server::start(config).await?;
    let ada = stage.visit_link(&server.link("/arena"), Screen::LAPTOP).await?;
    ada.until("a hero of one's own", State::plays).await?;
    ada.until("a second of play", |s| s.tick.unwrap_or(0.0) > 90.0).await?;
    ada.press("k").await?;
    ada.until_true("document.getElementById('clip-link').checkVisibility()").await?;
    ada.keep("clip-1280").await?;
    let link: String = ada.eval("document.getElementById('clip-link').href").await?;
    let bob = stage.visit_link(&link, Screen::PHONE).await?;
    let shown = until(&bob, "the clip", |shown| shown.compared > 0).await?;
    ensure!(shown.differs_at.is_none(), "{shown:?}");
    ensure!(ada.state().await?.state == "playing", "the game goes on");
    stage.clear().await?;
    server.stop().await?;
    std::fs::remove_dir_all(dir).context("the clips")
}
