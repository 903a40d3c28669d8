//! Corrects penetration: the overlap beyond the slop that is left after the velocities are solved.
//!
//! The velocities never see it (a push-out term in a rigid constraint feeds its own warm start and
//! keeps piles boiling). Where they converge there is nothing to do here; bodies that were created
//! inside each other, or that a moving wall squeezes, separate by a share of the overlap in each
//! pass. A pass asks the same of displacements as constraints ask of velocities, n.(db - da) >=
//! -separation, and so the same sweeps find the least displacements, in the norm of the masses (split
//! impulses and pseudo velocities; Guendelman, Bridson and Fedkiw 2003), without friction and from
//! zero.

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::continuous::thin::thickness;
use crate::math::max;
use crate::narrow_phase::manifold::Manifold;
use crate::narrow_phase::separation;
use crate::narrow_phase::separation::placed;
use crate::shape::Shape;
use crate::solver::contact_constraint::{ContactConstraint, ContactSet};
use crate::solver::islands::Islands;
use crate::solver::settings::Conjugate;
use crate::solver::sweep::{self, Blocks, StopCriteria};
use crate::solver::tolerances::{POSITION_MIN, POSITION_SHARE, SLOP_SHARE};
use glam::Vec2;

#[cfg(test)]
mod tests;

/// Sweeps of a pass; all passes together may visit constraints at most this share of the step's
/// budget.
const SWEEPS_MIN: u32 = 2;
const SWEEPS_MAX: u32 = 20;
const WORK_SHARE: u32 = 4;
/// Distance from an overlap, in contacts, within which bodies still give way: so few sweeps reach
/// no further, and a pile with one deep overlap need not be handled as a whole.
const LAYERS: u8 = 8;
const UNREACHED: u8 = u8::MAX;
/// Side of the square over which concentric bodies count as spread, as a share of the thinner one's
/// half-size.
const SPREAD: f32 = 0.25;
const TWO_TO_32: f32 = 4_294_967_296.0;

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct PositionCorrection {
    /// Copies of the constraints of close bodies, with displacements for velocities.
    constraints: Vec<ContactConstraint>,
    islands: Islands,
    /// By slot.
    displacement: Vec<Vec2>,
    /// By slot: whether the last pass moved it.
    moved: Vec<bool>,
    /// By slot: distance of a movable body from an overlap in contacts, if at most [`LAYERS`].
    layer: Vec<u8>,
}

impl PositionCorrection {
    /// Separates overlapping bodies, island by island. Before it, `separation_after` of a contact
    /// is measured along its tangent; contacts of bodies that are moved here get their exact normal
    /// and separation.
    pub fn separate(
        &mut self,
        bodies: &mut Bodies,
        contacts: &mut ContactSet,
        pairs: &[Pair],
        blocks: &mut Blocks,
        settings: &Conjugate,
    ) {
        let slots = bodies.alive.len();
        self.displacement.resize(slots, Vec2::ZERO);
        for _ in 0..settings.position_passes {
            if !self.gather(bodies, contacts, pairs, settings) {
                return;
            }
            self.moved.clear();
            self.moved.resize(slots, false);
            self.islands.find(slots, &self.constraints);
            for island in 0..self.islands.count() {
                self.separate_island(island, bodies, blocks, settings);
            }
            self.refresh_manifolds(bodies, contacts, pairs);
        }
    }

    /// Makes one pass over an island.
    fn separate_island(
        &mut self,
        island: usize,
        bodies: &mut Bodies,
        blocks: &mut Blocks,
        settings: &Conjugate,
    ) {
        let constraints = &self.islands.constraints[self.islands.range(island)];
        let visits = settings.work_max / WORK_SHARE / settings.position_passes;
        let sweeps_max = (visits / constraints.len() as u32).clamp(SWEEPS_MIN, SWEEPS_MAX);
        let tolerance = max(POSITION_SHARE * settings.slop, POSITION_MIN);
        blocks.chains.find(&self.constraints, constraints);
        let stop = StopCriteria { tolerance, sweeps_max };
        sweep::solve::<false>(
            &mut self.constraints,
            constraints,
            blocks,
            &mut self.displacement,
            stop,
        );
        sweep::sweep_immovable(&mut self.constraints, constraints, &mut self.displacement);
        self.apply_displacements(island, bodies, settings.correction_max);
    }

    /// Gathers the constraints that may take part; returns whether any overlaps by more than the
    /// slop.
    fn gather(
        &mut self,
        bodies: &Bodies,
        contacts: &ContactSet,
        pairs: &[Pair],
        settings: &Conjugate,
    ) -> bool {
        self.constraints.clear();
        self.layer.clear();
        self.layer.resize(bodies.alive.len(), UNREACHED);
        let mut any = false;
        for (constraint, info) in contacts.constraints.iter().zip(&contacts.infos) {
            let Some(manifold) =
                current_manifold(bodies, constraint, &pairs[constraint.pair as usize])
            else {
                continue;
            };
            if manifold.separation < settings.correction_max {
                self.constraints.push(displacement_constraint(constraint, &manifold, settings));
            }
            if info.separation_after < -settings.slop && manifold.separation < -settings.slop {
                any = true;
                for (slot, inv_mass) in constraint.bodies() {
                    self.layer[slot as usize] = if inv_mass > 0.0 { 0 } else { UNREACHED };
                }
            }
        }
        if any {
            self.keep_near_overlaps();
        }
        any
    }

