//! The page's view of a round, derived from a snapshot.

use crate::language::{fill, say};
use crate::page::strings;
use crate::world::replica::listener::LATE_S;
use crate::world::replica::moments::race::{self, Race};
use jostle_game::scene::{AtTime, Each, RoundSpec};
use jostle_game::{RoundInfo, RoundPhase, Scene, Seat, Side, SideInfo};
use jostle_protocol::PlayerState;
use jostle_sim::TICKS_PER_SECOND;
use jostle_sim::short_sort::sort_few;
use std::cmp::Reverse;

/// How long the page announces that a round has begun, ticks.
const GO_TICKS: f64 = TICKS_PER_SECOND as f64;
/// How long a new task is shown in large type, ticks.
const TASK_TICKS: f64 = 8.0 * TICKS_PER_SECOND as f64;
/// Maximum number of lives shown as individual hearts; more are shown as a count.
pub const LIVES_SHOWN_MAX: i32 = 5;

/// Everything that the page shows about a round.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RoundView {
    /// Minutes and seconds left; empty without a time limit.
    pub clock: String,
    /// Whether the round is in its last ten seconds.
    pub is_late: bool,
    /// The current task, or what the round is waiting for.
    pub task: String,
    /// Whether the task is new.
    pub is_task_new: bool,
    /// Completed and total steps of an order that all players share.
    pub progress: Option<(usize, usize)>,
    /// The sides on the scoreboard with their points.
    pub sides: Vec<SideView>,
    /// Whether the player can change teams.
    pub switches: bool,
    /// The countdown in the middle of the picture, or the last seconds.
    pub large: String,
    /// The result, once the round is over.
    pub result: Option<ResultView>,
    /// Announcement for screen readers; changes only when something happens.
    pub spoken: String,
}

/// A side on the scoreboard.
#[derive(Clone, Debug, PartialEq)]
pub struct SideView {
    pub side: Side,
    pub name: String,
    /// Colour index in the players' palette.
    pub color: u8,
    /// Points, if the scene counts them.
    pub score: Option<i32>,
    pub goal: Option<i32>,
    /// Lives, if the scene counts them.
    pub lives: Option<i32>,
    /// Completed and total steps of an order, for this side or, on a team, for the player.
    pub progress: Option<(usize, usize)>,
    /// The time to the finish of a race, if the side has reached it.
    pub time: Option<String>,
    /// Whether the player belongs to this side.
    pub is_own: bool,
    /// Whether the side can still win.
    pub is_in: bool,
}

/// The result of a round.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultView {
    pub title: String,
    /// Who won, if the title only says whether the player did.
    pub detail: String,
    /// Whether the player won or lost; `None` for a draw and for a spectator.
    pub own_won: Option<bool>,
    /// Number of sides that won.
    pub winners: usize,
    /// Stars out of three, if the scene awards them.
    pub stars: Option<usize>,
    /// All sides, best first.
    pub sides: Vec<SideView>,
    /// Seconds until the next round.
    pub next_s: u32,
    /// Whether the player wants to continue and is waiting for others.
    pub goes_on: bool,
}

/// The inputs to a [`RoundView`].
#[derive(Clone, Copy)]
pub struct RoundContext<'a> {
    pub scene: &'a Scene,
    pub round: &'a RoundInfo,
    pub players: &'a [PlayerState],
    pub own: Seat,
    /// The tick on display.
    pub tick: f64,
    /// The race, in a scene with laps.
    pub race: Option<&'a Race>,
}

