//! Rounds on the page: the countdown, the score board, the result, and the next round.

use anyhow::Result;
use jostle_tests::runner::Stage;
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;

/// A text on the page, trimmed.
async fn text(tab: &Tab, id: &str) -> Result<String> {
    tab.eval(&format!("document.getElementById('{id}').textContent.trim()")).await
}

/// Nobody defends: the ball flies to the right, and the right side loses its five lives.
pub async fn a_round_is_counted_down_played_and_won(stage: Arc<Stage>) -> Result<()> {
    let ada = stage.play("pong", Screen::SMALL).await?;
    assert_eq!(text(&ada, "round-task").await?, "Waiting for players: 1 of 2");
    let bob = stage.play("pong", Screen::PHONE).await?;
    for tab in [&ada, &bob] {
        tab.until_true("/^[123]$/.test(document.getElementById('round-large').textContent)")
            .await?;
        assert_eq!(text(tab, "round-task").await?, "Keep the ball out of your side");
        tab.until_true("document.getElementById('round-large').hidden").await?;
        // Both sides, with an emblem each, and their lives.
        tab.until_true("document.querySelectorAll('#sides li').length === 2").await?;
        let emblems =
            "[...document.querySelectorAll('#sides i')].map(i => i.dataset.emblem).join()";
        assert_eq!(tab.eval::<String>(emblems).await?, "0,1");
    }
    let lives =
        "[...document.querySelectorAll('#sides .lives')].map(l => l.textContent.length).join()";
    ada.until_true(&format!("{lives} === '5,3'")).await?;
    for (tab, title) in [(&ada, "Left won!"), (&bob, "Left won")] {
        tab.until_true("!document.getElementById('result').hidden").await?;
        assert_eq!(text(tab, "result-title").await?, title);
        assert_eq!(text(tab, "round-said").await?, title, "for screen readers");
        let inside = "(() => { const r = document.getElementById('result').getBoundingClientRect(); \
                      return r.left >= 0 && r.right <= innerWidth && r.top >= 0 && r.bottom <= innerHeight; })()";
        assert!(tab.eval::<bool>(inside).await?, "the result is on the screen");
    }
    ada.until_true(&format!("document.getElementById('result').hidden && {lives} === '5,5'")).await
}
