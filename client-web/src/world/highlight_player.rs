//! Plays highlights by feeding a second replica the snapshots that the first one received.

use crate::world::replica::highlights::{Highlight, length};
use crate::world::replica::{Eye, Replica};
use jostle_game::{Scene, Seat};
use jostle_sim::TICKS_PER_SECOND;
use std::collections::VecDeque;
use std::sync::Arc;

/// Plays highlights one after another.
pub struct HighlightPlayer {
    /// The replica for the current highlight.
    pub replica: Replica,
    /// The number of the current highlight, counting from 1.
    pub number: usize,
    /// The total number of highlights.
    pub count: usize,
    waiting: VecDeque<Highlight>,
    /// The current highlight's first tick, its length in ticks, and its start time.
    first: u32,
    ticks: u32,
    began_ms: f64,
}

impl HighlightPlayer {
    /// Creates a player that starts at `now_ms`; `None` without highlights.
    pub fn new(
        scene: &Arc<Scene>,
        seat: Seat,
        highlights: Vec<Highlight>,
        now_ms: f64,
    ) -> Option<HighlightPlayer> {
        let count = highlights.len();
        let mut waiting = VecDeque::from(highlights);
        let highlight = waiting.pop_front()?;
        let replica = Replica::without_highlights(Arc::clone(scene), seat);
        let mut player = HighlightPlayer {
            replica,
            number: 0,
            count,
            waiting,
            first: 0,
            ticks: 0,
            began_ms: now_ms,
        };
        player.begin(highlight, now_ms);
        Some(player)
    }

    fn begin(&mut self, highlight: Highlight, now_ms: f64) {
        let scene = Arc::clone(&self.replica.room.scene);
        self.replica = Replica::without_highlights(scene, self.replica.room.seat);
        self.number += 1;
        self.first = highlight.first().map_or(0, |filed| filed.snapshot.tick);
        self.ticks = length(&highlight);
        self.began_ms = now_ms;
        for filed in highlight {
            self.replica.file(filed.snapshot, filed.events);
        }
    }

    /// Advances the display to `now_ms`; `false` after the last highlight.
    pub fn advance(&mut self, now_ms: f64, eye: Eye) -> bool {
        let ticks = |since_ms: f64| (now_ms - since_ms) / 1000.0 * f64::from(TICKS_PER_SECOND);
        if ticks(self.began_ms) > f64::from(self.ticks) {
            let Some(next) = self.waiting.pop_front() else { return false };
            self.begin(next, now_ms);
        }
        self.replica.advance(f64::from(self.first) + ticks(self.began_ms), eye);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::replica::highlights::{AFTER_TICKS, BEFORE_TICKS, Filed};
    use jostle_protocol::Snapshot;

    fn highlight(goal: u32) -> Highlight {
        let filed = |tick| Filed {
            snapshot: Arc::new(Snapshot { tick, ..Snapshot::default() }),
            events: Vec::new(),
        };
        (goal - BEFORE_TICKS..=goal + AFTER_TICKS).map(filed).collect()
    }

    #[test]
    fn highlights_are_shown_one_after_the_other_at_the_speed_of_play() {
        let scene = Scene::built_in().into_iter().find(|scene| scene.name == "arena");
        let scene = Arc::new(scene.expect("a shipped scene"));
        let eye = Eye::default();
        let mut player =
            HighlightPlayer::new(&scene, Seat(0), vec![highlight(600), highlight(1000)], 50.0)
                .expect("two highlights");
        assert!(player.advance(50.0, eye));
        assert_eq!((player.number, player.count, player.replica.room.display), (1, 2, 420.0));
        assert!(player.advance(3050.0, eye));
        assert_eq!((player.number, player.replica.room.display), (1, 600.0), "the goal");
        assert!(player.advance(3600.0, eye));
        assert_eq!((player.number, player.replica.room.display), (2, 820.0));
        assert!(player.advance(7000.0, eye));
        assert!(!player.advance(7200.0, eye), "all was shown");
        assert!(HighlightPlayer::new(&scene, Seat(0), Vec::new(), 0.0).is_none());
    }
}
