//! Doubts: rows of fast pairs, looked at again with the speeds that were solved.
//!
//! A row is the tangent of a shape where the speeds before the step would lead. Where a step is
//! longer than a body is large and something else stops or turns one of the two, they end elsewhere:
//! the tangent may push on bodies that pass each other, and the pair may meet after all. So for
//! each such row the two are swept once more, as they would move if only this row did nothing.
//! What does not touch then is let go; what does is held there. If anything changed the island
//! is solved again (sequential convex programming, with the sweep in place of the distance; Schulman
//! et al. 2014, "Motion planning with sequential convex optimization").

use super::gap::FAR;
use super::impacts::Paths;
use super::rows::{Facts, Row, sight};
use crate::bodies::Bodies;
use crate::math::max;
use crate::pairs::{Pair, shapes};

/// How often an island may be solved in a step; the last doubts are left.
pub(crate) const ROUNDS_MAX: u32 = 5;
/// Cosine below which a normal counts as another one.
const SAME_NORMAL: f32 = 0.99;
/// Overlap at the end of the step that counts as none, world units.
const TOUCH: f32 = 1e-4;

/// Mends the doubtful rows of an island; whether there is anything to solve again.
pub(crate) fn settle(
    bodies: &mut Bodies,
    rows: &mut [Row],
    facts: &mut [Facts],
    island: &[u32],
    pairs: &[Pair],
    paths: &Paths,
    dt: f32,
) -> bool {
    let mut any = false;
    for &place in island {
        let facts = &mut facts[place as usize];
        if facts.fast {
            let row = &mut rows[place as usize];
            let pair = &pairs[row.pair as usize];
            any |= mend(bodies, row, facts, (pair, paths), dt);
        }
    }
    any
}

/// Mends a row; whether it changed.
fn mend(
    bodies: &mut Bodies,
    row: &mut Row,
    facts: &mut Facts,
    (pair, paths): (&Pair, &Paths),
    dt: f32,
) -> bool {
    let own = row.impulse(row.press, row.rub) / row.mass;
    let path = (row.relative(&bodies.velocity) - own) * dt;
    let gap = sight::<{ shapes::BOTH }>(bodies, paths, pair, path, dt);
    match gap.filter(|gap| gap.separation + gap.normal.dot(path) < -TOUCH) {
        None if row.press <= 0.0 => false,
        None => {
            release(bodies, row);
            row.bound = -FAR / dt;
            facts.separation = FAR;
            true
        }
        Some(gap) if row.press > 0.0 && gap.normal.dot(row.normal) > SAME_NORMAL => false,
        Some(gap) => {
            release(bodies, row);
            row.normal = gap.normal;
            row.bound = -max(gap.separation, 0.0) / dt;
            facts.separation = gap.separation;
            true
        }
    }
}

/// Takes back what a row did.
pub(crate) fn release(bodies: &mut Bodies, row: &mut Row) {
    let own = row.impulse(row.press, row.rub);
    row.apply(&mut bodies.velocity, -own);
    row.press = 0.0;
    row.rub = 0.0;
}
