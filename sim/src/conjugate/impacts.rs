//! Impacts: bounces, before anything else, one pair at a time in the order of their times.
//!
//! Simultaneous rules spread a blow over everything that touches and lose energy; one pair at a
//! time keeps energy and momentum exactly, whatever the order, which only decides who gets them.
//! Pairs that close faster than the threshold and touch within the step are taken by (time, a, b);
//! each gets the two-body impulse (Newton's law of restitution, with Coulomb friction); then all
//! look again. What remains closes slowly or not at all, and the sweeps take nothing back.
//!
//! A pair bounces where it is, up to a step's path early. The height that it comes back to is right
//! all the same: over the gap s the closing acceleration g changes v^2 by 2 g s, so it closes with
//! v, would touch with v^2 + 2 g s, leaves with e^2 of that, and is back here with 2 g s less.

use super::Conjugate;
use super::gap::{self, Gap};
use super::rows::{Facts, Row, placed};
use crate::bodies::Bodies;
use crate::body::Motion;
use crate::math::{clamp, max};
use crate::pairs::Pair;
use glam::Vec2;

/// Rounds of impacts in one step; each takes every pair that closes at its beginning.
const ROUNDS_MAX: u32 = 200;

/// A bounce of this step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strike {
    pub a: u32,
    pub b: u32,
    /// Closing speed, units/s.
    pub closing: f32,
}

/// A pair that is about to touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Bits of the time, and the row: sorts by time, then by ids.
    key: u64,
}

/// Scratch and result.
#[derive(Clone, Debug, Default)]
pub(crate) struct Impacts {
    pub strikes: Vec<Strike>,
    candidates: Vec<Candidate>,
}

/// Takes the impacts of a step; whether there were any.
pub(crate) fn take(
    bodies: &mut Bodies,
    rows: &[Row],
    facts: &[Facts],
    pairs: &[Pair],
    (settings, gravity, dt): (&Conjugate, Vec2, f32),
    impacts: &mut Impacts,
) -> bool {
    let mut any = false;
    for _ in 0..ROUNDS_MAX {
        impacts.candidates.clear();
        for (place, (row, facts)) in (0u32..).zip(rows.iter().zip(facts)) {
            if facts.restitution > 0.0
                && closing(bodies, row, row.normal) > settings.bounce_threshold
                && let Some(hit) = look(bodies, row, pairs, settings.bounce_threshold, dt)
            {
                let key = u64::from(hit.time.to_bits()) << 32 | u64::from(place);
                impacts.candidates.push(Candidate { key });
            }
        }
        if impacts.candidates.is_empty() {
            return any;
        }
        any = true;
        impacts.candidates.sort_unstable_by_key(|candidate| candidate.key);
        for candidate in &impacts.candidates {
            let place = candidate.key as u32 as usize;
            let row = &rows[place];
            // An earlier one may have changed its speeds.
            if let Some(hit) = look(bodies, row, pairs, settings.bounce_threshold, dt) {
                bounce(bodies, row, facts[place].restitution, &hit, gravity);
                impacts.strikes.push(Strike { a: row.a, b: row.b, closing: hit.closing });
            }
        }
    }
    any
}

/// A touch within the step.
struct Hit {
    gap: Gap,
    closing: f32,
    time: f32,
}

#[inline]
fn closing(bodies: &Bodies, row: &Row, normal: Vec2) -> f32 {
    -normal.dot(row.relative(&bodies.velocity))
}

/// The touch of a pair as it moves now.
fn look(bodies: &Bodies, row: &Row, pairs: &[Pair], threshold: f32, dt: f32) -> Option<Hit> {
    let path = row.relative(&bodies.velocity) * dt;
    let kept = pairs[row.pair as usize].axis;
    let gap = gap::between(placed(bodies, row.a), placed(bodies, row.b), path, kept)?;
    let closing = closing(bodies, row, gap.normal);
    let distance = max(gap.separation, 0.0);
    if closing <= threshold || distance > closing * dt {
        return None;
    }
    Some(Hit { gap, closing, time: distance / closing })
}

fn bounce(bodies: &mut Bodies, row: &Row, restitution: f32, hit: &Hit, gravity: Vec2) {
    let Hit { gap: Gap { normal, separation }, closing, .. } = *hit;
    let fall = |slot: u32| match bodies.motion[slot as usize] {
        Motion::Dynamic => bodies.gravity_scale[slot as usize],
        Motion::Static | Motion::Kinematic => 0.0,
    };
    let acceleration = -normal.dot(gravity) * (fall(row.b) - fall(row.a));
    let work = 2.0 * acceleration * max(separation, 0.0);
    let squared = restitution * restitution * (closing * closing + work) - work;
    let leaving = if squared > 0.0 { squared.sqrt() } else { 0.0 };
    let press = (closing + leaving) * row.mass;
    let along = normal.perp();
    let slide = along.dot(row.relative(&bodies.velocity));
    let limit = row.friction * press;
    let rub = clamp(-slide * row.mass, -limit, limit);
    row.apply(&mut bodies.velocity, normal * press + along * rub);
}

/// Tells the rows, which may have been gathered anew, who bounced.
pub(crate) fn mark(strikes: &mut [Strike], rows: &[Row], facts: &mut [Facts]) {
    strikes.sort_unstable_by_key(|strike| (strike.a, strike.b));
    let mut place = 0;
    for strike in strikes.iter() {
        while place < rows.len() && (rows[place].a, rows[place].b) < (strike.a, strike.b) {
            place += 1;
        }
        if place < rows.len() && (rows[place].a, rows[place].b) == (strike.a, strike.b) {
            facts[place].closing = max(facts[place].closing, strike.closing);
            facts[place].struck = true;
        }
    }
}
