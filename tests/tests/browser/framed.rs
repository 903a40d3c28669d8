//! The page in a frame of another site. To browsers, `localhost` is another site than 127.0.0.1.

use crate::trouble::network_noise;
use anyhow::{Result, anyhow, ensure};
use jostle_server::Config;
use jostle_server::net::http::headers::FrameOrigin;
use jostle_tests::files::{FileServer, static_page};
use jostle_tests::runner::Stage;
use jostle_tests::scripts::NO_STORAGE;
use jostle_tests::server::{Server, patient};
use jostle_tests::state::State;
use jostle_tests::tab::Screen;
use std::sync::Arc;

/// A page that shows the address after its `#` in a frame.
const AROUND: &str = "<link rel=icon href=data:,>\
    <iframe style=\"position: fixed; inset: 0; width: 100%; height: 100%\"></iframe>\
    <script>document.querySelector('iframe').src = location.hash.slice(1)</script>";

/// Starts the other site; returns it and the address of its page.
async fn other_site() -> Result<(FileServer, String)> {
    let page = vec![("around.html".to_owned(), AROUND.into())];
    let site = FileServer::start(static_page(), "/", page).await?;
    let page = site.link("/around.html").replace("127.0.0.1", "localhost");
    Ok((site, page))
}

pub async fn a_room_is_played_in_the_frame_of_another_site(stage: Arc<Stage>) -> Result<()> {
    let (_site, page) = other_site().await?;
    let origin = page.trim_end_matches("/around.html");
    let embedders = vec![FrameOrigin::parse(origin).map_err(|error| anyhow!("{error}"))?];
    let server = Server::start(Config { embedders, ..patient() }).await?;
    let around = stage.visit_link("about:blank", Screen::SMALL).await?;
    let link = server.link("/impulse");
    let frame = around.go_to_frame(&format!("{page}#{link}"), NO_STORAGE).await?;
    let before = frame.until("a hero of one's own", State::plays).await?;

    let blocked = "(() => { try { return localStorage.length; } catch (e) { return e.name; } })()";
    assert_eq!(frame.eval::<String>(blocked).await?, "SecurityError");
    frame.until_true("document.documentElement.dataset.framed === 'yes'").await?;
    for id in ["menu", "leave", "copy", "room-title"] {
        let shown = format!("!document.getElementById('{id}').checkVisibility()");
        frame.until_true(&shown).await?;
    }
    frame.until_true(&format!("document.querySelector('#own-tab').href === '{link}'")).await?;
    around.keep("framed").await?;

    let x = |s: &State| s.own_hero().map_or(f32::NAN, |hero| hero.pos[0]);
    let middle = [320.0, 180.0];
    around.mouse_down(middle).await?;
    around.mouse_up(middle).await?;
    around.key_down("d").await?;
    let moved = frame.until("the hero moving", |s| (x(s) - x(&before)).abs() > 3.0).await?;
    around.key_up("d").await?;

    // Without storage, the page itself still knows its seat.
    frame.eval::<serde_json::Value>("window.jostle.drop_socket()").await?;
    let later = moved.ticks() + 60;
    let after = frame.until("playing again", |s| s.plays() && s.ticks() > later).await?;
    assert_eq!(after.seat, before.seat, "the same seat");
    frame.ignore_errors(network_noise);
    stage.clear().await?;
    server.stop().await
}

/// The default server refuses all frames.
pub async fn a_frame_that_nobody_allowed_stays_empty(stage: Arc<Stage>) -> Result<()> {
    let (_site, page) = other_site().await?;
    let link = format!("{page}#{}", stage.server.link("/impulse"));
    let around = stage.visit_link(&link, Screen::SMALL).await?;
    let refused = |error: &str| error.contains("frame-ancestors") || error.contains("X-Frame");
    around.until_error(refused).await?;
    around.ignore_errors(|error| refused(error) || network_noise(error));
    // Nobody came into the room.
    let other = stage.play("impulse", Screen::SMALL).await?;
    ensure!(other.state().await?.players.len() == 1, "the frame is in the room");
    Ok(())
}
