//! Snapshots stored by tick, and the bodies at any moment between them. Positions are interpolated only between two
//! snapshots that both contain the body. A body is never shown before its birth, and jumps are not smoothed.

use jostle_game::{Kind, Seat};
use jostle_protocol::{Snapshot, SnapshotBody};
use jostle_sim::particles::dequantise;
use jostle_sim::{BodyId, Shape, TICKS_PER_SECOND, Vec2};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of stored snapshots; the oldest are dropped first. Half a minute would be 1800; this only has to
/// cover the delay.
pub const SNAPSHOTS_MAX: usize = 240;
/// Maximum number of ticks past the newest snapshot for which a body is extrapolated with its last velocity.
pub const EXTRAPOLATION_TICKS_MAX: f64 = 2.0;
/// A body that moved farther than this in one tick was teleported, world units. The threshold is higher in scenes whose
/// bodies may be that fast.
const JUMP_UNITS_A_TICK_MIN: f32 = 12.0;
/// The jump threshold relative to the fastest body's step; contacts may push a body farther than that.
const JUMP_FACTOR: f32 = 2.0;

/// The state of a body at the sampled moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub id: BodyId,
    pub kind: Kind,
    /// The seat that owns the body.
    pub owner: Option<Seat>,
    /// Collision group, below [`jostle_sim::GROUPS_MAX`].
    pub group: u8,
    pub shape: Shape,
    /// Interpolated centre, world units.
    pub center: Vec2,
    /// Velocity between the two snapshots, units/s; zero during a jump.
    pub velocity: Vec2,
}

/// Snapshots in tick order.
#[derive(Debug)]
pub struct Timeline {
    snapshots: VecDeque<Arc<Snapshot>>,
    quantum: f32,
    /// Distance per tick above which a step counts as a jump, world units.
    jump: f32,
}

impl Timeline {
    /// An empty timeline. Positions are multiples of `quantum` world units, and no body is faster than `speed_max`
    /// units/s.
    pub fn new(quantum: f32, speed_max: f32) -> Timeline {
        let fastest = speed_max / TICKS_PER_SECOND as f32;
        let jump = (fastest * JUMP_FACTOR).max(JUMP_UNITS_A_TICK_MIN);
        Timeline { snapshots: VecDeque::new(), quantum, jump }
    }

    /// Stores a snapshot. A snapshot that is not newer than all stored ones is dropped.
    pub fn file(&mut self, snapshot: impl Into<Arc<Snapshot>>) {
        let snapshot = snapshot.into();
        if self.newest().is_some_and(|newest| newest.tick >= snapshot.tick) {
            return;
        }
        if self.snapshots.len() == SNAPSHOTS_MAX {
            self.snapshots.pop_front();
        }
        self.snapshots.push_back(snapshot);
    }

    /// Drops snapshots that are not needed to show `tick` or any later moment.
    pub fn forget_before(&mut self, tick: f64) {
        while self.snapshots.get(1).is_some_and(|second| f64::from(second.tick) <= tick) {
            self.snapshots.pop_front();
        }
    }

    pub fn newest(&self) -> Option<&Snapshot> {
        self.snapshots.back().map(|snapshot| &**snapshot)
    }

    /// The newest snapshot and the one before it.
    pub fn newest_two(&self) -> (Option<&Snapshot>, Option<&Snapshot>) {
        let mut newest = self.snapshots.iter().rev().map(|snapshot| &**snapshot);
        (newest.next(), newest.next())
    }

    /// The newest snapshot at or before `tick`, or the oldest one.
    pub fn at_or_before(&self, tick: f64) -> Option<&Snapshot> {
        let after = self.snapshots.partition_point(|s| f64::from(s.tick) <= tick);
        self.snapshots.get(after.saturating_sub(1)).map(|snapshot| &**snapshot)
    }

    /// The snapshots after one moment and until another.
    pub fn between(&self, after: f64, until: f64) -> impl Iterator<Item = &Snapshot> {
        let is_within = move |s: &&Arc<Snapshot>| {
            let tick = f64::from(s.tick);
            after < tick && tick <= until
        };
        self.snapshots.iter().filter(is_within).map(|snapshot| &**snapshot)
    }

    /// Writes the bodies at fractional `tick` in index order into `out`, which is cleared first.
    pub fn sample(&self, tick: f64, out: &mut Vec<Sample>) {
        out.clear();
        let after = self.snapshots.partition_point(|s| f64::from(s.tick) <= tick);
        let (a, b) = match (after.checked_sub(1), self.snapshots.get(after)) {
            (Some(before), Some(b)) => (&*self.snapshots[before], &**b),
            (Some(newest), None) if newest > 0 => {
                let (a, b) = (&self.snapshots[newest - 1], &self.snapshots[newest]);
                return self.extrapolate(a, b, tick, out);
            }
            (Some(only), None) => (&*self.snapshots[only], &*self.snapshots[only]),
            (None, Some(first)) => (&**first, &**first),
            (None, None) => return,
        };
        let span = b.tick.saturating_sub(a.tick).max(1);
        let share = ((tick - f64::from(a.tick)) / f64::from(span)).clamp(0.0, 1.0) as f32;
        for_each_of(a, b, |body, later| {
            let from = self.center(body);
            let step = later.map_or(Vec2::ZERO, |l| self.step(from, self.center(l), span));
            out.push(self.sample_of(body, from + step * share, velocity(step, span)));
        });
    }

    /// Extrapolates the bodies of `b` along their motion since `a`.
    fn extrapolate(&self, a: &Snapshot, b: &Snapshot, tick: f64, out: &mut Vec<Sample>) {
        let span = b.tick.saturating_sub(a.tick).max(1);
        let ahead = (tick - f64::from(b.tick)).clamp(0.0, EXTRAPOLATION_TICKS_MAX) as f32;
        for_each_of(b, a, |body, earlier| {
            let to = self.center(body);
            let step = earlier.map_or(Vec2::ZERO, |e| self.step(self.center(e), to, span));
            let center = to + step * (ahead / span as f32);
            out.push(self.sample_of(body, center, velocity(step, span)));
        });
    }

    fn center(&self, body: &SnapshotBody) -> Vec2 {
        dequantise(body.quanta, self.quantum)
    }

    /// The displacement between two known positions; zero if it was a jump.
    fn step(&self, from: Vec2, to: Vec2, span: u32) -> Vec2 {
        let step = to - from;
        if step.length() > self.jump * span as f32 { Vec2::ZERO } else { step }
    }

    fn sample_of(&self, body: &SnapshotBody, center: Vec2, velocity: Vec2) -> Sample {
        let SnapshotBody { id, kind, owner, group, shape, .. } = *body;
        Sample { id, kind, owner, group, shape, center, velocity }
    }
}

fn velocity(step: Vec2, span: u32) -> Vec2 {
    step * (TICKS_PER_SECOND as f32 / span as f32)
}

/// Calls `visit` with each body of `main` and its counterpart in `other`, if there is one.
fn for_each_of(
    main: &Snapshot,
    other: &Snapshot,
    mut visit: impl FnMut(&SnapshotBody, Option<&SnapshotBody>),
) {
    let mut candidates = other.bodies.iter().peekable();
    for body in &main.bodies {
        while candidates.next_if(|c| c.id.index < body.id.index).is_some() {}
        visit(body, candidates.peek().copied().filter(|c| c.id == body.id));
    }
}

#[cfg(test)]
mod tests;
