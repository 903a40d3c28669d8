//! Overlap: what is left of it beyond the slop after the velocities are solved is moved away.
//!
//! The velocities never know of it (a push-out term in a rigid row feeds its own warm start and
//! keeps piles boiling). Where they converge there is nothing to do here; bodies that were put into
//! each other, or that a moving wall squeezes, part by a share of the overlap in each pass, by their
//! masses (Jakobsen 2001, "Advanced character physics"), lines first and each as a whole.

use super::Conjugate;
use super::gap::{self, Gap};
use super::lines::Lines;
use super::rows::{Facts, Row, placed};
use crate::bodies::Bodies;
use crate::math::max;
use crate::pairs::Pair;
use glam::Vec2;

/// Share of the slop to which an overlap beyond it is brought back: whoever rests at its edge would
/// be looked at in every step.
const LEFT_ALONE: f32 = 0.8;

/// Parts what overlaps; returns the number of passes.
pub(crate) fn part(
    bodies: &mut Bodies,
    (rows, facts): (&mut [Row], &mut [Facts]),
    pairs: &[Pair],
    settings: &Conjugate,
    (lines, close): (&mut Lines, &mut Vec<u32>),
) -> u32 {
    let allowed = -settings.slop;
    if facts.iter().all(|facts| facts.left >= allowed) {
        return 0;
    }
    close.clear();
    for (place, (row, facts)) in (0u32..).zip(rows.iter_mut().zip(facts.iter_mut())) {
        if let Some(gap) = look(bodies, row, &pairs[row.pair as usize]) {
            row.normal = gap.normal;
            facts.left = gap.separation;
            if gap.separation < settings.correction_max {
                close.push(place);
            }
        }
    }
    lines.find(rows, close);
    for pass in 1..=settings.position_passes {
        let shape = &bodies.shape;
        lines.part(rows, &mut bodies.center, |row, center, axis| {
            let (a, b) = (row.a as usize, row.b as usize);
            let reach = shape[a].half_extent()[axis] + shape[b].half_extent()[axis];
            let distance = (center[b] - center[a])[axis] * row.normal[axis];
            room(distance - reach, settings)
        });
        let mut busy = false;
        for &place in close.iter() {
            let (row, facts) = (&mut rows[place as usize], &mut facts[place as usize]);
            let Some(gap) = look(bodies, row, &pairs[row.pair as usize]) else { continue };
            row.normal = gap.normal;
            facts.left = gap.separation;
            if gap.separation < allowed {
                busy = true;
                let shift = gap.normal * (-room(gap.separation, settings) * row.mass);
                bodies.center[row.a as usize] -= shift * row.weight_a;
                bodies.center[row.b as usize] += shift * row.weight_b;
            }
        }
        if !busy {
            return pass;
        }
    }
    settings.position_passes
}

/// How far a pair may close, or, where it is negative, must part in a pass.
#[inline]
fn room(separation: f32, settings: &Conjugate) -> f32 {
    let room = separation + settings.slop * LEFT_ALONE;
    if room >= 0.0 { room } else { max(room * settings.correction, -settings.correction_max) }
}

fn look(bodies: &Bodies, row: &Row, pair: &Pair) -> Option<Gap> {
    gap::between(placed(bodies, row.a), placed(bodies, row.b), Vec2::ZERO, pair.axis)
}
