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
use crate::features::ALWAYS_FRICTION;
use crate::math::max;
use crate::narrow_phase::manifold::Manifold;
use crate::narrow_phase::overlap::spread_manifold;
use crate::narrow_phase::separation;
use crate::narrow_phase::separation::placed;
use crate::solver::contact_constraint::{ContactConstraint, ContactSet};
use crate::solver::islands::Islands;
use crate::solver::settings::Conjugate;
use crate::solver::sweep::{self, Blocks, SweepLimits};
use crate::solver::tolerances::{POSITION_MIN, POSITION_SHARE, SLOP_SHARE};
use glam::Vec2;

#[cfg(test)]
mod tests;

/// Sweeps of a pass; all passes together may visit constraints at most this share of the step's
/// budget.
const SWEEPS_MIN: u32 = 2;
const SWEEPS_MAX: u32 = 20;
const WORK_SHARE: u32 = 4;
/// Contacts beyond which an island whose velocities are not solved gets only so many passes and sweeps.
/// With one pass a heap at one point stays in one place.
const HURRIED_ISLAND: usize = 600;
const HURRIED_PASSES: u32 = 2;
const HURRIED_SWEEPS: u32 = 6;
/// Distance from an overlap, in contacts, within which bodies still give way: so few sweeps reach
/// no further, and a pile with one deep overlap need not be handled as a whole.
const LAYERS: u8 = 8;
const UNREACHED: u8 = u8::MAX;

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct PositionCorrection {
    /// Copies of the constraints of close bodies, with displacements for velocities.
    constraints: Vec<ContactConstraint>,
    islands: Islands,
    /// By slot.
    displacement: Vec<Vec2>,
    /// By slot: whether it belongs to an island whose velocities are not solved.
    is_unsolved: Vec<bool>,
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
        for pass in 0..settings.position_passes {
            if !self.gather(bodies, contacts, pairs, settings) {
                return;
            }
            self.moved.clear();
            self.moved.resize(slots, false);
            self.islands.find(slots, &self.constraints);
            for island in 0..self.islands.count() {
                let is_hurried = self.is_hurried(island);
                if pass < HURRIED_PASSES || !is_hurried {
                    let sweeps_max = if is_hurried { HURRIED_SWEEPS } else { SWEEPS_MAX };
                    self.separate_island(island, bodies, blocks, settings, sweeps_max);
                }
            }
            self.refresh_manifolds(bodies, contacts, pairs);
        }
    }

    /// Whether less has to do for an island: it is large and its velocities are not solved, so that it
    /// moves on, and the next step sees other overlaps.
    fn is_hurried(&self, island: usize) -> bool {
        let island = &self.islands.constraints[self.islands.range(island)];
        let [a, b] = self.constraints[island[0] as usize].bodies();
        let (movable, _) = if a.1 > 0.0 { a } else { b };
        island.len() > HURRIED_ISLAND && self.is_unsolved[movable as usize]
    }

    /// Makes one pass of at most `sweeps_most` sweeps over an island.
    fn separate_island(
        &mut self,
        island: usize,
        bodies: &mut Bodies,
        blocks: &mut Blocks,
        settings: &Conjugate,
        sweeps_most: u32,
    ) {
        let constraints = &self.islands.constraints[self.islands.range(island)];
        let visits = settings.work_max / WORK_SHARE / settings.position_passes;
        let sweeps_max = (visits / constraints.len() as u32).clamp(SWEEPS_MIN, sweeps_most);
        let tolerance = max(POSITION_SHARE * settings.slop, POSITION_MIN);
        blocks.chains.find(&self.constraints, constraints);
        let limits = SweepLimits { tolerance, sweeps_max, forest: true };
        sweep::solve::<ALWAYS_FRICTION>(
            &mut self.constraints,
            constraints,
            blocks,
            &mut self.displacement,
            limits,
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
        self.is_unsolved.resize(bodies.alive.len(), false);
        let mut any = false;
        for (constraint, info) in contacts.constraints.iter().zip(&contacts.infos) {
            // The tangent's separation is never greater than that of the shapes.
            if info.separation_after >= settings.correction_max {
                continue;
            }
            for (slot, inv_mass) in constraint.bodies() {
                self.is_unsolved[slot as usize] = inv_mass > 0.0 && info.is_unsolved;
            }
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
    Some(spread_manifold(bodies, (constraint.a, constraint.b)))
}
