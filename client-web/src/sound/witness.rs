//! The voices of a replay, for tests. They are the same natively and in the page.

use super::mixer::{Ear, Mixer, Voice};
use crate::replay::player::ReplayPlayer;
use jostle_sim::TICKS_PER_SECOND;

/// Size of the listener's picture, pixels.
const PIXELS: [u32; 2] = [1280, 720];

/// The voices from the first seconds of a replay, with their start times in seconds, at one frame per tick.
pub fn voices_of(mut player: ReplayPlayer, seconds: u32) -> Vec<(f64, Voice)> {
    let ear = Ear::of(&player.still_view(PIXELS, 0));
    let mut mixer = Mixer::default();
    let mut voices = Vec::new();
    player.play();
    for tick in 0..seconds * TICKS_PER_SECOND {
        let now_s = f64::from(tick) / f64::from(TICKS_PER_SECOND);
        player.advance(1.0 / f64::from(TICKS_PER_SECOND), || true);
        while let Some(cue) = player.next_cue() {
            mixer.hear(cue);
        }
        voices.extend(mixer.frame(now_s, &ear).into_iter().map(|voice| (now_s, voice)));
    }
    voices
}
