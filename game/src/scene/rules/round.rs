//! Rounds and teams in a scene file.

use super::known::{POINTS_MAX, SECONDS, SENTENCE_CHARS_MAX, ticks};
use super::names::Names;
use crate::scene::limits::SEATS_MAX;
use crate::scene::table::{Field, POSITION, Range, Table};
use glam::Vec2;

const SPAWNS_MAX: usize = 64;
const COLORS: u32 = 8;
const LIVES_MAX: u32 = 1000;

/// How a round is played. Times are ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundSpec {
    /// What players are to do, one sentence; may be empty.
    pub task: String,
    /// Length of a round.
    pub time: Option<u32>,
    /// What decides when the time is up.
    pub at_time: AtTime,
    /// Points with which a side wins at once.
    pub goal: Option<i32>,
    /// Lives of each side at the start.
    pub lives: Option<i32>,
    /// Players without whom no round begins.
    pub players_min: u16,
    /// From the placing of the bodies to the start.
    pub countdown: u32,
    /// From the end of a round to the next.
    pub pause: u32,
    /// Points of one, two and three stars.
    pub stars: Option<[i32; 3]>,
    /// Whether layouts differ from round to round.
    pub new_layouts: bool,
    /// Seats that bots take until people come.
    pub fill: u16,
}

/// What decides when the time of a round is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtTime {
    /// Most points win, equals share.
    Score,
    /// All players lose the round.
    Lose,
    /// All players win the round.
    Win,
}

/// One of the teams between which a round is played.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamSpec {
    /// Name, unique among the teams.
    pub name: String,
    /// One of the players' colours, 0 to 8.
    pub color: u8,
    /// Where its heroes start, instead of the hero's spawns; may be empty.
    pub spawns: Vec<Vec2>,
    /// The axis that its heroes stay on.
    pub lane: Option<LaneAxis>,
    /// Most players that it takes.
    pub players_max: u16,
}

/// The only axis that a hero moves along.
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
    let given = |field: &Field, default: f32| ticks(field.number(default, SECONDS));
    let task = table.get("task");
    let time = table.get("time");
    let at_time = [("score", AtTime::Score), ("lose", AtTime::Lose), ("win", AtTime::Win)];
    let goal = table.get("goal");
    let lives = table.get("lives");
    let stars = table.get("stars");
    let points = |field: &Field, base: i32| field.whole(base as u32, 0..=POINTS_MAX as u32) as i32;
    RoundSpec {
        task: if task.is_given() { task.text(SENTENCE_CHARS_MAX) } else { String::new() },
        time: time.is_given().then(|| ticks(time.number(60.0, Range::from(1.0, 3600.0)))),
        at_time: table.get("at_time").choice(&at_time).unwrap_or(AtTime::Score),
        goal: goal.is_given().then(|| goal.whole(1, 1..=POINTS_MAX as u32) as i32),
        lives: lives.is_given().then(|| lives.whole(1, 1..=LIVES_MAX) as i32),
        players_min: table.get("players_min").whole(1, 1..=SEATS_MAX as u32) as u16,
        countdown: given(&table.get("countdown"), 3.0),
        pause: given(&table.get("pause"), 6.0),
        stars: stars.is_given().then(|| {
            let stars = stars.array([0; 3], || "three numbers of points".to_owned(), points);
            if stars[0] > stars[1] || stars[1] > stars[2] {
                stars_in_order(table);
            }
            stars
        }),
        new_layouts: table.get("seed").choice(&[("same", false), ("next", true)]).unwrap_or(false),
        fill: table.get("fill").whole(0, 0..=SEATS_MAX as u32) as u16,
    }
}

fn stars_in_order(table: &Table) {
    table.get("stars").refuse("three numbers of points, the least first");
}

/// Reads one entry of `teams`.
pub(super) fn team(table: &Table, names: &Names) -> TeamSpec {
    let name = table.get("name").word().unwrap_or_default().to_owned();
    let place = names.teams.iter().position(|known| *known == name).unwrap_or(0);
    TeamSpec {
        name,
        color: table.get("color").whole(place as u32, 0..=COLORS - 1) as u8,
        spawns: points(&table.get("spawns")),
        lane: lane(table),
        players_max: table.get("players").whole(SEATS_MAX as u32, 1..=SEATS_MAX as u32) as u16,
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
