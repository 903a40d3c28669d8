//! Failures of sockets, servers, graphics, focus and rooms. In each case the player learns what happened, and other
//! players are not affected.

use anyhow::{Context, Result};
use jostle_protocol::Refusal;
use jostle_server::Config;
use jostle_server::log::{StateSettings, Sync};
use jostle_tests::http_proxy::HttpProxy;
use jostle_tests::runner::Stage;
use jostle_tests::server::{Server, patient};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// Whether an error is one that Chromium itself logs when a request or a socket fails, as these tests cause them to.
pub fn network_noise(error: &str) -> bool {
    error.contains("Failed to load resource") || error.contains("WebSocket connection to")
}

pub async fn a_lost_socket_gives_the_same_seat_back(stage: Arc<Stage>) -> Result<()> {
    let ada = stage.play("impulse", Screen::SMALL).await?;
    let bob = stage.play("impulse", Screen::SMALL).await?;
    let before = ada.until("two players", |s| s.connected() == 2).await?;
    ada.record().await?;
    bob.record().await?;
    ada.eval::<serde_json::Value>("window.jostle.drop_socket()").await?;
    let later = before.ticks() + 60;
    let after = ada.until("playing again", |s| s.plays() && s.ticks() > later).await?;
    assert_eq!(after.seat, before.seat, "the same seat");
    let seen = ada.recorded().await?;
    assert!(seen.states.iter().any(|s| s == "reconnecting"), "the page said so: {seen:?}");
    // Bob's page may be slower than Ada's.
    let both = |s: &State| s.ticks() >= after.ticks() && s.connected() == 2;
    let others = bob.until("Ada again", both).await?;
    assert_eq!(bob.recorded().await?.states, ["playing"], "Bob plays on");

    let seat = after.seat.context("a seat")?;
    let x = others.hero(seat).context("Ada's hero")?.pos[0];
    ada.key_down("d").await?;
    bob.until("Ada steering again", |s| s.hero(seat).is_some_and(|h| h.pos[0] > x + 4.0)).await?;
    ada.key_up("d").await?;
    ada.ignore_errors(network_noise);
    Ok(())
}

/// Goes back by mistake, as the only player of a room, and forward again.
pub async fn back_and_forward_keep_the_seat(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/", Screen::SMALL).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.click_on("#playground-list [data-value=arena]").await?;
    let before = tab.until("a hero of one's own", State::plays).await?;
    let link = tab.link().await?;
    tab.eval::<bool>("(history.back(), true)").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.eval::<bool>("(history.forward(), true)").await?;
    let after = tab.until("a hero of one's own", State::plays).await?;
    assert_eq!((tab.link().await?, after.seat), (link, before.seat));
    // A new hero would have another generation, and a new room would begin at the first tick.
    let body = |s: &State| s.own_hero().map(|hero| (hero.id, hero.generation));
    assert_eq!(body(&after), body(&before));
    assert!(after.ticks() >= before.ticks(), "{before:?} before {after:?}");
    Ok(())
}

pub async fn a_page_below_a_path_says_that_it_needs_the_root(stage: Arc<Stage>) -> Result<()> {
    let proxy = HttpProxy::below_path(stage.server.address).await?;
    let shown = "document.querySelector('.unstyled').checkVisibility()";
    let tab = stage.visit_link(&format!("http://{}/jostle/", proxy.address), Screen::TINY).await?;
    tab.until_true(shown).await?;
    // Closed at once, since Chromium asks for the icon later.
    tab.ignore_errors(network_noise);
    stage.close(tab).await?;
    let tab = stage.visit("/", Screen::TINY).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until_true(&format!("!{shown}")).await
}

pub async fn a_restarted_server_is_found_again(stage: Arc<Stage>) -> Result<()> {
    let server = Server::start(patient()).await?;
    let address = server.address;
    let tab = stage.visit_link(&server.link("/impulse"), Screen::SMALL).await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.record().await?;
    server.stop().await?;
    tab.until("the loss noticed", |s| s.state == "reconnecting").await?;
    assert_notice(&tab, "reconnect automatically").await?;
    let server = Server::start_at(address, patient()).await?;
    // The page reconnects without any action by the player.
    tab.until("playing on the new server", State::plays).await?;
    let seen = tab.recorded().await?;
    assert!(!seen.states.iter().any(|s| s == "refused"), "the page never gave up: {seen:?}");
    tab.ignore_errors(network_noise);
    stage.clear().await?;
    server.stop().await
}

