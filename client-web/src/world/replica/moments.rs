//! Moments of a game that deserve a sign: points, goals, laps, knock-outs, a new leader and the end. They are derived
//! from the rounds and bursts that a replica displays anyway, and a picture shows them as a function of its tick.

mod best;
pub mod race;

use super::room::RoomView;
use crate::sound::cue::Sound;
use crate::view::frame::{FrameConfetti, FramePoints, FrameRoom};
pub use best::{Best, BestOfRound};
use jostle_game::scene::{RuleSpec, To, Trigger, ZoneArea};
use jostle_game::{RoundInfo, RoundPhase, Scene, Seat, Side, SideInfo};
use jostle_sim::{BodyId, TICKS_PER_SECOND, Vec2};
use race::Race;
use std::collections::VecDeque;

/// Maximum number of remembered moments; the oldest are dropped first.
pub const MOMENTS_MAX: usize = 64;
/// How long a banner is shown, ticks.
pub const BANNER_TICKS: f64 = 96.0;
/// Minimum time between moments that hold or shake the picture, ticks: at most three a second.
pub const JOLTS_APART_TICKS: f64 = 20.0;
/// How long the picture shakes, ticks.
const SHAKE_TICKS: f64 = 24.0;
/// How long scored points are visible, ticks.
const POINTS_TICKS: f64 = 66.0;
/// How long confetti falls, ticks.
const CONFETTI_TICKS: f64 = 270.0;
/// Minimum time between two announced leaders, ticks.
const LEADERS_APART_TICKS: f64 = 8.0 * TICKS_PER_SECOND as f64;
/// Points that arrive within this time of a burst or a line belong to it, ticks.
const SOON_TICKS: f64 = 6.0;
/// A round first seen within this time of its start was seen from its start, ticks.
const START_TICKS: f64 = 60.0;

/// The kinds of moments, the most important last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MomentKind {
    /// A dye pack burst on the page's own hero.
    Hit,
    /// Points, as they come every second or with every hit.
    Points,
    Leader,
    Lap,
    LifeLost,
    /// A side can no longer win.
    Out,
    Captured,
    Goal,
    OwnGoal,
    Over,
}

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    pub kind: MomentKind,
    pub tick: f64,
    /// The side that scored, lost a life or won.
    pub side: Option<Side>,
    /// The player who did it, if known.
    pub by: Option<Seat>,
    /// The position, world units.
    pub at: Option<Vec2>,
    /// Points that were scored.
    pub points: i32,
    /// Whether it may hold and shake the picture.
    pub jolts: bool,
}

impl MomentKind {
    /// For how long it holds the picture, ticks, and how far it shakes it, as a share of the view's height.
    fn jolt(self) -> (f64, f32) {
        match self {
            MomentKind::Over => (12.0, 0.016),
            MomentKind::Goal | MomentKind::OwnGoal | MomentKind::Captured => (8.0, 0.014),
            MomentKind::Out => (6.0, 0.012),
            MomentKind::LifeLost => (4.0, 0.008),
            MomentKind::Hit => (0.0, 0.006),
            MomentKind::Points | MomentKind::Leader | MomentKind::Lap => (0.0, 0.0),
        }
    }
}

/// The latest moments of a room, and what is needed to notice the next one.
#[derive(Default)]
pub struct Moments {
    /// Oldest first, at most [`MOMENTS_MAX`].
    pub recent: VecDeque<Moment>,
    /// The leading side, if one side alone leads with points.
    pub leader: Option<Side>,
    /// The deeds of the current or previous round.
    pub bests: BestOfRound,
    /// The current or previous race, in a scene with laps.
    pub race: Option<Race>,
    /// Number of ticks before the current or previous round, if it was seen from its start.
    pub began: Option<u32>,
    /// The latest round that is over, until the next one runs.
    pub end: Option<RoundInfo>,
    /// The tick of the latest snapshot from which the race was noted.
    raced: f64,
    before: Option<RoundInfo>,
    /// The newest burst: its tick, its thrower and its position.
    burst: Option<(f64, Seat, Vec2)>,
    /// The newest line of a rule that scores: its tick, the player, and whether it is an own goal.
    line: Option<(f64, Seat, bool)>,
}

