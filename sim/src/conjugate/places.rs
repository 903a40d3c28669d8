//! Overlap: what is left of it beyond the slop after the velocities are solved is moved away.
//!
//! The velocities never know of it (a push-out term in a rigid row feeds its own warm start and
//! keeps piles boiling). Where they converge there is nothing to do here; bodies that were put into
//! each other, or that a moving wall squeezes, part by a share of the overlap in each pass. What a
//! pass asks of the displacements is what rows ask of velocities, n.(db - da) >= -room, and so the same sweeps
//! find the least displacements, in the norm of the masses, that do it (split impulses and pseudo
//! velocities; Guendelman, Bridson and Fedkiw 2003), without friction and from nothing.

use super::Conjugate;
use super::gap::{self, Gap};
use super::lines::Lines;
use super::rows::{Facts, Row, placed, thickness};
use super::sweep::{self, End};
use super::trees::Trees;
use crate::bodies::Bodies;
use crate::math::max;
use crate::pairs::Pair;
use crate::shape::Shape;
use glam::Vec2;

#[cfg(test)]
mod tests;

/// Share of the slop to which an overlap beyond it is brought back: whoever rests at its edge would
/// be looked at in every step.
const LEFT_ALONE: f32 = 0.8;
/// Sweeps of a pass; all passes together may visit rows at most this share of the step's budget.
const SWEEPS_MIN: u32 = 2;
const SWEEPS_MAX: u32 = 20;
const WORK_SHARE: u32 = 4;
/// How many contacts away from an overlap bodies still give way: sweeps that few reach no further,
/// and a pile in which one body is deep in another need not be looked at as a whole.
const LAYERS: u8 = 8;
const FAR_OFF: u8 = u8::MAX;
/// Side of the square in which bodies at one place count as spread, as a share of the thinner one's half-size.
const SPREAD: f32 = 0.25;
const TWO_TO_32: f32 = 4_294_967_296.0;
/// Change of a displacement at which they end: a share of the slop, or world units.
const TOLERANCE: f32 = 0.1;
const TOLERANCE_MIN: f32 = 1e-5;

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Places {
    /// Copies of the rows whose bodies are close, with displacements for velocities.
    rows: Vec<Row>,
    /// All of them, as an island.
    island: Vec<u32>,
    /// By slot.
    shift: Vec<Vec2>,
    /// By slot: how many contacts a movable body is away from an overlap, if at most [`LAYERS`].
    layer: Vec<u8>,
}

/// Parts what overlaps.
pub(crate) fn part(
    bodies: &mut Bodies,
    (rows, facts): (&mut [Row], &mut [Facts]),
    pairs: &[Pair],
    settings: &Conjugate,
    (lines, trees, places): (&mut Lines, &mut Trees, &mut Places),
) {
    let tolerance = max(TOLERANCE * settings.slop, TOLERANCE_MIN);
    let visits = settings.work_max / WORK_SHARE / settings.position_passes.max(1);
    for _ in 0..settings.position_passes {
        if !places.list(bodies, rows, facts, pairs, settings) {
            return;
        }
        let sweeps = visits / (places.rows.len() as u32).max(1);
        let end = End { tolerance, sweeps_max: sweeps.clamp(SWEEPS_MIN, SWEEPS_MAX) };
        lines.find(&places.rows, &places.island);
        let blocks = (&mut *lines, &mut *trees);
        sweep::solve::<false>(&mut places.rows, &places.island, blocks, &mut places.shift, end);
        sweep::walls(&mut places.rows, &places.island, &mut places.shift);
        places.shift(bodies, settings.correction_max);
    }
    places.list(bodies, rows, facts, pairs, settings);
}

