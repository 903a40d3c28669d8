//! Takes the README's picture: three players in the arena, after some seconds of real play.
//!
//! `cargo xtask pictures` builds the page first and then runs this.

use anyhow::{Context, Result};
use jostle_server::Config;
use jostle_tests::browser::Browser;
use jostle_tests::picture::Picture;
use jostle_tests::server::Server;
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::path::Path;

/// Names, colours, and the screens that they play on; the first one's is photographed.
const PLAYERS: [(&str, u8, Screen); 3] =
    [("Ada", 1, Screen::LAPTOP), ("Grace", 2, Screen::SMALL), ("Alan", 0, Screen::SMALL)];
/// Rounds of play; the picture is the liveliest of those taken after the first few.
const ROUNDS: usize = 26;
const QUIET_ROUNDS: usize = 10;

#[tokio::main]
async fn main() -> Result<()> {
    let server = Server::start(Config::default()).await?;
    let browser = Browser::launch().await?;
    let taken = play(&browser, &server).await;
    browser.close().await?;
    server.stop().await?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/screenshot.png");
    taken?.save(&path)?;
    println!("took {}", path.canonicalize()?.display());
    Ok(())
}

async fn play(browser: &Browser, server: &Server) -> Result<Picture> {
    let mut tabs = Vec::new();
    for (name, color, screen) in PLAYERS {
        let tab = browser.open(&browser.visitor().await?, screen).await?;
        let profile = format!(
            "localStorage.setItem('jostle.name', '{name}'); \
             localStorage.setItem('jostle.color', '{color}')"
        );
        tab.before_load(&profile).await?;
        tab.go(&server.link("/arena")).await?;
        tab.until("a hero of one's own", State::plays).await?;
        tabs.push(tab);
    }
    let mut best: Option<Picture> = None;
    for round in 0..ROUNDS {
        for (player, tab) in tabs.iter().enumerate() {
            act(tab, round * 3 + player).await?;
        }
        if round >= QUIET_ROUNDS {
            let picture = tabs[0].picture().await?;
            if best.as_ref().is_none_or(|best| glow(&picture) > glow(best)) {
                best = Some(picture);
            }
        }
    }
    best.context("no picture was taken")
}

/// One short action: run, fly, throw at another hero, or drop a few dumb minions.
async fn act(tab: &Tab, turn: usize) -> Result<()> {
    let state = tab.state().await?;
    let own = state.own_hero().context("a hero")?.pos;
    let others = state.of_kind("hero").into_iter().filter(|hero| hero.owner != state.seat);
    let near = others.map(|hero| hero.pos).min_by(|a, b| apart(*a, own).total_cmp(&apart(*b, own)));
    let prey = near.unwrap_or([160.0, 60.0]);
    tab.move_to(tab.to_page(prey).await?, false).await?;
    match turn % 8 {
        0 | 4 => tab.hold_key(if prey[0] > own[0] { "d" } else { "a" }, 14).await,
        1 | 3 | 6 => tab.hold_key("w", 16).await,
        5 if turn.is_multiple_of(3) => tab.hold_key("z", 8).await,
        _ => {
            let [x, y] =
                tab.to_page([(own[0] + prey[0]) / 2.0, own[1].max(prey[1]) + 12.0]).await?;
            tab.move_to([x, y], false).await?;
            tab.mouse_down([x, y]).await?;
            tab.mouse_up([x, y]).await
        }
    }
}

fn apart(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// How much of the picture burns.
fn glow(picture: &Picture) -> usize {
    picture.rgb.iter().filter(|pixel| pixel.iter().any(|&channel| channel >= 250)).count()
}