pub async fn a_room_outlives_its_server(stage: Arc<Stage>) -> Result<()> {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kept-rooms");
    // Remove leftovers of an earlier failed run.
    let _ = fs::remove_dir_all(&dir);
    let state = StateSettings { dir: dir.clone(), sync: Sync::Second };
    let config = || Config { state: Some(state.clone()), ..patient() };
    let server = Server::start(config()).await?;
    let address = server.address;
    let tab = stage.visit_link(&server.link("/bounds"), Screen::SMALL).await?;
    tab.until("the scene", |s| s.state == "playing" && s.bodies.len() >= 15).await?;
    tab.hold_key("p", 3).await?;
    let picked = |s: &State| {
        let selected = s.own_player().and_then(|player| player.selected);
        s.bodies.iter().any(|body| Some(body.id) == selected && body.kind == "platform")
    };
    let before = tab.until("a platform picked", picked).await?;
    server.stop().await?;
    tab.until("the loss noticed", |s| s.state == "reconnecting").await?;
    assert_notice(&tab, "The game goes on where it was").await?;
    let server = Server::start_at(address, config()).await?;
    // Without any action, the page has its seat and selection again. In a different room the shapes would be elsewhere,
    // since their positions are random.
    let after = tab.until("playing on", |s| s.state == "playing" && picked(s)).await?;
    let later = tab.ticks(30).await?;
    for state in [after, later] {
        assert_eq!(state.own_player(), before.own_player());
        assert_eq!(state.bodies, before.bodies);
    }
    tab.ignore_errors(network_noise);
    stage.clear().await?;
    server.stop().await?;
    Ok(fs::remove_dir_all(dir)?)
}

/// Waits until the card in the middle of the page shows the given text.
pub async fn assert_notice(tab: &Tab, text: &str) -> Result<()> {
    let text = serde_json::to_string(text)?;
    tab.until_true(&format!(
        "!document.querySelector('#notice').hidden && \
         document.querySelector('#notice-text').innerText.includes({text})"
    ))
    .await
}

/// Loses the graphics context, restores it as soon as the page requests it, and loses it again both at that moment and
/// while drawing is being set up. `window.losses` counts all three.
const LOSE: &str = "(() => {
    const canvas = document.getElementById('stage');
    const context = WebGL2RenderingContext.prototype;
    const lost = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    const {createShader} = context;
    window.losses = 0;
    canvas.addEventListener('webglcontextlost', () => {
        losses += 1;
        setTimeout(() => lost.restoreContext());
    });
    canvas.addEventListener('webglcontextrestored', () => {
        if (losses === 1) lost.loseContext();
        if (losses === 2) context.createShader = function (...given) {
            context.createShader = createShader;
            lost.loseContext();
            return null;
        };
    });
    lost.loseContext();
})()";

pub async fn a_lost_webgl_context_is_drawn_again(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/?demo=arena&seed=3&ticks=200&bots=3", Screen::SMALL.sharp()).await?;
    tab.until("the frozen demo", |s| s.state == "frozen").await?;
    let before = tab.steady_picture().await?;
    assert!(before.colors() > 100, "{} colours", before.colors());

    let drawn = tab.state().await?.drawn_frames;
    tab.eval::<serde_json::Value>(LOSE).await?;
    tab.until_true("window.losses === 3").await?;
    tab.until("frames after the losses", |s| s.drawn_frames > drawn).await?;
    let after = tab.steady_picture().await?;
    let difference = after.compare(&before, 8)?;
    assert!(difference.max <= 8, "the same picture as before: {difference:?}");
    tab.ignore_errors(graphics_noise);
    Ok(())
}

/// Whether an error is a panic in wgpu, which stops only the drawing.
fn graphics_noise(error: &str) -> bool {
    error.contains("panicked at") && (error.contains("wgpu") || error.contains("glow"))
}

