//! Sides, which are teams, or individual players if there are no teams.

use crate::input::Seat;
use crate::scene::POINTS_MAX;

/// A side that can win or lose, which is a team, or a player in a scene without teams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// The team with this index in the file.
    Team(u8),
    /// A player without a team.
    Player(Seat),
}

/// A side's standing in the round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SideState {
    pub score: i32,
    /// Lives left; meaningless in a round without lives.
    pub lives: i32,
    /// Whether it takes part, because it had players at the start of the round or is a player who joined later.
    pub plays: bool,
    /// Whether it has lost its last life.
    pub out: bool,
}

impl SideState {
    /// Creates the standing of a side at the start of a round.
    pub fn at_start(lives: Option<i32>, plays: bool) -> SideState {
        SideState { score: 0, lives: lives.unwrap_or(0), plays, out: false }
    }

    /// Whether the side can still win.
    pub fn is_in(&self) -> bool {
        self.plays && !self.out
    }

    pub fn add_score(&mut self, points: i32) {
        self.score = self.score.saturating_add(points);
    }

    pub fn add_lives(&mut self, lives: i32) {
        self.lives = self.lives.saturating_add(lives);
    }

    /// Limits points and lives once all of a tick's changes have been added. Lives given and taken in the same
    /// tick thus cancel out, whichever rule comes first.
    pub fn settle(&mut self) {
        self.score = self.score.clamp(-POINTS_MAX, POINTS_MAX);
        self.lives = self.lives.clamp(0, POINTS_MAX);
    }
}
