//! Tests of records: a run that is played alone is submitted, verified and kept, and can be opened as a replay or as a
//! ghost.

use anyhow::{Context, Result, anyhow, ensure};
use jostle_game::Scene;
use jostle_server::Config;
use jostle_server::log::{StateSettings, Sync};
use jostle_tests::runner::{Case, Stage, artifacts};
use jostle_tests::runs::{DASH, DASH_NAME, dash, file, race};
use jostle_tests::scripts::HASTE;
use jostle_tests::server::{Server, patient};
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

pub fn cases() -> Vec<Case> {
    vec![
        Case::new("a_record_is_raced_as_a_ghost", a_record_is_raced_as_a_ghost),
        Case::new("a_run_alone_becomes_a_record", a_run_alone_becomes_a_record),
    ]
}

/// Starts a server with a records directory that contains the given runs.
async fn keeping(name: &str, runs: &[Vec<u8>]) -> Result<(Server, PathBuf)> {
    let dir = artifacts().join(format!("records-{name}"));
    // Remove leftovers of an earlier failed run.
    let _ = fs::remove_dir_all(&dir);
    fs::create_dir_all(dir.join("records"))?;
    for (number, run) in runs.iter().enumerate() {
        fs::write(dir.join(format!("records/{number}.jostle")), run)?;
    }
    let state = StateSettings { dir: dir.clone(), sync: Sync::System };
    let mut config = Config { state: Some(state), ..patient() };
    config.scenes.push(Scene::parse("dash.toml", DASH).map_err(|error| anyhow!("{error}"))?);
    Ok((Server::start(config).await?, dir))
}

async fn records(tab: &Tab, scene: &str) -> Result<Vec<Value>> {
    let list = format!("fetch('/api/records?scene={scene}').then(answer => answer.text())");
    let list: Value = serde_json::from_str(&tab.eval::<String>(&list).await?)?;
    Ok(list["scenes"][0]["records"].as_array().context("a list")?.clone())
}

async fn a_record_is_raced_as_a_ghost(stage: Arc<Stage>) -> Result<()> {
    let (server, dir) = keeping("ghost", &[file(&race())]).await?;
    for screen in [Screen::LAPTOP, Screen::PHONE] {
        let tab = stage.visit_link_changed(HASTE, &server.link("/"), screen).await?;
        let card = "[...document.querySelectorAll('#game-list li')].find(li => li.querySelector('[data-value=race]'))";
        tab.until_true(&format!("{card} && {card}.querySelector('.best').offsetWidth > 0")).await?;
        let best: String =
            tab.eval(&format!("{card}.querySelector('.best span').textContent")).await?;
        ensure!(best.starts_with("Best: ") && best.ends_with(" by Bot Ada"), "{best:?}");
        tab.eval::<bool>(&format!("({card}.scrollIntoView({{ block: 'center' }}), true)")).await?;
        tab.keep(&format!("records-lobby-{}", screen.width)).await?;
        tab.eval::<bool>(&format!("({card}.querySelector('.race').click(), true)")).await?;
        let state = tab.until("a ghost", |s| s.state == "playing" && s.ghost.is_some()).await?;
        assert_eq!(state.players.len(), 1, "the ghost is no player");
        let start = state.ghost.context("a ghost")?;
        let is_away =
            |s: &State| s.ghost.is_some_and(|[x, y]| (x - start[0]).hypot(y - start[1]) > 30.0);
        // The ghost waits for the player's own round and then flies along.
        let away = tab.until("a ghost on its way", is_away).await?;
        ensure!(away.tick.is_some_and(|tick| tick > 180.0), "before the start: {:?}", away.tick);
        tab.keep(&format!("records-ghost-{}", screen.width)).await?;
        // The ghost is where its run was at the same time after the start.
        let bodies = away.bodies.iter().filter(|body| body.kind == "hero").count();
        assert_eq!(bodies, 1, "the ghost is no body");
        tab.until("a ghost further on", |s| s.ghost != away.ghost && is_away(s)).await?;
        stage.clear().await?;
    }
    server.stop().await?;
    fs::remove_dir_all(&dir)?;
    Ok(())
}

async fn a_run_alone_becomes_a_record(stage: Arc<Stage>) -> Result<()> {
    // A long run, which is easy to beat.
    let (server, dir) = keeping("alone", &[file(&dash("Slow", 1200))]).await?;
    let tab = stage.visit_link(&server.link("/#alone=dash"), Screen::LAPTOP).await?;
    tab.until("a hero of one's own", State::plays).await?;
    tab.key_down("d").await?;
    tab.until_true("document.querySelector('#result-said').textContent.startsWith('A new record')")
        .await?;
    tab.key_up("d").await?;
    tab.until_true("!document.querySelector('#best-run').textContent.endsWith('Slow')").await?;
    tab.keep_on_all_screens("records-result").await?;
    let kept = records(&tab, DASH_NAME).await?;
    assert_eq!(kept.len(), 2);
    ensure!(kept[0]["ticks"].as_u64() < kept[1]["ticks"].as_u64(), "{kept:?}");
    assert_eq!(kept[1]["players"][0], "Slow");
    tab.click_on("#best-watch").await?;
    let watched = |s: &State| {
        s.state == "replay"
            && s.replay.as_ref().is_some_and(|r| r.tick > 5 && r.differs_at.is_none())
    };
    tab.until("the replay of the record", watched).await?;
    server.stop().await?;
    fs::remove_dir_all(&dir)?;
    Ok(())
}