impl RoundContext<'_> {
    /// The result of a round that is over.
    pub fn result_view(&self) -> Option<ResultView> {
        let ticks = (self.tick - f64::from(self.round.since)).max(0.0);
        Some(self.result(self.scene.rules.round.as_ref()?, ticks))
    }

    /// Derives the view; `None` in a scene without rounds.
    pub fn view(&self) -> Option<RoundView> {
        let spec = self.scene.rules.round.as_ref()?;
        let ticks = (self.tick - f64::from(self.round.since)).max(0.0);
        let is_over = self.round.phase == RoundPhase::Over;
        let (clock, is_late) = self.clock(spec, ticks);
        Some(RoundView {
            clock,
            is_late,
            task: self.task(spec),
            is_task_new: match self.round.phase {
                RoundPhase::Running => ticks < TASK_TICKS,
                phase => phase != RoundPhase::Over,
            },
            progress: self.progress(None),
            switches: self.round.teams.len() > 1 && self.round.player(self.own).is_some(),
            sides: self.board(),
            large: self.large(spec, ticks),
            result: is_over.then(|| self.result(spec, ticks)),
            spoken: self.spoken(spec),
        })
    }

    fn clock(&self, spec: &RoundSpec, ticks: f64) -> (String, bool) {
        let left = match self.round.phase {
            RoundPhase::Running => self.left(spec, ticks),
            RoundPhase::Over => None,
            RoundPhase::Waiting | RoundPhase::Countdown => spec.time.map(f64::from),
        };
        let Some(seconds) = left.map(seconds_of) else { return Default::default() };
        (format!("{}:{:02}", seconds / 60, seconds % 60), seconds <= LATE_S)
    }

    /// The rest of a running round, ticks.
    fn left(&self, spec: &RoundSpec, ticks: f64) -> Option<f64> {
        race::round_length(spec, self.race).map(|length| f64::from(length) - ticks)
    }

    fn task(&self, spec: &RoundSpec) -> String {
        let (count, wanted) = (self.players.len(), usize::from(spec.players_min));
        match self.round.phase {
            RoundPhase::Waiting if count < wanted => fill(
                "Waiting for players: {count} of {wanted}. Send the link to a friend",
                &[("count", &count.to_string()), ("wanted", &wanted.to_string())],
            ),
            _ => say(&spec.task).to_owned(),
        }
    }

    fn large(&self, spec: &RoundSpec, ticks: f64) -> String {
        match self.round.phase {
            RoundPhase::Countdown => {
                seconds_of(f64::from(spec.countdown) - ticks).max(1).to_string()
            }
            RoundPhase::Running if ticks < GO_TICKS && spec.countdown > 0 => say("Go!").to_owned(),
            RoundPhase::Running => {
                let late = self
                    .left(spec, ticks)
                    .map(seconds_of)
                    .filter(|left| (1..=LATE_S).contains(left));
                late.map_or_else(String::new, |left| left.to_string())
            }
            _ => String::new(),
        }
    }

    /// The sides on the scoreboard: the teams, or only the player in a scene without teams, because the list of players
    /// shows the others.
    fn board(&self) -> Vec<SideView> {
        let teams = (0..).zip(&self.round.teams);
        // The scoreboard shows both of two teams, even an empty one.
        let are_two = self.round.teams.len() == 2;
        let counts =
            |&(team, info): &(u8, &SideInfo)| are_two || info.is_in || self.has_players(team);
        let mut sides: Vec<SideView> =
            teams.filter(counts).map(|(team, info)| self.side(Side::Team(team), *info)).collect();
        if self.round.teams.is_empty()
            && let Some(player) = self.round.player(self.own)
        {
            sides.push(self.side(Side::Player(self.own), player.side));
        }
        sides
    }

    fn has_players(&self, team: u8) -> bool {
        self.round.players.iter().any(|player| player.team == Some(team))
    }

    /// A side of the round; `None` for one that is not in it.
    pub fn side_view(&self, side: Side) -> Option<SideView> {
        Some(self.side(side, self.round.side(side)?))
    }

    fn side(&self, side: Side, info: SideInfo) -> SideView {
        let player = |seat| self.players.iter().find(|player| player.seat == seat);
        let (name, color) = match side {
            Side::Team(team) => {
                let spec = self.scene.rules.teams.get(usize::from(team));
                spec.map_or_else(Default::default, |spec| (capital(say(&spec.name)), spec.color))
            }
            Side::Player(seat) => {
                let look = player(seat).map(|player| &player.appearance);
                look.map_or_else(Default::default, |look| (look.name.to_string(), look.color))
            }
        };
        SideView {
            side,
            name,
            color,
            score: self.scene.counts_points().then_some(info.score),
            goal: self.scene.rules.round.as_ref().and_then(|round| round.goal),
            lives: self.scene.rules.lives().map(|_| info.lives),
            progress: self.progress(Some(side)),
            time: self.finish(side).map(|ticks| strings::clock(f64::from(ticks), true)),
            is_own: self.round.side_of(self.own) == side,
            // Someone who joins a team during the round is in it, unless the team is out.
            is_in: info.is_in
                || self.scene.rules.lives().is_none()
                    && matches!(side, Side::Team(team) if self.has_players(team)),
        }
    }

    /// Ticks from the start of a race to a side's finish.
    fn finish(&self, side: Side) -> Option<u32> {
        let Side::Player(seat) = side else { return None };
        self.race?.finish(seat)
    }

    /// Completed and total steps of the first order in which this side makes progress. `None` stands for all players
    /// together.
    fn progress(&self, side: Option<Side>) -> Option<(usize, usize)> {
        let own = Side::Player(self.own);
        let signals = (0..).zip(&self.scene.rules.signals);
        let mut orders = signals.filter_map(|(index, signal)| Some((index, signal.order()?)));
        orders.find_map(|(index, order)| {
            let walker = match (order.each, side) {
                (Each::All, None) => None,
                (Each::Side, Some(_)) => side,
                // On a team's entry, only the player's progress is shown.
                (Each::Player, Some(_)) if self.round.side_of(self.own) == side? => Some(own),
                (Each::Player, Some(Side::Player(_))) => side,
                _ => return None,
            };
            Some((usize::from(self.round.steps(index, walker)), order.steps.len()))
        })
    }

    fn result(&self, spec: &RoundSpec, ticks: f64) -> ResultView {
        let sides = match self.round.teams.is_empty() {
            false => self.board(),
            true => {
                let players = self.round.players.iter();
                players.map(|player| self.side(Side::Player(player.seat), player.side)).collect()
            }
        };
        let mut sides: Vec<SideView> = sides;
        let won = |side: &SideView| self.round.winners.contains(&side.side);
        let early = |side: &SideView| self.finish(side.side).map(Reverse);
        let weight = |side: &SideView| (won(side), side.score, side.lives, early(side));
        sort_few(&mut sides, |one, other| weight(one) > weight(other));
        let stars = spec.stars.filter(|_| sides.len() == 1 && won(&sides[0])).map(|stars| {
            let points = sides[0].score.unwrap_or_default();
            stars.iter().filter(|&&star| points >= star).count()
        });
        let next_s = seconds_of(f64::from(spec.pause) - ticks);
        let goes_on = self.round.player(self.own).is_some_and(|player| player.goes_on);
        let winners = sides.iter().filter(|side| won(side)).count();
        let own = sides.iter().find(|side| side.is_own);
        let own_won = own.filter(|_| winners == 1).map(won);
        let (title, detail) = self.title(spec, &sides);
        ResultView { title, detail, own_won, winners, stars, sides, next_s, goes_on }
    }

    /// The title of the result, and a line below it that names the winner.
    fn title(&self, spec: &RoundSpec, sides: &[SideView]) -> (String, String) {
        let winner = |side: &SideView| fill("{side} won", &[("side", &side.name)]);
        let mut winners = sides.iter().filter(|side| self.round.winners.contains(&side.side));
        match (winners.next(), winners.next()) {
            (Some(side), None) if sides.len() > 1 && sides.iter().any(|side| side.is_own) => {
                let title = if side.is_own { say("You won!") } else { say("You lost") };
                let is_named = !(side.is_own && matches!(side.side, Side::Player(_)));
                (title.to_owned(), if is_named { winner(side) } else { String::new() })
            }
            _ => (self.plain_title(spec, sides), String::new()),
        }
    }

    fn plain_title(&self, spec: &RoundSpec, sides: &[SideView]) -> String {
        let winners: Vec<&SideView> =
            sides.iter().filter(|side| self.round.winners.contains(&side.side)).collect();
        let is_time = spec.at_time == AtTime::Lose;
        match (&winners[..], sides.len()) {
            ([], 1) if sides[0].lives == Some(0) => say("Out of lives").to_owned(),
            ([], 1) if self.round.sling.is_some_and(|sling| sling.shots == 0) => {
                say("Out of shots").to_owned()
            }
            ([], 1) if is_time => say("Time is up").to_owned(),
            ([], 1) => say("Lost").to_owned(),
            ([], _) => say("Nobody won").to_owned(),
            ([_], 1) => say("Done!").to_owned(),
            ([side], _) => fill("{side} won", &[("side", &side.name)]),
            (several, all) if several.len() == all => say("A draw").to_owned(),
            (several, _) => {
                let names = several.iter().map(|side| side.name.clone());
                let names = names.reduce(|first, next| {
                    fill("{first} and {next}", &[("first", &first), ("next", &next)])
                });
                fill("{several} won", &[("several", &names.unwrap_or_default())])
            }
        }
    }

    fn spoken(&self, spec: &RoundSpec) -> String {
        match self.round.phase {
            RoundPhase::Waiting => self.task(spec),
            RoundPhase::Countdown => fill("A round begins. {task}", &[("task", say(&spec.task))]),
            RoundPhase::Over => {
                let ResultView { title, detail, .. } = self.result(spec, 0.0);
                if detail.is_empty() { title } else { title + " \u{2013} " + &detail }
            }
            RoundPhase::Running => {
                let sides = self.board().into_iter().map(|side| {
                    let score = side.score.map_or_else(String::new, |score| match score {
                        1 => say(" 1 point").to_owned(),
                        _ => fill(" {count} points", &[("count", &score.to_string())]),
                    });
                    let lives = side.lives.map_or_else(String::new, |lives| match lives {
                        1 => say(" 1 life").to_owned(),
                        _ => fill(" {count} lives", &[("count", &lives.to_string())]),
                    });
                    format!("{}{score}{lives}", side.name)
                });
                sides.collect::<Vec<_>>().join(", ")
            }
        }
    }
}

/// The remaining seconds, rounded up.
fn seconds_of(ticks: f64) -> u32 {
    (ticks / f64::from(TICKS_PER_SECOND)).ceil().max(0.0) as u32
}

/// A name with its first letter capitalised.
pub fn capital(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

#[cfg(test)]
mod tests;
