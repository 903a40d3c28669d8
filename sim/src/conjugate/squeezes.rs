//! Squeezes: bodies that bounced within the step and are held by something else after all.
//!
//! The path of a body that bounced at time t is drawn out backwards to the step's start: behind the
//! surface that threw it back, where it never was. That is right as long as it leaves with the speed
//! of the bounce. If the rows slow it down, h times its new speed may not bring it out again. Then it
//! gives the start of its step up: it stands where it bounced, as fast as it was there, and has a
//! whole step before it. It lives t longer, and neither energy nor a wall is lost.

use super::gap::{FAR, Gap};
use super::impacts::{Impacts, Paths, fall};
use super::rows::{Facts, Row, bearable, sight, thickness};
use super::travel::Travel;
use super::{Frame, doubts};
use crate::bodies::Bodies;
use crate::math::max;
use crate::pairs::{Pair, shapes};

/// Overlap at the end of the step that counts as none, world units.
const TOUCH: f32 = 1e-4;

/// Finds such bodies in an island and mends their rows; whether there were any.
pub(crate) fn settle(
    bodies: &mut Bodies,
    (rows, facts): (&mut [Row], &mut [Facts]),
    island: &[u32],
    pairs: &[Pair],
    (impacts, travel): (&mut Impacts, &mut Travel),
    frame: &Frame,
) -> bool {
    if impacts.is_empty() {
        return false;
    }
    let allowed = TOUCH + frame.fall();
    impacts.held.clear();
    for &place in island {
        let (row, facts) = (&rows[place as usize], &facts[place as usize]);
        let pair = &pairs[row.pair as usize];
        if impacts.paths.start(pair) <= 0.0 {
            continue;
        }
        let allowed = bearable(thickness(bodies, pair), allowed);
        let closing = -row.normal.dot(row.relative(&bodies.velocity));
        if closing * frame.dt > facts.separation + allowed {
            for slot in [row.a, row.b] {
                stand(bodies, slot as usize, impacts, travel, frame);
            }
        }
    }
    if impacts.held.is_empty() {
        return false;
    }
    for &place in island {
        let (row, facts) = (&mut rows[place as usize], &mut facts[place as usize]);
        if impacts.held.contains(&row.a) || impacts.held.contains(&row.b) {
            look_again(bodies, row, facts, (&pairs[row.pair as usize], &impacts.paths), frame.dt);
        }
    }
    true
}

/// Begins a row anew where its bodies are now.
fn look_again(
    bodies: &mut Bodies,
    row: &mut Row,
    facts: &mut Facts,
    (pair, paths): (&Pair, &Paths),
    dt: f32,
) {
    doubts::release(bodies, row);
    let path = row.relative(&bodies.velocity) * dt;
    let gap = sight::<{ shapes::BOTH }>(bodies, paths, pair, path, dt);
    let gap = gap.unwrap_or(Gap { normal: row.normal, separation: FAR });
    row.normal = gap.normal;
    row.bound = -max(gap.separation, 0.0) / dt;
    facts.separation = gap.separation;
}

/// Puts a body where it bounced.
fn stand(
    bodies: &mut Bodies,
    slot: usize,
    impacts: &mut Impacts,
    travel: &mut Travel,
    frame: &Frame,
) {
    let time = impacts.paths.since[slot];
    if time <= 0.0 {
        return;
    }
    let gain = fall(bodies, slot, frame) * time;
    bodies.center[slot] = impacts.paths.there[slot];
    bodies.velocity[slot] += gain;
    travel.before[slot] += gain;
    impacts.paths.since[slot] = 0.0;
    impacts.held.push(slot as u32);
}
