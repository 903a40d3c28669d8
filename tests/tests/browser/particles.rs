//! Compares the page's particles with those in natively played games.

use crate::streams::{TICKS, play, scenes};
use anyhow::{Context, Result, ensure};
use jostle_tests::runner::Stage;
use jostle_tests::tab::Screen;
use std::sync::Arc;

pub async fn the_page_has_the_particles_of_the_game(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/", Screen::SMALL).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    for scene in scenes()? {
        for client in play(&scene)? {
            let received = serde_json::to_string(&client.recording)?;
            let source = serde_json::to_string(&client.scene)?;
            let call =
                format!("window.jostle.particle_digests({source}, new Uint8Array({received}))");
            let answer = tab.eval::<String>(&call).await?;
            let digests: Vec<(u32, String)> =
                serde_json::from_str(&answer).with_context(|| answer.clone())?;
            let digests = digests.into_iter().map(|(tick, digits)| {
                Ok((tick, u64::from_str_radix(&digits, 16).context("digits")?))
            });
            let compared = client.compare(&digests.collect::<Result<Vec<_>>>()?)?;
            let all = (TICKS - client.first + 1) as usize;
            ensure!(compared + 13 >= all, "{}: {compared} of {all} ticks", scene.title);
        }
    }
    Ok(())
}
