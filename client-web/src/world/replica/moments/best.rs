//! Counts what the players did in a round, for the best of the round.

use jostle_game::Seat;

/// Something at which a player was the best of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Best {
    Goals(u32),
    Hits(u32),
    /// Hits that were taken.
    Splashed(u32),
    /// The fastest lap, ticks.
    Lap(u32),
}

/// The deeds of the players of a round.
#[derive(Debug, Default)]
pub struct BestOfRound {
    /// For each seat: goals, hits dealt and hits taken.
    counts: Vec<[u32; 3]>,
}

impl BestOfRound {
    fn count(&mut self, seat: Seat, what: usize) {
        let index = usize::from(seat.0);
        if self.counts.len() <= index {
            self.counts.resize(index + 1, [0; 3]);
        }
        self.counts[index][what] += 1;
    }

    pub fn note_goal(&mut self, by: Seat) {
        self.count(by, 0);
    }

    pub fn note_hit(&mut self, by: Seat, hit: Option<Seat>) {
        self.count(by, 1);
        hit.into_iter().for_each(|hit| self.count(hit, 2));
    }

    /// The best of the round with their figures.
    pub fn best(&self) -> impl Iterator<Item = (Seat, Best)> {
        let most = |what: usize| {
            let counts = self.counts.iter().map(|counts| counts[what]).enumerate();
            let most = counts.reduce(|best, next| if next.1 > best.1 { next } else { best });
            most.filter(|most| most.1 > 0).map(|(seat, count)| (Seat(seat as u16), count))
        };
        let kinds = [Best::Goals as fn(u32) -> Best, Best::Hits, Best::Splashed];
        let counted = (0..).zip(kinds);
        counted.filter_map(move |(what, kind)| most(what).map(|(seat, count)| (seat, kind(count))))
    }
}