pub async fn lost_focus_releases_keys(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("impulse", Screen::SMALL).await?;
    let x = |s: &State| s.own_hero().map_or(f32::NAN, |hero| hero.pos[0]);
    let before = x(&tab.state().await?);
    tab.key_down("d").await?;
    tab.until("running", |s| x(s) > before + 5.0).await?;
    tab.eval::<bool>("window.dispatchEvent(new Event('blur'))").await?;
    // The browser still considers the key down; without steering, friction stops the hero.
    let mut last = x(&tab.state().await?);
    for _ in 0..40 {
        let now = x(&tab.ticks(15).await?);
        if (now - last).abs() < 0.01 {
            return Ok(());
        }
        last = now;
    }
    anyhow::bail!("the hero runs on at x = {last} without focus")
}

pub async fn a_wrong_room_is_explained(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/nosuch", Screen::SMALL).await?;
    tab.until("a refusal", |s| s.state == "refused").await?;
    assert_notice(&tab, Refusal::NoSuchRoom.message()).await?;
    tab.click_on("#notice-other").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.go(&stage.server.link("/r/ABC")).await?;
    tab.until("a refusal", |s| s.state == "refused").await?;
    tab.click_on("#notice-button").await?;
    tab.until("a hero of one's own", State::plays).await?;
    assert_eq!(tab.link().await?, stage.server.link("/splash"));
    tab.go(&stage.server.link("/Impulse/")).await?;
    tab.until("a hero of one's own", State::plays).await?;
    assert_eq!(tab.link().await?, stage.server.link("/impulse"));
    tab.ignore_errors(network_noise);
    Ok(())
}

pub async fn the_lack_of_webgl2_is_explained(stage: Arc<Stage>) -> Result<()> {
    for script in [
        "HTMLCanvasElement.prototype.getContext = () => null",
        "WebGL2RenderingContext.prototype.getSupportedExtensions = () => null",
    ] {
        let tab = stage.visit_changed(script, "/impulse").await?;
        tab.until_true("document.documentElement.dataset.state === 'unsupported'").await?;
        assert_notice(&tab, "browser").await?;
        // The seat is held in the meantime.
        tab.until("a hero that is not seen", |s| s.own_hero().is_some()).await?;
        tab.ignore_errors(graphics_noise);
    }
    Ok(())
}

pub async fn a_game_is_played_where_no_websocket_opens(stage: Arc<Stage>) -> Result<()> {
    let proxy = HttpProxy::without_upgrades(stage.server.address).await?;
    let link = |room: &str| format!("http://{}/{room}", proxy.address);
    let ada = stage.visit_link(&link("impulse"), Screen::SMALL).await?;
    let bob = stage.play("impulse", Screen::SMALL).await?;
    let told = "document.querySelector('#told').textContent.includes('WebSockets are blocked')";
    ada.until_true(told).await?;
    let seat = ada.until("a hero of one's own", State::plays).await?.seat.context("a seat")?;
    let x = |s: &State| s.hero(seat).map(|hero| hero.pos[0]);
    let before = bob.until("Ada's hero", |s| x(s).is_some()).await?;
    let before = x(&before).context("Ada's hero")?;
    ada.key_down("d").await?;
    bob.until("Ada steering", |s| x(s).is_some_and(|x| x > before + 4.0)).await?;
    ada.key_up("d").await?;
    // The seat is held when the stream breaks.
    let later = ada.state().await?.ticks() + 60;
    ada.eval::<serde_json::Value>("window.jostle.drop_socket()").await?;
    let back = ada.until("playing again", |s| s.plays() && s.ticks() > later).await?;
    assert_eq!(back.seat, Some(seat));
    // This tab does not try a WebSocket first any more, so it says nothing.
    ada.go(&link("impulse")).await?;
    ada.until("a hero of one's own", State::plays).await?;
    ada.until_true(&format!("!({told})")).await?;
    // A player who leaves gives up the seat.
    ada.click_on("#menu").await?;
    ada.click_on("#leave").await?;
    bob.until("Ada gone", |s| s.players.len() == 1).await?;
    ada.ignore_errors(network_noise);
    Ok(())
}
