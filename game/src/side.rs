//! Sides: teams, or players where there are no teams.

use crate::input::Seat;
use crate::scene::POINTS_MAX;

/// Who wins and loses: a team, or a player where a scene has no teams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// The team with this place in the file.
    Team(u8),
    /// A player without a team.
    Player(Seat),
}

/// How a side stands in the round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Standing {
    pub score: i32,
    /// Meaningless in a round without lives.
    pub lives: i32,
    /// Whether it takes part: it had players at the start of the round, or is a player who came later.
    pub plays: bool,
    /// Whether it lost its last life.
    pub out: bool,
}

impl Standing {
    /// A side at the start of a round.
    pub fn at_start(lives: Option<i32>, plays: bool) -> Standing {
        Standing { score: 0, lives: lives.unwrap_or(0), plays, out: false }
    }

    /// Whether it can still win.
    pub fn is_in(&self) -> bool {
        self.plays && !self.out
    }

    pub fn add_score(&mut self, points: i32) {
        self.score = self.score.saturating_add(points);
    }

    pub fn add_lives(&mut self, lives: i32) {
        self.lives = self.lives.saturating_add(lives);
    }

    /// Keeps points and lives in their limits once all of a tick were added: lives that were given and
    /// taken in one tick add up, whichever rule comes first.
    pub fn settle(&mut self) {
        self.score = self.score.clamp(-POINTS_MAX, POINTS_MAX);
        self.lives = self.lives.clamp(0, POINTS_MAX);
    }
}
