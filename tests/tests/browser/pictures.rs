//! Scenes frozen at a tick: each looks as it did when its golden picture was taken, and its bodies
//! are where the native simulation has them, bit for bit.
//!
//! `JOSTLE_UPDATE_GOLDENS=1` takes the pictures anew; look at them before they are committed.

use anyhow::{Result, bail};
use jostle_tests::picture::Picture;
use jostle_tests::runner::{Stage, artifacts};
use jostle_tests::tab::Screen;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Scene and tick; late enough that much is going on.
const SCENES: [(&str, u32); 5] =
    [("bounds", 90), ("impulse", 300), ("particles", 150), ("emitters", 170), ("arena", 400)];
/// Another version of the software renderer may round differently.
const MEAN_MAX: f64 = 0.5;
const CHANNEL_MAX: u8 = 8;

pub async fn frozen_scenes_look_as_they_did(stage: Arc<Stage>) -> Result<()> {
    let mut problems = Vec::new();
    for (scene, tick) in SCENES {
        let path = format!("/?demo={scene}&seed=7&ticks={tick}&bots=2");
        let tab = stage.visit(&path, Screen::SMALL).await?;
        let state = tab.until("the frozen demo", |s| s.state == "frozen").await?;
        assert_eq!(state.tick, tick, "{scene} stands still at the tick asked for");
        let picture = tab.steady_picture().await?;
        assert!(picture.colors() > 50, "{scene} shows only {} colours", picture.colors());
        if let Err(error) = check(scene, &picture) {
            problems.push(format!("{scene}: {error:#}"));
        }
        stage.clear().await?;
    }
    if !problems.is_empty() {
        bail!("{}", problems.join("\n"));
    }
    Ok(())
}

fn check(scene: &str, picture: &Picture) -> Result<()> {
    let golden_path = goldens().join(format!("{scene}.png"));
    if std::env::var_os("JOSTLE_UPDATE_GOLDENS").is_some_and(|value| value == "1") {
        println!("    took {}", golden_path.display());
        return picture.save(&golden_path);
    }
    let golden = Picture::load(&golden_path)?;
    let difference = picture.compare(&golden, CHANNEL_MAX)?;
    if difference.mean < MEAN_MAX && difference.max <= CHANNEL_MAX {
        return Ok(());
    }
    let seen = artifacts().join(format!("{scene}-seen.png"));
    picture.save(&seen)?;
    picture.difference(&golden).save(&artifacts().join(format!("{scene}-difference.png")))?;
    bail!(
        "mean difference {:.3} (at most {MEAN_MAX}), largest {} (at most {CHANNEL_MAX}), {} pixels \
         beyond; see {}",
        difference.mean,
        difference.max,
        difference.outliers,
        seen.display()
    )
}

fn goldens() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("goldens")
}
