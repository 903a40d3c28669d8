//! Tests that scenes frozen at a tick look like their golden pictures and have the same state hash as native games.
//!
//! `JOSTLE_UPDATE_GOLDENS=1` updates the pictures; look at them before you commit them.

use anyhow::{Context, Result, anyhow, bail, ensure};
use jostle_client_web::world::replica::{Eye, Replica};
use jostle_client_web::world::room_in_page::RoomInPage;
use jostle_game::Scene;
use jostle_protocol::{Appearance, ClientMessage, Role, ServerMessage, VERSION};
use jostle_tests::picture::Picture;
use jostle_tests::runner::{Case, Stage, artifacts};
use jostle_tests::tab::{Screen, Tab};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const SEED: u64 = 7;
const BOTS: u8 = 2;
/// Maximum mean difference. A different version of the software renderer may round differently, and then edges differ
/// considerably.
const MEAN_MAX: f64 = 0.5;
/// A pixel counts as different if a channel differs by more than this.
const CHANNEL_MAX: u8 = 8;
/// Largest accepted share of such pixels.
const OUTLIERS_MAX: f64 = 0.001;

/// Number of cases that share the scenes.
const PARTS: usize = 4;

pub fn cases() -> impl Iterator<Item = Case> {
    (0..PARTS).map(|part| {
        let name = format!("frozen_scenes_look_as_they_did_{}_of_{PARTS}", part + 1);
        Case::new(name, move |stage| frozen_scenes_look_as_they_did(stage, part))
    })
}

/// Shows the scenes of a part in one page, one after another.
async fn frozen_scenes_look_as_they_did(stage: Arc<Stage>, part: usize) -> Result<()> {
    let tab = stage.visit("/", Screen::SMALL.sharp()).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    let mut wrong = Vec::new();
    for scene in Scene::built_in().into_iter().skip(part).step_by(PARTS) {
        if let Err(error) = a_frozen_scene_looks_as_it_did(&stage, &tab, &scene.name).await {
            stage.note(format!("{}: {error:#}", scene.name));
            wrong.push(scene.name);
        }
    }
    ensure!(wrong.is_empty(), "other pictures than before: {}", wrong.join(", "));
    Ok(())
}

async fn a_frozen_scene_looks_as_it_did(stage: &Stage, tab: &Tab, scene: &str) -> Result<()> {
    let tick = picture_tick(scene);
    tab.go_within(&demo_path(scene, tick)).await?;
    let state = tab.until("the frozen demo", |s| s.state == "frozen").await?;
    let shown = state.tick.context("a tick")?;
    ensure!(shown == f64::from(tick), "it stands still at tick {shown}, not {tick}");
    let picture = tab.steady_picture().await?;
    ensure!(picture.colors() > 50, "only {} colours", picture.colors());
    check(stage, scene, &picture)
}

/// The tick at which a scene's picture is taken, late enough for something to have happened.
fn picture_tick(scene: &str) -> u32 {
    match scene {
        "bounds" => 90,
        "particles" => 150,
        "emitters" => 170,
        "arena" => 400,
        _ => 300,
    }
}

/// Compares a picture with a scene's golden picture, or updates the latter.
pub fn check(stage: &Stage, scene: &str, picture: &Picture) -> Result<()> {
    let golden_path = goldens().join(format!("{scene}.png"));
    if std::env::var_os("JOSTLE_UPDATE_GOLDENS").is_some_and(|value| value == "1") {
        stage.note(format!("took {}", golden_path.display()));
        return picture.save(&golden_path);
    }
    let golden = Picture::load(&golden_path)?;
    let difference = picture.compare(&golden, CHANNEL_MAX)?;
    let outliers = difference.outliers as f64 / picture.rgb.len() as f64;
    if difference.mean < MEAN_MAX && outliers < OUTLIERS_MAX {
        return Ok(());
    }
    let seen = artifacts().join(format!("{scene}-seen.png"));
    picture.save(&seen)?;
    picture.difference(&golden).save(&artifacts().join(format!("{scene}-difference.png")))?;
    bail!(
        "mean difference {:.3} (below {MEAN_MAX}), largest {}, {:.3} % of the pixels beyond \
         {CHANNEL_MAX} (below {} %); see {}",
        difference.mean,
        difference.max,
        outliers * 100.0,
        OUTLIERS_MAX * 100.0,
        seen.display()
    )
}

