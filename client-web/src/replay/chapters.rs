//! A replay's events by tick, for marks on its timeline.

use jostle_game::{Event, Game, RoundInfo, RoundPhase, Side};
use jostle_protocol::replay::{Block, Change};

/// Maximum number of marks for game events and, separately, for all other events; later ones are omitted.
const CHAPTERS_MAX: usize = 4096;

/// Goals within this many ticks of each other, such as points for holding a hill, share a mark.
const GOALS_APART_TICKS: u32 = 90;

/// A kind of event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chapter {
    Join,
    Leave,
    Burst,
    Round,
    /// A side gains points, or loses points or a life.
    Goal,
    /// A round ends.
    Result,
}

impl Chapter {
    /// Whether this is an important moment of the game.
    pub fn is_of_game(self) -> bool {
        matches!(self, Chapter::Round | Chapter::Goal | Chapter::Result)
    }
}

/// The chapters found so far, in the order in which they were found.
#[derive(Clone, Debug, Default)]
pub struct Chapters {
    pub known: Vec<(u32, Chapter)>,
    /// The round in the tick that was examined last.
    round: Option<RoundInfo>,
    /// The tick of the newest goal, whether marked or not.
    goal_tick: Option<u32>,
}

impl Chapters {
    /// Records joins and leaves.
    pub(super) fn scan(&mut self, block: &Block) {
        for (tick, given) in (block.first..).zip(&block.ticks) {
            for change in &given.changes {
                match change {
                    Change::Join(..) => self.add(tick, Chapter::Join),
                    Change::Leave(_) => self.add(tick, Chapter::Leave),
                    Change::Look(..) => {}
                }
            }
        }
    }

    /// Finds bursts, goals, and beginnings and ends of rounds in a tick. Must be called in tick order.
    pub(super) fn note(&mut self, tick: u32, game: &Game) {
        if game.events().iter().any(|event| matches!(event, Event::PackHit { .. })) {
            self.add(tick, Chapter::Burst);
        }
        let round = game.round().filter(|_| game.scene().rules.round.is_some());
        let found = self.round.as_ref().zip(round.as_ref()).and_then(|(a, b)| between(a, b));
        self.round = round;
        match found {
            Some(Chapter::Goal) => self.add_goal(tick),
            Some(chapter) => self.add(tick, chapter),
            None => {}
        }
    }

    fn add_goal(&mut self, tick: u32) {
        if self.goal_tick.is_none_or(|before| tick - before > GOALS_APART_TICKS) {
            self.add(tick, Chapter::Goal);
        }
        self.goal_tick = Some(tick);
    }

    fn add(&mut self, tick: u32, chapter: Chapter) {
        let alike = |&&(_, known): &&(u32, Chapter)| known.is_of_game() == chapter.is_of_game();
        if self.known.iter().filter(alike).count() < CHAPTERS_MAX {
            self.known.push((tick, chapter));
        }
    }
}

/// The round event between two consecutive ticks.
fn between(before: &RoundInfo, now: &RoundInfo) -> Option<Chapter> {
    if before.phase != now.phase {
        return match now.phase {
            RoundPhase::Running => Some(Chapter::Round),
            RoundPhase::Over => Some(Chapter::Result),
            RoundPhase::Waiting | RoundPhase::Countdown => None,
        };
    }
    let teams = (0..).zip(&now.teams).map(|(team, info)| (Side::Team(team), *info));
    let players = now.players.iter().map(|player| (Side::Player(player.seat), player.side));
    let mut sides = teams.chain(players);
    let changed = sides.any(|(side, info)| {
        let earlier = before.side(side);
        earlier.is_some_and(|earlier| (earlier.score, earlier.lives) != (info.score, info.lives))
    });
    (changed && now.phase == RoundPhase::Running).then_some(Chapter::Goal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_quick_succession_have_one_mark() {
        let mut chapters = Chapters::default();
        [10, 70, 130, 221, 300].into_iter().for_each(|tick| chapters.add_goal(tick));
        assert_eq!(chapters.known, [(10, Chapter::Goal), (221, Chapter::Goal)]);
    }

    #[test]
    fn bursts_take_no_marks_from_goals() {
        let mut chapters = Chapters::default();
        (0..=CHAPTERS_MAX as u32).for_each(|tick| chapters.add(tick, Chapter::Burst));
        assert_eq!(chapters.known.len(), CHAPTERS_MAX);
        chapters.add(9000, Chapter::Goal);
        assert_eq!(chapters.known.last(), Some(&(9000, Chapter::Goal)));
    }
}
