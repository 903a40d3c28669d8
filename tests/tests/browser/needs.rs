//! Tests that features a scene lacks are neither sent nor created.

use anyhow::{Context, Result};
use jostle_tests::runner::Stage;
use jostle_tests::state::{Gpu, State};
use jostle_tests::tab::{Screen, Tab};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Counts the resources created in the browser, independently of the page's own report.
const COUNT: &str = r#"(() => {
    const made = window.made = {programs: 0, textures: 0};
    const context = WebGL2RenderingContext.prototype;
    const {linkProgram, createTexture} = context;
    context.linkProgram = function (...given) {
        made.programs += 1;
        return linkProgram.apply(this, given);
    };
    context.createTexture = function (...given) {
        made.textures += 1;
        return createTexture.apply(this, given);
    };
})()"#;

#[derive(Debug, PartialEq, Deserialize)]
struct Counted {
    programs: u32,
    textures: u32,
}

async fn counted(tab: &Tab) -> Result<Counted> {
    tab.eval("window.made").await
}

fn gpu(state: &State) -> Result<Gpu> {
    state.gpu.clone().context("the page draws")
}

fn made(pipelines: &[&str], textures: &[(&str, u64)]) -> Gpu {
    Gpu {
        pipelines: pipelines.iter().map(|name| name.to_string()).collect(),
        textures: textures.iter().map(|(name, bytes)| (name.to_string(), *bytes)).collect(),
    }
}

fn bare() -> Gpu {
    made(&["ground", "solids"], &[("light", 64 * 64 * 4)])
}

fn with_particles() -> Gpu {
    let textures = [("light", 64 * 64 * 4), ("particle sprite", 64 * 64 * 4)];
    made(&["ground", "solids", "particles"], &textures)
}

/// Draws at full resolution, because on a slow machine the page would otherwise reduce it and use a texture of a
/// different size.
pub async fn a_scene_without_particles_loads_nothing_for_them(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit_changed(COUNT, "/pile?sharp=1").await?;
    tab.until("the scene", |s| s.state == "playing" && !s.bodies.is_empty()).await?;
    // Play the scene: bodies are created, fall, collide and are removed.
    tab.key_down("z").await?;
    let eight = |s: &State| s.of_kind("dumb").len() >= 8;
    tab.until_aimed([160.0, 60.0], false, "eight dumb minions", eight).await?;
    tab.key_up("z").await?;
    tab.ticks(90).await?;
    tab.hold_key("v", 3).await?;
    tab.until("no dumb minion", |s| s.of_kind("dumb").is_empty()).await?;
    let state = tab.state().await?;
    let sections = state.sections.clone().context("snapshots came")?;
    let came = |name: &str| sections.get(name).copied().unwrap_or(0);
    for name in ["births", "moves", "deaths", "events"] {
        assert!(came(name) > 0, "this game has {name}: {sections:?}");
    }
    assert_eq!(state.emitter_events, 0, "nothing of particles was sent");
    assert_eq!(gpu(&state)?, bare());
    let without = counted(&tab).await?;

    let tab = stage.visit_changed(COUNT, "/particles?sharp=1").await?;
    tab.until("the scene", |s| s.state == "playing" && s.drawn_frames > 2).await?;
    let state = tab.state().await?;
    assert_eq!(state.particles, 0, "nobody sprayed yet");
    assert_eq!(gpu(&state)?, with_particles(), "ready before the first one flies");
    let with = counted(&tab).await?;
    let expected = Counted { programs: without.programs + 1, textures: without.textures + 1 };
    assert_eq!(with, expected, "one pipeline and one texture more");
    Ok(())
}

pub async fn another_room_adds_what_is_missing(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/bounds", Screen::SMALL).await?;
    tab.until("the scene", |s| s.state == "playing" && s.drawn_frames > 2).await?;
    let state = tab.ticks(30).await?;
    assert_eq!(gpu(&state)?, bare());
    let quiet: BTreeMap<String, u64> = state.sections.context("snapshots came")?;
    let idle = |name: &str| !quiet.contains_key(name);
    assert!(idle("moves") && idle("deaths"), "nothing moves here: {quiet:?}");

    tab.go_within("/particles").await?;
    let there = |s: &State| s.plays() && s.gpu.as_ref().is_some_and(|gpu| gpu.pipelines.len() > 2);
    let state = tab.until("the particles' pipeline in the same page", there).await?;
    assert_eq!(gpu(&state)?, with_particles());
    Ok(())
}