pub fn goldens() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("goldens")
}

/// The path of a demo that is frozen at a tick.
fn demo_path(scene: &str, tick: u32) -> String {
    format!("/?demo={scene}&seed={SEED}&ticks={tick}&bots={BOTS}")
}

pub async fn the_page_plays_bit_for_bit(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/", Screen::SMALL).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    for (scene, tick) in [("arena", 900), ("impulse", 900), ("emitters", 300)] {
        tab.go_within(&demo_path(scene, tick)).await?;
        let page = tab.until("the frozen demo", |s| s.state == "frozen").await?;
        let (demo, native) = native_demo(scene, tick)?;
        let stale = "is client-web/dist built from this code? `cargo xtask web` builds it";
        assert_eq!(page.bodies.len(), native.room.samples.len(), "{scene}: bodies; {stale}");
        for (shown, sample) in page.bodies.iter().zip(&native.room.samples) {
            let name = (sample.id.index, sample.id.generation, sample.kind.name());
            assert_eq!((shown.id, shown.generation, shown.kind.as_str()), name, "{scene}");
            let bits = [sample.center.x.to_bits(), sample.center.y.to_bits()];
            assert_eq!(shown.pos.map(f32::to_bits), bits, "{scene}: {shown:?}, not {sample:?}");
        }
        assert_eq!(page.particles as usize, native.particles().len(), "{scene}: particles");
        let digits = |digest: u64| Some(format!("{digest:016x}"));
        let digest = digits(native.particles().digest());
        assert_eq!(page.particle_digest, digest, "{scene}: digest of the particles; {stale}");
        let hash = digits(demo.state_hash());
        assert_eq!(page.hash, hash, "{scene}: state hash of the game; {stale}");
    }
    Ok(())
}

/// Plays in this process the same game that the page plays for [`demo_path`]; returns the room and its replica.
fn native_demo(scene: &str, ticks: u32) -> Result<(RoomInPage, Replica)> {
    let found = Scene::built_in().into_iter().find(|built_in| built_in.name == scene);
    let scene = Arc::new(found.with_context(|| format!("no scene {scene}"))?);
    let appearance = Appearance::new("Native", 0).map_err(|error| anyhow!("{error:?}"))?;
    let mut demo = RoomInPage::new(Arc::clone(&scene), SEED, BOTS, true);
    let (token, host_key, role) = (None, None, Role::Player);
    let hello = ClientMessage::Hello { version: VERSION, appearance, token, host_key, role };
    demo.receive(&hello.encode());
    let mut replica = None;
    for tick in 0..=ticks {
        for bytes in demo.take() {
            receive(&scene, &mut replica, &bytes)?;
        }
        if let Some(replica) = &mut replica {
            replica.advance(f64::from(tick), Eye { pointer: None, bounds: false });
        }
        if tick < ticks {
            demo.tick();
        }
    }
    Ok((demo, replica.context("the demo gave no seat")?))
}

fn receive(scene: &Arc<Scene>, replica: &mut Option<Replica>, bytes: &[u8]) -> Result<()> {
    match (ServerMessage::decode(bytes)?, replica) {
        (ServerMessage::Welcome { seat: Some(own), .. }, replica) => {
            *replica = Some(Replica::new(Arc::clone(scene), own.seat));
        }
        (ServerMessage::Snapshot(coded), Some(replica)) => {
            replica.hear(&coded)?;
        }
        (other, _) => bail!("a demo sends no {other:?} here"),
    }
    Ok(())
}