impl Moments {
    /// Notes a dye pack that burst.
    pub fn note_burst(
        &mut self,
        room: &RoomView,
        tick: f64,
        by: Option<Seat>,
        hit: Option<Seat>,
        at: Vec2,
    ) {
        if let Some(by) = by.filter(|_| by != hit) {
            self.burst = Some((tick, by, at));
            if self.is_running() {
                self.bests.note_hit(by, hit);
            }
        }
        if hit == Some(room.seat) {
            self.push(Moment { at: Some(at), by, ..Moment::new(MomentKind::Hit, tick, None) });
        }
    }

    /// Notes the line of a rule that scores for someone.
    pub fn note_line(&mut self, tick: f64, by: Seat, is_own_goal: bool) {
        self.line = Some((tick, by, is_own_goal));
        if !is_own_goal && self.is_running() {
            self.bests.note_goal(by);
        }
    }

    /// Returns whether a round is running. Deeds after its end do not count.
    fn is_running(&self) -> bool {
        self.before.as_ref().is_some_and(|round| round.phase == RoundPhase::Running)
    }

    /// Compares the displayed round with the one displayed before, and returns the sound of what happened.
    pub fn observe(&mut self, room: &RoomView, tick: f64) -> Option<Sound> {
        self.note_race(room, tick);
        let round = room.timeline.at_or_before(tick).and_then(|s| s.round.as_ref())?;
        if self.before.as_ref() == Some(round) {
            return None;
        }
        match round.phase {
            RoundPhase::Over => self.end = Some(round.clone()),
            RoundPhase::Running => {
                self.end = None;
                let is_start = tick - f64::from(round.since) < START_TICKS;
                self.began = self.began.filter(|&at| at == round.since);
                self.began = self.began.or(is_start.then_some(round.since));
            }
            RoundPhase::Waiting | RoundPhase::Countdown => {}
        }
        let before = self.before.replace(round.clone())?;
        let began = before.phase != RoundPhase::Running && round.phase == RoundPhase::Running;
        if began {
            self.leader = None;
            self.bests = BestOfRound::default();
        }
        if before.phase != RoundPhase::Running {
            return None;
        }
        let mut sound = None;
        for (side, now) in sides(round) {
            let Some(then) = before.side(side) else { continue };
            sound = self.note_side(room, tick, side, [then, now]).or(sound);
        }
        let won = round.winners.first().copied();
        if before.winners.is_empty() && (won.is_some() || round.phase == RoundPhase::Over) {
            self.push(Moment::new(MomentKind::Over, tick, won));
        }
        if round.phase == RoundPhase::Over {
            return None;
        }
        self.note_leader(round, tick).or(sound)
    }

    fn note_race(&mut self, room: &RoomView, tick: f64) {
        if self.race.is_none() && self.before.is_none() {
            self.race = Race::of(&room.scene);
        }
        let Some(race) = &mut self.race else { return };
        if tick < self.raced {
            // The display jumped back.
            self.raced = tick - 1.0;
        }
        for snapshot in room.timeline.between(self.raced, tick) {
            snapshot.round.iter().for_each(|round| race.note(round, snapshot.tick));
            self.raced = f64::from(snapshot.tick);
        }
    }

    /// The best of the current or previous round. Deeds are counted only in a round that was seen from its start.
    pub fn best(&self) -> impl Iterator<Item = (Seat, Best)> {
        let lap = self.race.as_ref().and_then(Race::fastest_lap);
        let deeds = self.began.is_some().then(|| self.bests.best());
        let lap = lap.map(|(ticks, by)| (by, Best::Lap(ticks)));
        lap.into_iter().chain(deeds.into_iter().flatten())
    }

    fn note_side(
        &mut self,
        room: &RoomView,
        tick: f64,
        side: Side,
        [then, now]: [SideInfo; 2],
    ) -> Option<Sound> {
        if now.score > then.score {
            self.note_points(room, tick, side, now.score - then.score);
        }
        let is_running = self.before.as_ref().is_some_and(|now| now.phase == RoundPhase::Running);
        let kind = match now.lives < then.lives {
            _ if then.is_in && !now.is_in && is_running => MomentKind::Out,
            true if is_running => MomentKind::LifeLost,
            _ => return None,
        };
        self.push(Moment { at: hero_of(room, side), ..Moment::new(kind, tick, Some(side)) });
        Some(Sound::Out)
    }

