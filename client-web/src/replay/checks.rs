//! The ticks compared with their recorded hashes, and the first one that differed. In spare time, a second game runs
//! through the whole replay ahead of the displayed one.

use super::chapters::Chapters;
use jostle_protocol::replay::{Block, Replay};
use jostle_room::playback::Moment;
use jostle_room::{Playback, Played};
use std::sync::Arc;

/// Results of comparing a replay's hashes.
pub struct Checks {
    first: u32,
    last: u32,
    /// Ticks compared so far, as ascending inclusive ranges that do not touch.
    pub ranges: Vec<[u32; 2]>,
    /// The first known tick whose hash differs from the recorded one.
    pub differs_at: Option<u32>,
    /// The second game, present until it reaches the end.
    ahead: Option<Box<Ahead>>,
}

struct Ahead {
    moment: Moment,
    block: Option<Block>,
}

impl Checks {
    /// Creates empty results for a playback at its beginning.
    pub fn new(playback: &Playback) -> Checks {
        let replay = playback.replay();
        let ahead = Ahead { moment: playback.moment().clone(), block: None };
        Checks {
            first: replay.first_tick(),
            last: replay.last_tick(),
            ranges: Vec::new(),
            differs_at: None,
            ahead: Some(Box::new(ahead)),
        }
    }

    /// Records a tick that was played and compared.
    pub fn note(&mut self, played: Played) {
        let Played { tick, agrees } = played;
        if !agrees && self.differs_at.is_none_or(|known| tick < known) {
            self.differs_at = Some(tick);
        }
        // The first range that could contain the tick or be extended by it.
        let at = self.ranges.partition_point(|range| range[1] + 1 < tick);
        match self.ranges.get_mut(at) {
            Some(range) if range[0] <= tick + 1 => {
                range[0] = range[0].min(tick);
                range[1] = range[1].max(tick);
                let [_, end] = *range;
                if self.ranges.get(at + 1).is_some_and(|next| next[0] == end + 1) {
                    let [_, end] = self.ranges.remove(at + 1);
                    self.ranges[at][1] = end;
                }
            }
            _ => self.ranges.insert(at, [tick, tick]),
        }
    }

    /// Continues through the replay as long as `more` returns `true`.
    pub(super) fn run(
        &mut self,
        playback: &mut Playback,
        chapters: &mut Chapters,
        mut more: impl FnMut() -> bool,
    ) {
        let replay = Arc::clone(playback.replay());
        while self.ahead.is_some() && more() {
            let Some(ahead) = &mut self.ahead else { return };
            match ahead.step(&replay, chapters) {
                Some(played) => {
                    playback.learn(&ahead.moment);
                    self.note(played);
                }
                None => self.ahead = None,
            }
        }
    }

    /// The last tick up to which all hashes were compared and matched.
    pub fn agrees_until(&self) -> u32 {
        let compared = self.ranges.first().filter(|range| range[0] <= self.first + 1);
        let until = compared.map_or(self.first, |range| range[1]);
        self.differs_at.map_or(until, |tick| until.min(tick - 1))
    }

    /// The number of ticks compared so far.
    pub fn count(&self) -> u32 {
        self.ranges.iter().map(|[from, to]| to - from + 1).sum()
    }

    /// Whether all ticks of the replay were compared and matched.
    pub fn all_equal(&self) -> bool {
        self.agrees_until() == self.last && self.last > self.first
    }
}

impl Ahead {
    /// Plays the next tick; `None` at the end or if the replay cannot continue.
    fn step(&mut self, replay: &Replay, chapters: &mut Chapters) -> Option<Played> {
        let next = self.moment.game.tick_count() + 1;
        if self.block.as_ref().is_none_or(|block| block.last() < next) {
            self.block = replay.block_with(next);
            chapters.scan(self.block.as_ref()?);
        }
        let played = self.moment.step(self.block.as_ref()?, &mut |_, _| {}).ok()?;
        chapters.note(played.tick, &self.moment.game);
        Some(played)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checks(last: u32) -> Checks {
        Checks { first: 0, last, ranges: Vec::new(), differs_at: None, ahead: None }
    }

    #[test]
    fn ranges_grow_and_join_in_any_order() {
        let mut rng = jostle_sim::Rng::new(1, 1);
        let mut ticks: Vec<u32> = (1..=200).collect();
        for place in (1..ticks.len()).rev() {
            ticks.swap(place, rng.below(place as u32 + 1) as usize);
        }
        let mut checks = checks(200);
        for (count, &tick) in (1..).zip(&ticks) {
            checks.note(Played { tick, agrees: true });
            checks.note(Played { tick, agrees: true });
            assert_eq!(checks.count(), count);
            assert!(checks.ranges.windows(2).all(|pair| pair[0][1] + 1 < pair[1][0]));
            let until = (1..).find(|tick| !ticks[..count as usize].contains(tick));
            assert_eq!(Some(checks.agrees_until() + 1), until);
        }
        assert!(checks.all_equal());
    }

    #[test]
    fn the_first_difference_stays() {
        let mut checks = checks(9);
        for tick in [7, 8, 1, 2, 3, 4, 5, 6, 7, 8, 9] {
            checks.note(Played { tick, agrees: tick != 8 && tick != 4 });
        }
        assert_eq!(checks.differs_at, Some(4));
        assert_eq!(checks.agrees_until(), 3);
        assert!(!checks.all_equal());
    }
}