impl Places {
    /// Looks at all rows, and lists those that may take part; whether any overlaps.
    fn list(
        &mut self,
        bodies: &Bodies,
        rows: &mut [Row],
        facts: &mut [Facts],
        pairs: &[Pair],
        settings: &Conjugate,
    ) -> bool {
        self.rows.clear();
        self.shift.resize(bodies.alive.len(), Vec2::ZERO);
        self.layer.clear();
        self.layer.resize(bodies.alive.len(), FAR_OFF);
        let mut any = false;
        for (row, facts) in rows.iter_mut().zip(facts) {
            let Some(gap) = look(bodies, row, &pairs[row.pair as usize]) else { continue };
            row.normal = gap.normal;
            facts.left = gap.separation;
            if gap.separation < settings.correction_max {
                self.rows.push(asking(row, -room(gap.separation, settings)));
            }
            if gap.separation < -settings.slop {
                any = true;
                for (slot, weight) in [(row.a, row.weight_a), (row.b, row.weight_b)] {
                    self.layer[slot as usize] = if weight > 0.0 { 0 } else { FAR_OFF };
                }
            }
        }
        if any {
            self.stay_near();
        }
        any
    }

    /// Leaves the rows that are few contacts away from an overlap.
    fn stay_near(&mut self) {
        for layer in 0..LAYERS {
            for row in self.rows.iter().filter(|row| row.is_free()) {
                let (a, b) = (row.a as usize, row.b as usize);
                for (from, to) in [(a, b), (b, a)] {
                    if self.layer[from] == layer && self.layer[to] > layer {
                        self.layer[to] = layer + 1;
                    }
                }
            }
        }
        let layer = &self.layer;
        self.rows.retain(|row| {
            let nearest = layer[row.a as usize].min(layer[row.b as usize]);
            nearest < LAYERS || nearest == LAYERS && !row.is_free()
        });
        self.island.clear();
        self.island.extend(0..self.rows.len() as u32);
    }

    /// Moves the bodies, none by more than `most`: tangents say nothing of what is further away.
    fn shift(&mut self, bodies: &mut Bodies, most: f32) {
        let slots = || self.rows.iter().flat_map(|row| [row.a as usize, row.b as usize]);
        let furthest = slots().fold(0.0, |most, slot| max(most, self.shift[slot].length()));
        let share = if furthest > most { most / furthest } else { 1.0 };
        for row in &self.rows {
            for slot in [row.a as usize, row.b as usize] {
                // Masses far apart may overflow here; a place that is no number is none.
                let place = bodies.center[slot] + self.shift[slot] * share;
                if place.is_finite() {
                    bodies.center[slot] = place;
                }
                self.shift[slot] = Vec2::ZERO;
            }
        }
    }
}

/// A row that asks its bodies to part by `bound`.
fn asking(row: &Row, bound: f32) -> Row {
    Row { bound, friction: 0.0, press: 0.0, rub: 0.0, press_along: 0.0, rub_along: 0.0, ..*row }
}

/// How far a pair may close, or, where it is negative, must part in a pass.
#[inline]
fn room(separation: f32, settings: &Conjugate) -> f32 {
    let room = separation + settings.slop * LEFT_ALONE;
    if room >= 0.0 { room } else { max(room * settings.correction, -settings.correction_max) }
}

/// The gap of a pair where it is. Who has no side any more is parted along the line of centres: from
/// a heap at one point that is outwards, and in a row that fills its container from wall to wall a
/// little out of the row.
fn look(bodies: &Bodies, row: &Row, pair: &Pair) -> Option<Gap> {
    let gap = gap::between(placed(bodies, row.a), placed(bodies, row.b), Vec2::ZERO, pair.axis)?;
    if !row.is_sideless(bodies, gap.separation) {
        return Some(gap);
    }
    let (a, b) = (row.a as usize, row.b as usize);
    let way = bodies.center[b] - bodies.center[a];
    let thin = thickness(bodies, pair);
    let normal = (way + (spread(row.b) - spread(row.a)) * (SPREAD * thin)).normalize_or(Vec2::Y);
    let support = |slot: usize| match bodies.shape[slot] {
        Shape::Circle { radius } => radius,
        Shape::Box { half } => half.dot(normal.abs()),
    };
    Some(Gap { normal, separation: normal.dot(way) - support(a) - support(b) })
}

/// Where in the unit square a body counts as lying if many lie at one place: they part as if they had
/// been spread evenly (multiples of the inverses of the plastic number and of its square; Roberts 2018,
/// "The unreasonable effectiveness of quasirandom sequences").
fn spread(slot: u32) -> Vec2 {
    const STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];
    let unit = |step: u32| slot.wrapping_mul(step) as f32 / TWO_TO_32;
    Vec2::new(unit(STEPS[0]), unit(STEPS[1]))
}