    fn note_points(&mut self, room: &RoomView, tick: f64, side: Side, points: i32) {
        let is_soon = |at: f64| (tick - at).abs() <= SOON_TICKS;
        let round = room.round();
        let is_of_side = |seat| round.is_some_and(|round| round.side_of(seat) == side);
        let burst = self.burst.filter(|&(at, by, _)| is_soon(at) && is_of_side(by));
        let line = self.line.filter(|&(at, ..)| is_soon(at));
        let by = match side {
            Side::Player(seat) => Some(seat),
            Side::Team(_) => line.map(|line| line.1),
        };
        let kind = match scoring(&room.scene, side) {
            MomentKind::Goal if line.is_some_and(|line| line.2) => MomentKind::OwnGoal,
            kind => kind,
        };
        // The laps of others are told by the list of players.
        let is_own = by == Some(room.seat);
        let kind = if kind == MomentKind::Lap && !is_own { MomentKind::Points } else { kind };
        let burst_at = burst.map(|burst| burst.2);
        let at = burst_at.or_else(|| zone_of(&room.scene, side)).or_else(|| hero_of(room, side));
        let at = at.or_else(|| room.find_placed(room.scene.sling?.ball));
        self.push(Moment { by, at, points, ..Moment::new(kind, tick, Some(side)) });
    }

    fn note_leader(&mut self, round: &RoundInfo, tick: f64) -> Option<Sound> {
        let best = sides(round).map(|(_, info)| info.score).max().filter(|&best| best > 0)?;
        let mut leading = sides(round).filter(|(_, info)| info.score == best);
        // A tie leaves the crown where it is.
        let (leader, None) = (leading.next()?.0, leading.next()) else { return None };
        let last = self.leader.replace(leader)?;
        let kind = MomentKind::Leader;
        let latest = self.recent.iter().rev().find(|moment| moment.kind == kind);
        let is_late = latest.is_none_or(|latest| tick - latest.tick > LEADERS_APART_TICKS);
        if last == leader || !is_late {
            return None;
        }
        self.push(Moment::new(kind, tick, Some(leader)));
        Some(Sound::Lead)
    }

    fn push(&mut self, moment: Moment) {
        let last = self.recent.iter().rev().find(|other| other.jolts);
        let is_calm = last.is_none_or(|last| moment.tick - last.tick >= JOLTS_APART_TICKS);
        let jolts = moment.kind.jolt().1 > 0.0 && (is_calm || moment.kind == MomentKind::Over);
        if self.recent.len() == MOMENTS_MAX {
            self.recent.pop_front();
        }
        self.recent.push_back(Moment { jolts, ..moment });
    }

    /// The moment whose banner is shown at a tick: the most important one, the newest of several.
    pub fn banner(&self, tick: f64) -> Option<&Moment> {
        let shown = |moment: &&Moment| {
            let has_words = !matches!(moment.kind, MomentKind::Hit | MomentKind::Points);
            has_words && (0.0..BANNER_TICKS).contains(&(tick - moment.tick))
        };
        self.recent.iter().filter(shown).max_by_key(|moment| moment.kind)
    }

    /// Whether the picture is held at this tick.
    pub fn holds(&self, tick: f64) -> bool {
        let holds = |moment: &&Moment| (0.0..moment.kind.jolt().0).contains(&(tick - moment.tick));
        self.recent.iter().rev().filter(holds).any(|moment| moment.jolts)
    }

    /// The offset of the shaking picture, as a share of the view's height.
    pub fn shake(&self, tick: f64) -> Vec2 {
        let sway = |moment: &Moment| {
            let (hold, reach) = moment.kind.jolt();
            let age = (tick - moment.tick - hold) as f32;
            let left = 1.0 - age / SHAKE_TICKS as f32;
            let on = moment.jolts && (0.0..1.0).contains(&left) && age >= 0.0;
            let way = Vec2::new((age * 1.9).cos(), (age * 2.3).sin());
            if on { way * (reach * left * left) } else { Vec2::ZERO }
        };
        self.recent.iter().map(sway).sum()
    }

