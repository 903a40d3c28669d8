//! Prediction of the player's hero, and the panel with the simulated network.

use anyhow::{Context, Result, ensure};
use jostle_tests::runner::Stage;
use jostle_tests::server::LONG;
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use serde::Deserialize;
use std::sync::Arc;
use std::time::Instant;

/// A script for the page that records how far the hero is drawn from its initial position while it is still there in
/// the server's newest snapshot.
const WATCH: &str = r#"(() => {
    const watch = window.watch = {ahead: 0, told: 0};
    let stood = null;
    const look = () => {
        const state = JSON.parse(window.jostle.state());
        const told = state.told_place, drawn = window.jostle.own_place();
        if (told && drawn) {
            stood ??= [told[0], drawn[0]];
            watch.told = Math.abs(told[0] - stood[0]);
            if (watch.told === 0) watch.ahead = Math.max(watch.ahead, Math.abs(drawn[0] - stood[1]));
        }
        if (window.watch === watch) requestAnimationFrame(look);
    };
    look();
    return true;
})()"#;

#[derive(Debug, Deserialize)]
struct Watched {
    /// Distance that the drawn hero covers before the server reports a movement, in world units.
    ahead: f32,
    /// Distance that the hero has moved in the snapshots.
    told: f32,
}

/// Steers with a key over a link with 0.8 s of delay until the hero has moved far in the snapshots, but for at most
/// five seconds, since something may block it.
async fn steer(tab: &Tab, key: &str) -> Result<Watched> {
    tab.until("a hero of one's own", State::plays).await?;
    tab.ticks(120).await?;
    tab.eval::<bool>(WATCH).await?;
    tab.key_down(key).await?;
    let end = tab.state().await?.ticks() + 300;
    tab.until_true(&format!("watch.told > 5 || JSON.parse(jostle.state()).tick > {end}")).await?;
    tab.key_up(key).await?;
    tab.eval("window.watch").await
}

pub async fn a_key_moves_the_hero_before_the_server_says_so(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/impulse?lag=800,20", Screen::SMALL).await?;
    let deadline = Instant::now() + LONG;
    // A page that draws fewer than two frames per second may miss the difference, and a minion may push the hero, so
    // steer back and try again.
    for key in ["d", "a"].into_iter().cycle() {
        let seen = steer(&tab, key).await?;
        if seen.ahead > 2.0 {
            break;
        }
        ensure!(Instant::now() < deadline, "the hero waits for the server: {seen:?}");
    }
    // The server's state wins, so both positions are equal at rest.
    let together = |s: &State| {
        let apart =
            |(drawn, told): ([f32; 2], [f32; 2])| (drawn[0] - told[0]).hypot(drawn[1] - told[1]);
        s.own_hero().map(|hero| hero.pos).zip(s.told_place).is_some_and(|both| apart(both) < 0.02)
    };
    tab.until("the hero where the server has it", together).await?;
    Ok(())
}

pub async fn without_prediction_the_hero_waits(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/impulse?lag=800,20&predict=0", Screen::SMALL).await?;
    let mut seen = steer(&tab, "d").await?;
    if seen.told <= 5.0 {
        seen = steer(&tab, "a").await?;
    }
    assert!(
        seen.ahead == 0.0 && seen.told > 5.0,
        "nothing moves before the server says so: {seen:?}"
    );
    assert_eq!(tab.state().await?.prediction, None);
    Ok(())
}

pub async fn the_panel_simulates_a_bad_network(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("arena", Screen::LAPTOP).await?;
    ensure!(!shown(&tab, "#network").await? && !shown(&tab, "#lag-badge").await?, "nothing yet");
    tab.key_down("F4").await?;
    tab.key_up("F4").await?;
    ensure!(shown(&tab, "#network").await?, "F4 opens the panel");
    tab.key_down("F3").await?;
    tab.key_up("F3").await?;
    tab.until_true(
        "document.querySelector('#network').getBoundingClientRect().bottom <= innerHeight \
         && document.querySelector('#figures').getBoundingClientRect().height > 100",
    )
    .await?;
    tab.keep("figures-network").await?;
    tab.key_down("F3").await?;
    tab.key_up("F3").await?;
    tab.until_true("/ms$/.test(document.getElementById('net-trip').textContent)").await?;
    tab.until_true("parseInt(document.getElementById('net-rate').textContent) > 0").await?;

    // Selects the second and then the third choice, using only the keyboard.
    tab.eval::<bool>("(document.querySelector('#net-presets input:checked').focus(), true)")
        .await?;
    for _ in 0..2 {
        tab.key_down("ArrowDown").await?;
        tab.key_up("ArrowDown").await?;
    }
    let badge = "document.getElementById('lag-badge')";
    tab.until_true(&format!("!{badge}.hidden && {badge}.textContent.includes('150')")).await?;
    tab.until_true("parseInt(document.getElementById('net-trip').textContent) >= 100").await?;
    tab.until("a game that goes on", |s| s.prediction.is_some() && s.plays()).await?;

    tab.key_down("Escape").await?;
    tab.key_up("Escape").await?;
    ensure!(!shown(&tab, "#network").await?, "Escape closes the panel");
    ensure!(shown(&tab, "#lag-badge").await?, "the badge stays while the network is bad");
    let focused: String = tab.eval("document.activeElement.id").await?;
    assert_eq!(focused, "stage", "keys belong to the game again");

    tab.key_down("F4").await?;
    tab.key_up("F4").await?;
    tab.click_on("#net-presets label").await?;
    tab.until_true(&format!("{badge}.hidden")).await?;
    let before = tab.state().await?.own_hero().context("a hero")?.pos;
    tab.key_down("d").await?;
    tab.until("the hero on its way", |s| {
        s.own_hero().is_some_and(|hero| (hero.pos[0] - before[0]).abs() > 2.0)
    })
    .await?;
    tab.key_up("d").await?;
    tab.ticks(60).await?;
    Ok(())
}

async fn shown(tab: &Tab, selector: &str) -> Result<bool> {
    tab.eval(&format!("document.querySelector('{selector}').offsetParent !== null")).await
}
