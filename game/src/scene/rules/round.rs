//! Rounds and teams in a scene file.

use super::names::{self, COLORS, Names, POINTS_MAX, SENTENCE_CHARS_MAX};
use crate::scene::field::{POSITION, Range, SECONDS};
use crate::scene::limits::SEATS_MAX;
use crate::scene::table::{Field, Table};
use glam::Vec2;

const SPAWNS_MAX: usize = 64;
const LIVES_MAX: u32 = 1000;
const SEATS: u32 = SEATS_MAX as u32;

/// Settings of a round. Times are in ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundSpec {
    /// The sentence that players see. Label: Task.
    pub task: String,
    /// Length of a round. Label: Time, seconds.
    pub time: Option<u32>,
    /// When the time is up, the most points win and ties are shared, or all lose, or all win. Where there are lives,
    /// this applies only to sides that have some left. Label: When the time is up.
    pub at_time: AtTime,
    /// The first side to reach this many points wins. Label: First to.
    pub goal: Option<i32>,
    /// The time that the others have to reach the goal after the first side, which has won. They get no more points once
    /// they are there. Default: the round ends with the first. Label: Time for the others, seconds.
    pub finish: Option<u32>,
    /// Number of lives of each side. A side that has lost them all is out: it gets no more points or lives, it cannot
    /// win, and its heroes do not come back. Of two or more sides, the last one left wins; a side that plays alone
    /// loses. Label: Lives.
    pub lives: Option<i32>,
    /// Minimum number of players; until they have joined, everybody warms up and nothing counts. Label: Players needed,
    /// for experts.
    pub players_min: u16,
    /// Time from the placing of the bodies to the start, during which nothing moves. Label: Countdown, seconds, for
    /// experts.
    pub countdown: u32,
    /// Time between the end of a round and the start of the next. Label: Pause between rounds, for experts.
    pub pause: u32,
    /// Points required for one, two and three stars, in ascending order, when one side plays alone.
    pub stars: Option<[i32; 3]>,
    /// With `"next"`, layouts differ from round to round. Label: Layouts of the next round, for experts.
    #[doc(alias = "seed")]
    pub new_layouts: bool,
    /// Number of players up to which bots take part until people join. Label: Players, bots included.
    pub fill: u16,
    /// Number of seats in a game that one player plays alone in the page, of which bots take all but one. Default:
    /// as `fill`. Label: Seats when alone.
    pub alone: u16,
}

impl RoundSpec {
    /// Whether a side with this score has finished, while others may still be on their way.
    pub fn is_finished(&self, score: i32) -> bool {
        self.finish.is_some() && self.goal.is_some_and(|goal| score >= goal)
    }
}

/// Outcome of a round when its time is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtTime {
    /// The side with the most points wins; ties are shared.
    Score,
    /// All players lose the round.
    Lose,
    /// All players win the round.
    Win,
}

/// A team in a scene whose rounds are played between teams.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamSpec {
    /// Name, which nothing else may have.
    pub name: String,
    /// Colour from the players' palette. Default: its place in the file.
    pub color: u8,
    /// Where its heroes appear. Default: the hero's.
    pub spawns: Vec<Vec2>,
    /// The only axis along which its heroes move. Default: the hero's.
    pub lane: Option<LaneAxis>,
    /// Maximum number of players in the team.
    #[doc(alias = "players")]
    pub players_max: u16,
}

/// The only axis along which a hero moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaneAxis {
    /// Heroes move left and right.
    X,
    /// Heroes move up and down.
    Y,
}

const LANES: [(&str, LaneAxis); 2] = [("x", LaneAxis::X), ("y", LaneAxis::Y)];

/// Reads `[round]`.
pub(super) fn round(table: &Table) -> RoundSpec {
    let at_time = [("score", AtTime::Score), ("lose", AtTime::Lose), ("win", AtTime::Win)];
    let goal = table.get("goal");
    let task = table.get("task").given(|task| task.text(SENTENCE_CHARS_MAX));
    let round = RoundSpec {
        task: task.unwrap_or_default(),
        time: table.get("time").given(|time| time.ticks(60.0, Range::from(1.0, 3600.0))),
        at_time: table.get("at_time").choice_or_first(&at_time),
        goal: goal.given(|goal| goal.whole(1, 1..=POINTS_MAX as u32) as i32),
        finish: table.get("finish").given(|finish| finish_time(finish, &goal)),
        lives: table.get("lives").given(|lives| lives.whole(1, 1..=LIVES_MAX) as i32),
        stars: table.get("stars").given(stars),
        players_min: table.get("players_min").whole(1, 1..=SEATS) as u16,
        countdown: table.get("countdown").ticks(3.0, SECONDS),
        pause: table.get("pause").ticks(6.0, SECONDS),
        new_layouts: table.get("seed").choice_or_first(&[("same", false), ("next", true)]),
        fill: table.get("fill").whole(0, 0..=SEATS) as u16,
        alone: 0,
    };
    let alone = table.get("alone").whole(u32::from(round.fill), 0..=SEATS) as u16;
    RoundSpec { alone, ..round }
}

fn finish_time(field: &Field, goal: &Field) -> u32 {
    if !goal.is_given() {
        field.refuse("nothing: there is no goal to reach");
    }
    field.ticks(30.0, SECONDS)
}

fn stars(field: &Field) -> [i32; 3] {
    let points = |field: &Field, base: i32| field.whole(base as u32, 0..=POINTS_MAX as u32) as i32;
    let stars = field.array([0; 3], || "three numbers of points".to_owned(), points);
    if !stars.is_sorted() {
        field.refuse("three numbers of points, the least first");
    }
    stars
}

/// Reads one entry of `teams`.
pub(super) fn team(table: &Table, names: &Names) -> TeamSpec {
    let name = names::name(table);
    let place = names.teams.iter().position(|known| *known == name).unwrap_or(0);
    TeamSpec {
        name,
        color: table.get("color").whole(place as u32, 0..=COLORS - 1) as u8,
        spawns: points(&table.get("spawns")),
        lane: lane(table),
        players_max: table.get("players").whole(SEATS, 1..=SEATS) as u16,
    }
}

/// Reads `lane` of a team or of the hero.
pub(in crate::scene) fn lane(table: &Table) -> Option<LaneAxis> {
    table.get("lane").choice(&LANES)
}

fn points(field: &Field) -> Vec<Vec2> {
    let items = field.some_items(1..=SPAWNS_MAX, &format!("1 to {SPAWNS_MAX} points [x, y]"));
    items.iter().map(|item| item.vector(Vec2::ZERO, POSITION)).collect()
}