    /// Finds the manifolds of the bodies that were moved.
    fn refresh_manifolds(&self, bodies: &Bodies, contacts: &mut ContactSet, pairs: &[Pair]) {
        for (constraint, info) in contacts.constraints.iter_mut().zip(&mut contacts.infos) {
            let moved = self.moved[constraint.a as usize] || self.moved[constraint.b as usize];
            if moved
                && let Some(manifold) =
                    current_manifold(bodies, constraint, &pairs[constraint.pair as usize])
            {
                constraint.normal = manifold.normal;
                info.separation_after = manifold.separation;
            }
        }
    }

    /// Keeps the constraints that are few contacts away from an overlap.
    fn keep_near_overlaps(&mut self) {
        for layer in 0..LAYERS {
            for constraint in self.constraints.iter().filter(|constraint| constraint.is_free()) {
                let (a, b) = (constraint.a as usize, constraint.b as usize);
                for (from, to) in [(a, b), (b, a)] {
                    if self.layer[from] == layer && self.layer[to] > layer {
                        self.layer[to] = layer + 1;
                    }
                }
            }
        }
        let layer = &self.layer;
        self.constraints.retain(|constraint| {
            let nearest = layer[constraint.a as usize].min(layer[constraint.b as usize]);
            nearest < LAYERS || nearest == LAYERS && !constraint.is_free()
        });
    }

    /// Moves the bodies of an island, none by more than `limit`: tangents say nothing about
    /// positions further away.
    fn apply_displacements(&mut self, island: usize, bodies: &mut Bodies, limit: f32) {
        let constraints = &self.islands.constraints[self.islands.range(island)];
        let slots = constraints.iter().flat_map(|&constraint| {
            let constraint = &self.constraints[constraint as usize];
            [constraint.a as usize, constraint.b as usize]
        });
        let furthest =
            slots.clone().fold(0.0, |limit, slot| max(limit, self.displacement[slot].length()));
        let share = if furthest > limit { limit / furthest } else { 1.0 };
        for slot in slots {
            // Masses far apart may overflow here; a position that is not finite is skipped.
            let position = bodies.center[slot] + self.displacement[slot] * share;
            if position.is_finite() {
                self.moved[slot] |= position != bodies.center[slot];
                bodies.center[slot] = position;
            }
            self.displacement[slot] = Vec2::ZERO;
        }
    }
}

/// A constraint that separates its bodies, or lets them close, by the distance that their manifold
/// allows in a pass.
fn displacement_constraint(
    constraint: &ContactConstraint,
    manifold: &Manifold,
    settings: &Conjugate,
) -> ContactConstraint {
    ContactConstraint {
        normal: manifold.normal,
        min_normal_velocity: -allowed_closing(manifold.separation, settings),
        friction: 0.0,
        normal_impulse: 0.0,
        tangent_impulse: 0.0,
        normal_direction: 0.0,
        tangent_direction: 0.0,
        ..*constraint
    }
}

/// Distance that a pair may close or, where negative, must separate in a pass.
#[inline]
fn allowed_closing(separation: f32, settings: &Conjugate) -> f32 {
    let allowed_closing = separation + settings.slop * SLOP_SHARE;
    if allowed_closing >= 0.0 {
        allowed_closing
    } else {
        max(allowed_closing * settings.correction, -settings.correction_max)
    }
}

/// The manifold of a pair at its present positions. Bodies too deep in each other to have a side
/// are separated along the line of centres: in a heap at one point that is outwards, and in a row
/// that fills its container from wall to wall slightly out of the row.
fn current_manifold(
    bodies: &Bodies,
    constraint: &ContactConstraint,
    pair: &Pair,
) -> Option<Manifold> {
    let manifold = separation::between(
        placed(bodies, constraint.a),
        placed(bodies, constraint.b),
        Vec2::ZERO,
        pair.axis,
    )?;
    if !constraint.is_deep(bodies, manifold.separation) {
        return Some(manifold);
    }
    let (a, b) = (constraint.a as usize, constraint.b as usize);
    let offset = bodies.center[b] - bodies.center[a];
    let thin = thickness(bodies, pair);
    let normal = (offset + (spread(constraint.b) - spread(constraint.a)) * (SPREAD * thin))
        .normalize_or(Vec2::Y);
    let support = |slot: usize| match bodies.shape[slot] {
        Shape::Circle { radius } => radius,
        Shape::Box { half } => half.dot(normal.abs()),
    };
    Some(Manifold { normal, separation: normal.dot(offset) - support(a) - support(b) })
}

/// Position in the unit square of a body in a heap at one point: the bodies separate as if they had
/// been spread evenly (multiples of the inverses of the plastic number and of its square; Roberts
/// 2018, "The unreasonable effectiveness of quasirandom sequences").
fn spread(slot: u32) -> Vec2 {
    const STEPS: [u32; 2] = [3_242_174_889, 2_447_445_414];
    let unit = |step: u32| slot.wrapping_mul(step) as f32 / TWO_TO_32;
    Vec2::new(unit(STEPS[0]), unit(STEPS[1]))
}