    /// Adds what is to be seen at the displayed moment to the picture.
    pub fn lay_out(&self, room: &RoomView, drawn: &mut FrameRoom) {
        let tick = room.display;
        let age = |moment: &Moment| (tick - moment.tick) as f32 / TICKS_PER_SECOND as f32;
        let shown = |moment: &&Moment| (0.0..POINTS_TICKS).contains(&(tick - moment.tick));
        drawn.points.clear();
        drawn.points.extend(self.recent.iter().filter(shown).filter_map(|moment| {
            let (at, side) = moment.at.zip(moment.side).filter(|_| moment.points > 0)?;
            let color = room.color_of_side(side);
            Some(FramePoints { at, points: moment.points, color, age: age(moment) })
        }));
        let over = self.recent.iter().rev().find(|moment| moment.kind == MomentKind::Over);
        let over = over.filter(|over| (0.0..CONFETTI_TICKS).contains(&(tick - over.tick)));
        drawn.confetti = over.and_then(|over| {
            let color = room.color_of_side(over.side?);
            Some(FrameConfetti { color, age: age(over) })
        });
        drawn.crown = self.crowned(room);
    }

    /// The hero of the leader, in a scene without teams.
    fn crowned(&self, room: &RoomView) -> Option<BodyId> {
        let Side::Player(seat) = self.leader? else { return None };
        room.players().iter().find(|player| player.seat == seat)?.hero
    }
}

impl Moment {
    fn new(kind: MomentKind, tick: f64, side: Option<Side>) -> Moment {
        Moment { kind, tick, side, by: None, at: None, points: 0, jolts: false }
    }
}

/// The sides of a round: its teams, or its players in a scene without teams.
fn sides(round: &RoundInfo) -> impl Iterator<Item = (Side, SideInfo)> {
    let teams = (0..).map(Side::Team).zip(round.teams.iter().copied());
    let players = round.players.iter().filter(|_| round.teams.is_empty());
    teams.chain(players.map(|player| (Side::Player(player.seat), player.side)))
}

/// The rules that give points to a side.
fn scoring_rules(scene: &Scene, side: Side) -> impl Iterator<Item = Trigger> {
    let rules = scene.rules.rules.iter().filter(|rule| rule.effects.score > 0);
    let concerns = move |to: To| match (to, side) {
        (To::Team(team), side) => side == Side::Team(team),
        _ => true,
    };
    rules.filter(move |rule| concerns(rule.to)).map(|rule| rule.occasion)
}

/// The kind of moment in which a side scores. What a zone counts only while it is there is not a goal.
fn scoring(scene: &Scene, side: Side) -> MomentKind {
    let is_lent =
        |rule: &RuleSpec| matches!(rule.occasion, Trigger::Leave(_)) && rule.effects.score < 0;
    if scene.rules.rules.iter().any(is_lent) {
        return MomentKind::Points;
    }
    let is_lap = scene.rules.signals.iter().any(|signal| signal.order().is_some());
    let mut kinds = scoring_rules(scene, side).filter_map(|occasion| match occasion {
        Trigger::Enter(_) => Some(MomentKind::Goal),
        Trigger::On(_) if is_lap => Some(MomentKind::Lap),
        Trigger::On(_) => Some(MomentKind::Captured),
        _ => None,
    });
    kinds.next().unwrap_or(MomentKind::Points)
}

/// The centre of the zone in which a team scores.
fn zone_of(scene: &Scene, side: Side) -> Option<Vec2> {
    let Side::Team(_) = side else { return None };
    let zones = scoring_rules(scene, side).find_map(|occasion| match occasion {
        Trigger::Enter(zones) => Some(zones),
        Trigger::On(condition) => Some(condition.on.zones),
        _ => None,
    })?;
    let spec = scene.rules.zones.get(zones.trailing_zeros() as usize)?;
    match spec.area {
        _ if spec.follow.is_some() => None,
        ZoneArea::Box(area) => Some((area.low + area.high) * 0.5),
        ZoneArea::Circle { center, .. } => Some(center),
        ZoneArea::Everywhere => None,
    }
}

/// The position of a player's hero.
fn hero_of(room: &RoomView, side: Side) -> Option<Vec2> {
    let Side::Player(seat) = side else { return None };
    room.hero_of(seat).map(|hero| hero.0)
}

#[cfg(test)]
mod tests;
