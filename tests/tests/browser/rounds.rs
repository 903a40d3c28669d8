//! Rounds on the page: the countdown, the score board, the result, and the next round.

use anyhow::{Context, Result, anyhow};
use jostle_game::Scene;
use jostle_server::Config;
use jostle_tests::runner::Stage;
use jostle_tests::scenes::DUEL;
use jostle_tests::server::{Server, patient};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;
use std::time::Instant;

/// Returns an element's text, trimmed.
async fn text(tab: &Tab, id: &str) -> Result<String> {
    tab.eval(&format!("document.getElementById('{id}').textContent.trim()")).await
}

/// The remaining lives of each side, separated by commas.
const LIVES: &str =
    "[...document.querySelectorAll('#sides .lives')].map(l => l.textContent.length).join()";

/// Notes whether the countdown of a round is shown.
const COUNTED: &str = "(() => { const large = document.getElementById('round-large'); \
    new MutationObserver(() => window.counted ||= /^[123]$/.test(large.textContent)) \
    .observe(large, {childList: true, characterData: true, subtree: true}); return true; })()";

/// Starts a server with the duel, in which each side has the given number of lives.
async fn dueling(lives: u8) -> Result<Server> {
    let duel = DUEL.replace("lives = 3", &format!("lives = {lives}"));
    let duel = Scene::parse("duel.toml", &duel).map_err(|error| anyhow!("{error}"))?;
    Server::start(Config { scenes: vec![duel], ..patient() }).await
}

async fn duelist(stage: &Stage, server: &Server, screen: Screen) -> Result<Tab> {
    let tab = stage.visit_link(&server.link("/duel"), screen).await?;
    tab.until("a hero of one's own", State::plays).await?;
    Ok(tab)
}

/// No player defends, so the ball flies to the right, and the right side loses its lives.
pub async fn a_round_is_counted_down_played_and_won(stage: Arc<Stage>) -> Result<()> {
    let server = dueling(2).await?;
    let ada = duelist(&stage, &server, Screen::SMALL).await?;
    let waits = "Waiting for players: 1 of 2. Send the link to a friend";
    ada.until_true(&format!("document.getElementById('round-task').textContent === '{waits}'"))
        .await?;
    let bob = duelist(&stage, &server, Screen::PHONE).await?;
    for tab in [&ada, &bob] {
        tab.until_true("/^[123]$/.test(document.getElementById('round-large').textContent)")
            .await?;
        assert_eq!(text(tab, "round-task").await?, "Keep the ball out of your side");
    }
    for tab in [&ada, &bob] {
        tab.until_true("document.getElementById('round-large').hidden").await?;
        // Both sides are shown with their emblems and lives.
        tab.until_true("document.querySelectorAll('#sides li').length === 2").await?;
        let emblems =
            "[...document.querySelectorAll('#sides i')].map(i => i.dataset.emblem).join()";
        assert_eq!(tab.eval::<String>(emblems).await?, "0,1");
    }
    ada.until_true(&format!("{LIVES} === '2,1'")).await?;
    for (tab, title) in [(&ada, "You won!"), (&bob, "You lost")] {
        tab.until_true("!document.getElementById('result').hidden").await?;
        assert_eq!(text(tab, "result-title").await?, title);
        let said = format!("{title} \u{2013} Left won");
        assert_eq!(text(tab, "round-said").await?, said, "for screen readers");
        let inside = "(() => { const r = document.getElementById('result').getBoundingClientRect(); \
                      return r.left >= 0 && r.right <= innerWidth && r.top >= 0 && r.bottom <= innerHeight; })()";
        assert!(tab.eval::<bool>(inside).await?, "the result is on the screen");
    }
    Ok(())
}

/// Checks that the highlights are shown in place of the result until they end.
pub async fn the_end_of_a_round_is_watched_once_more(stage: Arc<Stage>) -> Result<()> {
    let server = dueling(1).await?;
    let ada = duelist(&stage, &server, Screen::SMALL).await?;
    let _bob = duelist(&stage, &server, Screen::TINY).await?;
    ada.until_true("!document.getElementById('result').hidden").await?;
    ada.click_on("#highlights").await?;
    ada.until_true("document.getElementById('highlight').textContent === 'Highlight 1 of 1'")
        .await?;
    let result = "document.getElementById('result').checkVisibility()";
    assert!(!ada.eval::<bool>(result).await?, "the result gives way");
    ada.keep_on_all_screens("highlight").await?;
    ada.key_down("Escape").await?;
    ada.key_up("Escape").await?;
    ada.until_true(result).await
}

pub async fn the_next_round_begins_when_both_want_it(stage: Arc<Stage>) -> Result<()> {
    let server = dueling(1).await?;
    let ada = duelist(&stage, &server, Screen::SMALL).await?;
    let bob = duelist(&stage, &server, Screen::PHONE).await?;
    for tab in [&ada, &bob] {
        tab.until_true("!document.getElementById('result').hidden").await?;
    }
    // One player requests the next round with the button, the other with a key.
    ada.click_on("#again").await?;
    ada.until_true("document.getElementById('again').disabled").await?;
    bob.key_down("Enter").await?;
    bob.key_up("Enter").await?;
    ada.until_true(&format!("document.getElementById('result').hidden && {LIVES} === '1,1'"))
        .await?;
    let emblem = "document.querySelector('#players .own i').dataset.emblem";
    ada.until_true(&format!("{emblem} === '0'")).await?;
    ada.key_down("t").await?;
    ada.key_up("t").await?;
    ada.until_true(&format!("{emblem} === '1'")).await?;
    ada.click_on("#switch-team").await?;
    ada.until_true(&format!("{emblem} === '0'")).await
}

/// Checks that pressing Play in an empty lobby starts a game against bots.
pub async fn play_begins_a_game_with_bots(stage: Arc<Stage>) -> Result<()> {
    let server = Server::start(patient()).await?;
    let ada = stage.visit_link(&server.link("/"), Screen::LAPTOP).await?;
    ada.until("the lobby", |s| s.state == "lobby").await?;
    ada.eval::<bool>(COUNTED).await?;
    let clicked = Instant::now();
    ada.click_on("#play").await?;
    ada.until("a hero of one's own", State::plays).await?;
    ada.until_true("document.querySelectorAll('#players li').length > 1").await?;
    let took_s = clicked.elapsed().as_secs_f64();
    stage.note(format!("{took_s:.1} s from Play to a hero among others"));
    ada.until_true("document.getElementById('round-task').textContent.trim() !== ''").await?;
    ada.until_true("window.counted").await.context("a countdown")
}
