//! The sling in a scene file.

use super::bodies::Placed;
use super::field::{Range, SECONDS};
use super::rules::{Condition, Names, POINTS_MAX};
use super::table::Table;
use super::tools::Tools;
use glam::Vec2;
use jostle_sim::Motion;

const PULL: Range = Range::from(1.0, 1.0e3);
const SPEED: Range = Range::from(0.1, 100.0);
const SHOTS_MAX: u32 = 255;

/// A sling, whose ball players pull back and release. Times are in ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlingSpec {
    /// The dynamic body that it shoots from that body's starting position.
    pub ball: usize,
    /// How far the ball can be pulled, and how close to it a pull must begin.
    pub pull: f32,
    /// Speed per unit of pull, in the opposite direction. A pull shorter than 1 does not shoot.
    pub speed: f32,
    /// Number of shots in a round.
    pub shots: u8,
    /// A shot is over when this holds, but not before its third tick. Default: never.
    pub over: Option<Condition>,
    /// A shot is over after this time in any case.
    pub over_time: u32,
    /// Points that the winners get for each shot left.
    pub spare: i32,
}

impl SlingSpec {
    /// The velocity with which a pulled ball is launched, given its offset from the start; `None` if the pull is too
    /// short to be intentional.
    pub fn launch(&self, pull: Vec2) -> Option<Vec2> {
        const MEANT: f32 = 1.0;
        (pull.length() >= MEANT).then(|| pull * -self.speed)
    }
}

/// Reads `[sling]`; `None` if the file has no such table.
pub(super) fn sling(
    root: &Table,
    tools: Tools,
    bodies: &[Placed],
    names: &Names,
) -> Option<SlingSpec> {
    let field = root.get("sling");
    match (field.is_given(), tools.contains(Tools::SLING)) {
        (false, true) => field.refuse("a table [sling] for the tool sling"),
        (true, false) => field.refuse("nothing without \"sling\" among the tools"),
        _ => {}
    }
    field.given(|field| field.table(|table| read_sling(table, bodies, names)))
}

fn read_sling(table: &Table, bodies: &[Placed], names: &Names) -> SlingSpec {
    let field = table.need("ball", "the name of a body");
    let ball = names.body(&field).unwrap_or(0);
    if bodies.get(ball).is_some_and(|body| body.def.motion != Motion::Dynamic) {
        field.refuse("the name of a dynamic body");
    }
    SlingSpec {
        ball,
        pull: table.get("pull").number(20.0, PULL),
        speed: table.get("speed").number(5.0, SPEED),
        shots: table.get("shots").whole(5, 1..=SHOTS_MAX) as u8,
        over: table.get("over").given(|over| names.any_condition(over)),
        over_time: table.get("over_time").ticks(10.0, SECONDS).max(1),
        spare: table.get("spare").signed(0, POINTS_MAX),
    }
}
