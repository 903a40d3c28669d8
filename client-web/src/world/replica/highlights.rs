//! Highlights of a round: the seconds around each goal, stored as the snapshots and events received for them. The
//! newest ticks are buffered in `recent`; a goal opens a highlight, which is copied from the buffer when its last tick
//! has arrived.

use super::listener::{GOALS_APART_TICKS, Turn};
use jostle_game::{RoundInfo, RoundPhase, Scene};
use jostle_protocol::{Snapshot, TimedEvent};
use jostle_sim::TICKS_PER_SECOND;
use std::collections::VecDeque;
use std::sync::Arc;

/// Number of ticks in a highlight before the goal.
pub const BEFORE_TICKS: u32 = 3 * TICKS_PER_SECOND;
/// Number of ticks in a highlight after the goal.
pub const AFTER_TICKS: u32 = TICKS_PER_SECOND / 2;
/// Maximum number of highlights stored per round; the oldest are dropped first.
const HIGHLIGHTS_MAX: usize = 6;
/// Maximum total number of bodies in all stored snapshots, about 10 MB. In a scene with thousands of bodies, highlights
/// therefore start later.
const BODIES_MAX: usize = 200_000;

/// The content of one snapshot message.
#[derive(Clone, Debug)]
pub struct Filed {
    /// The state of the room at a tick.
    pub snapshot: Arc<Snapshot>,
    /// The events that led to this state.
    pub events: Vec<TimedEvent>,
}

/// The ticks around a goal.
pub type Highlight = Vec<Filed>;

/// Snapshots in tick order, which contain at most [`BODIES_MAX`] bodies in total.
#[derive(Debug, Default)]
struct Recent {
    filed: VecDeque<Filed>,
    bodies: usize,
}

/// The highlights of the current or previous round.
#[derive(Debug, Default)]
pub struct Highlights {
    recent: Recent,
    kept: VecDeque<Highlight>,
    /// Tick of the goal whose highlight is not complete yet.
    open: Option<u32>,
    turn: Option<Turn>,
    /// Tick in which points were last scored.
    points: Option<u32>,
}

impl Recent {
    fn push(&mut self, filed: Filed) {
        self.bodies += filed.snapshot.bodies.len();
        self.filed.push_back(filed);
        let newest = self.newest().unwrap_or(0);
        while let Some(oldest) = self.filed.front()
            && (self.bodies > BODIES_MAX
                || newest - oldest.snapshot.tick > BEFORE_TICKS + AFTER_TICKS)
        {
            self.bodies -= oldest.snapshot.bodies.len();
            self.filed.pop_front();
        }
    }

    fn newest(&self) -> Option<u32> {
        self.filed.back().map(|filed| filed.snapshot.tick)
    }
}

impl Highlights {
    /// Creates the highlights for a scene; `None` for a scene without rounds.
    pub fn of(scene: &Scene) -> Option<Highlights> {
        scene.rules.round.is_some().then(Highlights::default)
    }

    /// Records a snapshot. One that is not newer than the previous one is ignored.
    pub fn note(&mut self, snapshot: &Arc<Snapshot>, events: &[TimedEvent]) {
        if self.recent.newest().is_some_and(|newest| newest >= snapshot.tick) {
            return;
        }
        let filed = Filed { snapshot: Arc::clone(snapshot), events: events.to_vec() };
        self.recent.push(filed);
        if self.open.is_some_and(|goal| snapshot.tick >= goal + AFTER_TICKS) {
            self.cut();
        }
        if let Some(round) = &snapshot.round {
            self.note_round(snapshot.tick, round);
        }
    }

    fn note_round(&mut self, tick: u32, round: &RoundInfo) {
        let now = Turn::of(round, 0.0);
        let Some(before) = self.turn.replace(now).filter(|before| *before != now) else { return };
        if before.phase == RoundPhase::Over && now.phase != RoundPhase::Over {
            self.kept.clear();
            (self.open, self.points) = (None, None);
        } else if now.scores_after(before) {
            let last = self.points.replace(tick);
            if last.is_none_or(|last| tick - last > GOALS_APART_TICKS) {
                self.begin(tick);
            }
        } else if now.phase == RoundPhase::Over && !round.winners.is_empty() && self.open.is_none()
        {
            // An end that no goal brings is worth seeing only if there was no goal.
            if now.points > before.points || self.kept.is_empty() {
                self.begin(tick);
            }
        }
    }

    fn begin(&mut self, goal: u32) {
        self.cut();
        self.open = Some(goal);
    }

    /// Closes the open highlight with the ticks received so far.
    fn cut(&mut self) {
        let Some(goal) = self.open.take() else { return };
        let first = goal.saturating_sub(BEFORE_TICKS);
        let ticks = first..=goal + AFTER_TICKS;
        let of_goal = self.recent.filed.iter().filter(|f| ticks.contains(&f.snapshot.tick));
        self.kept.push_back(of_goal.cloned().collect());
        let bodies = |highlight: &Highlight| {
            highlight.iter().map(|filed| filed.snapshot.bodies.len()).sum::<usize>()
        };
        while self.kept.len() > HIGHLIGHTS_MAX
            || self.kept.len() > 1 && self.kept.iter().map(bodies).sum::<usize>() > BODIES_MAX
        {
            self.kept.pop_front();
        }
    }

    /// Whether the round has no highlights.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty() && self.open.is_none()
    }

    /// The newest highlights that fit in this many ticks, oldest first. If there are any, at least one is returned.
    pub fn newest_within(&mut self, ticks: u32) -> Vec<Highlight> {
        self.cut();
        let mut left = ticks;
        let fits = |highlight: &&Highlight| {
            let long = length(highlight);
            let fits = long <= left;
            left = left.saturating_sub(long);
            fits
        };
        let count = self.kept.iter().rev().take_while(fits).count().max(1);
        self.kept.iter().skip(self.kept.len().saturating_sub(count)).cloned().collect()
    }
}

/// The length of a highlight in ticks.
pub fn length(highlight: &Highlight) -> u32 {
    let tick = |filed: Option<&Filed>| filed.map_or(0, |filed| filed.snapshot.tick);
    tick(highlight.last()) - tick(highlight.first())
}

#[cfg(test)]
mod tests;
