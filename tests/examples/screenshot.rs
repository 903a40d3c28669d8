//! Takes the screenshot for the README: three players in the arena after a few seconds of real play. `cargo xtask
//! pictures` builds the page first and then runs this program.

use anyhow::{Context, Result};
use jostle_server::Config;
use jostle_tests::browser::Browser;
use jostle_tests::picture::Picture;
use jostle_tests::server::Server;
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::path::Path;

/// Name, colour and screen of each player. The screenshot shows the first player's screen.
const PLAYERS: [(&str, u8, Screen); 3] =
    [("Ada", 1, Screen::LAPTOP.sharp()), ("Grace", 2, Screen::SMALL), ("Alan", 0, Screen::SMALL)];
/// Number of rounds to play. Pictures are taken after the first few rounds, and the liveliest one is kept.
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
        let acts = tabs.iter().enumerate().map(|(player, tab)| act(tab, round + player));
        futures_util::future::try_join_all(acts).await?;
        if round >= QUIET_ROUNDS {
            let picture = tabs[0].picture().await?;
            if best.as_ref().is_none_or(|best| glow(&picture) > glow(best)) {
                best = Some(picture);
            }
        }
    }
    best.context("no picture was taken")
}

/// Performs one short action: flies towards another hero and throws a pack at it, or sometimes drops marbles.
async fn act(tab: &Tab, turn: usize) -> Result<()> {
    let state = tab.state().await?;
    let own = state.own_hero().context("a hero")?.pos;
    let others = state.of_kind("hero").into_iter().filter(|hero| hero.owner != state.seat);
    let near = others.map(|hero| hero.pos).min_by(|a, b| apart(*a, own).total_cmp(&apart(*b, own)));
    let prey = near.unwrap_or([160.0, 60.0]);
    let aside = if prey[0] > own[0] { "d" } else { "a" };
    // Low heroes rise and high ones glide, so that the picture shows more than the floor.
    let rises = own[1] < 40.0 + 20.0 * (turn % 4) as f32;
    tab.key_down(aside).await?;
    if rises {
        tab.key_down("w").await?;
    }
    let at = tab.aim([(own[0] + prey[0]) / 2.0, own[1].max(prey[1]) + 10.0]).await?;
    tab.mouse_down(at).await?;
    tab.mouse_up(at).await?;
    tab.ticks(14).await?;
    if turn.is_multiple_of(9) {
        tab.hold_key("z", 6).await?;
    }
    tab.key_up(aside).await?;
    tab.key_up("w").await
}

fn apart(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Number of burning pixels.
fn glow(picture: &Picture) -> usize {
    picture.rgb.iter().filter(|pixel| pixel.iter().any(|&channel| channel >= 250)).count()
}
