//! Corrects penetration, which is the overlap beyond the slop that is left once the velocities are solved.
//!
//! Velocities are not affected (a push-out term in a rigid constraint feeds its own warm start and keeps piles
//! boiling). Where they converge, there is nothing to correct. Bodies that were created inside each other, or that
//! are squeezed by a moving wall, separate by a share of the overlap in each pass. A pass makes the same demand on
//! displacements as constraints make on velocities, n.(db - da) >= -separation, so the same sweeps find the smallest
//! displacements in the mass norm (split impulses and pseudo velocities; Guendelman, Bridson and Fedkiw 2003),
//! without friction and starting from zero.
//!
//! Where bodies slide past each other, the next step sees other overlaps, and finding the smallest displacements
//! is not worth the time. Overlapping pairs are then pushed apart one by one (see `pushes` and [`Correction`]).

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::growth::push;
use crate::integrate::Displacements;
use crate::math::{clamp_length, max};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::overlap::spread_manifold;
use crate::narrow_phase::separation::{self, placed};
use crate::solver::contact_constraint::{
    ContactConstraint, ContactInfo, ContactSet, Correction, PUSHED_FROM,
};
use crate::solver::islands::Islands;
use crate::solver::settings::Conjugate;
use crate::solver::step_context::StepContext;
use crate::solver::sweep::{self, Blocks, Sequence, SweepLimits};
use crate::solver::tolerances::{POSITION_MIN, POSITION_SHARE, SLOP_SHARE};
use glam::Vec2;
use pushes::{PushLimits, Pushes};

mod pushes;
#[cfg(test)]
mod tests;

/// Minimum and maximum number of sweeps in a pass.
const SWEEPS_MIN: u32 = 2;
const SWEEPS_MAX: u32 = 20;
/// Maximum number of visits to an island's constraints in the first pass, and the divisor that limits them to a share
/// of the step's budget. Each subsequent pass takes half as many. In a fallen tower of 1000 bodies, whole passes
/// would take five times as many.
const VISITS_MAX: u32 = 20_000;
const WORK_SHARE: u32 = 8;
/// Distance assigned to a body that was not reached.
const UNREACHED: u8 = u8::MAX;
/// Distance from an overlap, in contacts, within which bodies may be displaced. With so few sweeps, effects reach no
/// further, and a pile with one deep overlap need not be handled as a whole.
const LAYERS: u8 = 8;
/// Overlap that counts as deep, in slops. From here on, a whole pass is worth the time even in an island that is
/// still moving. With 10, a heap at one point takes more than a second to come apart; with 100, overlaps between
/// bodies are twice as deep.
const DEEP_SLOPS: f32 = 30.0;
/// Replaces [`LAYERS`] around other overlaps in such an island.
const LIGHT_LAYERS: u8 = 2;
/// Number of sweeps by colour in a pass over such an island. With 6, a heap at one point takes more than a
/// second to come apart.
const LIGHT_SWEEPS: u32 = 12;

#[derive(Clone, Debug, Default)]
pub(crate) struct PositionCorrection {
    /// Contacts close enough to take part in a pass, and their movable bodies.
    close: Vec<u32>,
    ends: Vec<[u32; 2]>,
    /// By slot: distance of a movable body from an overlap, in contacts, if at most [`LAYERS`].
    layer: Vec<u8>,
    /// The contacts that take part, and the numbers that a pass temporarily replaces in each.
    taken: Vec<u32>,
    solved: Vec<Solved>,
    islands: Islands,
    pushes: Pushes,
    /// By slot: whether any pass moved a body.
    has_moved: Vec<bool>,
}

/// By slot: how the corrections moved a body.
struct Corrections<'a> {
    /// Path in the latest pass.
    path: &'a mut [Vec2],
    /// Whether any pass moved the body.
    ever: &'a mut [bool],
}

impl Corrections<'_> {
    fn begin_pass(&mut self) {
        self.path.fill(Vec2::ZERO);
    }

    /// Moves a body. Very different masses may cause an overflow here, so a position that is not finite is skipped.
    fn displace(&mut self, bodies: &mut Bodies, slot: usize, displacement: Vec2) {
        let position = bodies.center[slot] + displacement;
        if position.is_finite() {
            self.ever[slot] |= position != bodies.center[slot];
            self.path[slot] += position - bodies.center[slot];
            bodies.center[slot] = position;
        }
    }

    /// Moves all bodies by their paths, each by at most its half-size. Pushes ignore walls beyond a body's reach, and
    /// without this limit, small bodies among large ones were pushed through a wall. Very different masses may cause
    /// an overflow here, so a position that is not finite is skipped.
    fn apply(&mut self, bodies: &mut Bodies) {
        for (slot, path) in
            self.path.iter_mut().enumerate().filter(|(_, path)| **path != Vec2::ZERO)
        {
            *path = clamp_length(*path, bodies.thickness(slot));
            let position = bodies.center[slot] + *path;
            if position.is_finite() {
                bodies.center[slot] = position;
                self.ever[slot] = true;
            } else {
                *path = Vec2::ZERO;
            }
        }
    }

    /// The separation of a contact after this pass, along its normal.
    fn separation(&self, constraint: &ContactConstraint, info: &ContactInfo) -> f32 {
        let path = self.path[constraint.b as usize] - self.path[constraint.a as usize];
        info.separation_after + constraint.normal.dot(path)
    }

    /// Updates the separations of contacts whose bodies this pass moved.
    fn update_separations(&self, contacts: &mut ContactSet) {
        for (constraint, info) in contacts.constraints.iter().zip(&mut contacts.infos) {
            if self.path[constraint.a as usize] != self.path[constraint.b as usize] {
                info.separation_after = self.separation(constraint, info);
                info.exact = false;
            }
        }
    }
}

impl PositionCorrection {
    /// Separates overlapping bodies, island by island. On entry, `separation_after` of a contact is measured along
    /// its tangent. Contacts that take part in a pass, or overlap after a pass moved their bodies, get their exact
    /// normal and separation. Returns the number of contact visits by sweeps.
    pub fn separate(
        &mut self,
        bodies: &mut Bodies,
        contacts: &mut ContactSet,
        pairs: &[Pair],
        blocks: &mut Blocks,
        displacements: &mut Displacements,
        context: &StepContext,
    ) -> u64 {
        let settings = context.settings;
        let slots = bodies.alive.len();
        let Displacements { weight: displacement, path, .. } = displacements;
        displacement.fill(Vec2::ZERO);
        let mut has_moved = std::mem::take(&mut self.has_moved);
        has_moved.clear();
        has_moved.resize(slots, false);
        let mut moved = Corrections { path, ever: &mut has_moved };
        let mut visits = 0;
        for pass in 0..settings.position_passes {
            if !self.find_overlaps(pass, bodies, contacts, pairs, settings) {
                break;
            }
            self.gather(bodies, contacts, pairs, settings);
            moved.begin_pass();
            self.islands.find(slots, &contacts.constraints, Some(&self.taken));
            for island in 0..self.islands.count() {
                visits +=
                    self.separate_island(island, pass, contacts, blocks, displacement, settings);
                self.apply_displacements(
                    island,
                    bodies,
                    contacts,
                    displacement,
                    &mut moved,
                    settings,
                );
            }
            for (&index, solved) in self.taken.iter().zip(&self.solved) {
                solved.restore(&mut contacts.constraints[index as usize]);
            }
            moved.update_separations(contacts);
        }
        visits += self.push_apart(bodies, contacts, pairs, &mut moved, context);
        let ContactSet { constraints, infos } = contacts;
        for (constraint, info) in constraints.iter_mut().zip(infos) {
            let has_moved = moved.ever[constraint.a as usize] || moved.ever[constraint.b as usize];
            let is_single = info.correction == Correction::Singly;
            if has_moved && !is_single && info.separation_after < 0.0 {
                find_exact(bodies, constraint, info, pairs);
            }
        }
        moved.begin_pass();
        self.has_moved = has_moved;
        visits
    }

    /// Pushes overlapping pairs apart one by one, in a few rounds, along the normals at their current positions. Each
    /// push removes the whole overlap. This is done only in islands that the passes leave unsolved. Returns the cost
    /// in visits.
    fn push_apart(
        &mut self,
        bodies: &mut Bodies,
        contacts: &mut ContactSet,
        pairs: &[Pair],
        moved: &mut Corrections,
        context: &StepContext,
    ) -> u64 {
        let settings = context.settings;
        if settings.position_passes == 0 {
            return 0;
        }
        let slop = settings.slop * PUSHED_FROM;
        self.pushes.clear();
        let ContactSet { constraints, infos } = contacts;
        let mut any = false;
        for (constraint, info) in constraints.iter_mut().zip(infos.iter_mut()) {
            if info.correction == Correction::Thorough {
                continue;
            }
            if info.separation_after < -slop {
                find_exact(bodies, constraint, info, pairs);
            }
            if info.separation_after < settings.correction_max {
                self.pushes.add(constraint, info);
                any |= info.separation_after < -slop;
            }
        }
        if !any {
            return 0;
        }
        moved.begin_pass();
        let limits = PushLimits { slop, distance_max: settings.correction_max };
        let visits = self.pushes.find_paths(moved.path, bodies, context.dt, limits);
        moved.apply(bodies);
        moved.update_separations(contacts);
        visits
    }

    /// Finds the displacements for a pass over an island. Returns the number of constraint visits.
    fn separate_island(
        &self,
        island: usize,
        pass: u32,
        contacts: &mut ContactSet,
        blocks: &mut Blocks,
        displacement: &mut [Vec2],
        settings: &Conjugate,
    ) -> u64 {
        let ContactSet { constraints, infos } = contacts;
        let indices = &self.islands.constraints[self.islands.range(island)];
        let (sweeps_limit, sequence) = match infos[indices[0] as usize].correction {
            Correction::Thorough => (SWEEPS_MAX, Sequence::Forests),
            Correction::Light | Correction::Singly => (LIGHT_SWEEPS, Sequence::Colors),
        };
        let visits = (settings.work_max / WORK_SHARE).min(VISITS_MAX) >> pass.min(31);
        let sweeps_max = (visits / indices.len() as u32).clamp(SWEEPS_MIN, sweeps_limit);
        let tolerance = max(POSITION_SHARE * settings.slop, POSITION_MIN);
        match sequence {
            Sequence::Colors => blocks.chains.find_none(indices),
            Sequence::Forests => blocks.chains.find(constraints, indices),
        }
        let limits =
            SweepLimits { tolerance, rounding: 0.0, sweeps_max, sequence, friction: false };
        blocks.swept.corrected += indices.len() as u64;
        let sweeps = sweep::solve(constraints, indices, blocks, displacement, limits);
        sweep::sweep_immovable(constraints, indices, displacement);
        u64::from(sweeps) * indices.len() as u64
    }

    /// Gathers the constraints that are only a few contacts away from an overlap, with displacements in place of
    /// velocities.
    fn gather(
        &mut self,
        bodies: &Bodies,
        contacts: &mut ContactSet,
        pairs: &[Pair],
        settings: &Conjugate,
    ) {
        let ContactSet { constraints, infos } = contacts;
        self.close.clear();
        self.ends.clear();
        for (index, (constraint, info)) in (0u32..).zip(constraints.iter().zip(infos.iter())) {
            if info.separation_after < settings.correction_max {
                push(&mut self.close, index);
                push(&mut self.ends, movable_ends(constraint));
            }
        }
        spread(&mut self.layer, &self.ends, LAYERS);
        self.taken.clear();
        self.solved.clear();
        for (&index, &[a, b]) in self.close.iter().zip(&self.ends) {
            let nearest = self.layer[a as usize].min(self.layer[b as usize]);
            if nearest < LAYERS || nearest == LAYERS && a == b {
                let (constraint, info) =
                    (&mut constraints[index as usize], &mut infos[index as usize]);
                find_exact(bodies, constraint, info, pairs);
                if info.separation_after < settings.correction_max {
                    push(&mut self.taken, index);
                    push(&mut self.solved, Solved::replace(constraint, info, settings));
                }
            }
        }
    }

    /// Sets the layer of bodies that overlap by more than the tolerance, and returns whether there are any.
    fn find_overlaps(
        &mut self,
        pass: u32,
        bodies: &Bodies,
        contacts: &mut ContactSet,
        pairs: &[Pair],
        settings: &Conjugate,
    ) -> bool {
        self.layer.clear();
        self.layer.resize(bodies.alive.len(), UNREACHED);
        let deep = DEEP_SLOPS * settings.slop;
        let mut any = false;
        let ContactSet { constraints, infos } = contacts;
        for (constraint, info) in constraints.iter_mut().zip(infos) {
            let tolerated = match (info.correction, pass) {
                (Correction::Thorough, _) | (Correction::Light, 0) => settings.slop,
                (Correction::Light, 1) => deep,
                (Correction::Light | Correction::Singly, _) => f32::INFINITY,
            };
            if info.separation_after >= -tolerated {
                continue;
            }
            find_exact(bodies, constraint, info, pairs);
            if info.separation_after < -tolerated {
                any = true;
                let is_thorough =
                    info.correction == Correction::Thorough || info.separation_after < -deep;
                let first = if is_thorough { 0 } else { LAYERS - LIGHT_LAYERS };
                for slot in movable_ends(constraint) {
                    let layer = &mut self.layer[slot as usize];
                    *layer = first.min(*layer);
                }
            }
        }
        any
    }

    /// Moves an island's bodies, each by at most the limit, since tangents say nothing about positions further away.
    fn apply_displacements(
        &self,
        island: usize,
        bodies: &mut Bodies,
        contacts: &ContactSet,
        displacement: &mut [Vec2],
        moved: &mut Corrections,
        settings: &Conjugate,
    ) {
        let limit = settings.correction_max;
        let indices = &self.islands.constraints[self.islands.range(island)];
        let slots = indices.iter().flat_map(|&index| {
            let constraint = &contacts.constraints[index as usize];
            [constraint.a as usize, constraint.b as usize]
        });
        let furthest =
            slots.clone().fold(0.0, |limit, slot| max(limit, displacement[slot].length()));
        let share = if furthest > limit { limit / furthest } else { 1.0 };
        for slot in slots {
            moved.displace(bodies, slot, displacement[slot] * share);
            displacement[slot] = Vec2::ZERO;
        }
    }
}

/// A constraint's numbers that a pass temporarily replaces.
#[derive(Clone, Copy, Debug)]
struct Solved {
    min_normal_velocity: f32,
    friction: f32,
    normal_impulse: f32,
    tangent_impulse: f32,
}

impl Solved {
    /// Turns a constraint into one that separates its bodies, or lets them close, by the distance permitted in a pass.
    fn replace(
        constraint: &mut ContactConstraint,
        info: &ContactInfo,
        settings: &Conjugate,
    ) -> Solved {
        let ContactConstraint { min_normal_velocity, friction, .. } = *constraint;
        let ContactConstraint { normal_impulse, tangent_impulse, .. } = *constraint;
        *constraint = ContactConstraint {
            min_normal_velocity: -allowed_closing(info.separation_after, settings),
            friction: 0.0,
            normal_impulse: 0.0,
            tangent_impulse: 0.0,
            normal_direction: 0.0,
            tangent_direction: 0.0,
            ..*constraint
        };
        Solved { min_normal_velocity, friction, normal_impulse, tangent_impulse }
    }

    fn restore(&self, constraint: &mut ContactConstraint) {
        let Solved { min_normal_velocity, friction, normal_impulse, tangent_impulse } = *self;
        *constraint = ContactConstraint {
            min_normal_velocity,
            friction,
            normal_impulse,
            tangent_impulse,
            ..*constraint
        };
    }
}

/// Distance by which a pair may close in a pass or, if negative, must separate.
#[inline]
fn allowed_closing(separation: f32, settings: &Conjugate) -> f32 {
    let allowed_closing = separation + settings.slop * SLOP_SHARE;
    if allowed_closing >= 0.0 {
        allowed_closing
    } else {
        max(allowed_closing * settings.correction, -settings.correction_max)
    }
}

/// Finds the normal and the separation of a contact at the current positions.
fn find_exact(
    bodies: &Bodies,
    constraint: &mut ContactConstraint,
    info: &mut ContactInfo,
    pairs: &[Pair],
) {
    if info.exact {
        return;
    }
    info.exact = true;
    match current_manifold(bodies, constraint, &pairs[constraint.pair as usize]) {
        Some(manifold) => {
            constraint.normal = manifold.normal;
            info.separation_after = manifold.separation;
        }
        // Two boxes pass each other around a corner.
        None => info.separation_after = f32::INFINITY,
    }
}

/// The manifold of a pair at its current positions. Bodies that overlap too deeply to tell their sides apart are
/// separated along the line of centres. In a heap at one point, this leads outwards, and in a row that fills its
/// container from wall to wall, slightly out of the row.
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

/// The movable bodies of a contact. If one is immovable, the other is listed twice, since an immovable body
/// transmits nothing.
#[inline]
fn movable_ends(constraint: &ContactConstraint) -> [u32; 2] {
    let [(a, inv_mass_a), (b, inv_mass_b)] = constraint.bodies();
    [if inv_mass_a > 0.0 { a } else { b }, if inv_mass_b > 0.0 { b } else { a }]
}

/// Finds the distances, in contacts with these ends, from the bodies whose `layer` is set beforehand; `layer` is
/// indexed by slot, and all other bodies start as [`UNREACHED`]. Bodies further away keep a value above
/// `distance_max`.
fn spread(layer: &mut [u8], ends: &[[u32; 2]], distance_max: u8) {
    // After n passes, all distances up to n are right. Usually a few passes find them all.
    for _ in 0..distance_max {
        let mut any = false;
        for &[a, b] in ends {
            let (before_a, before_b) = (layer[a as usize], layer[b as usize]);
            if before_a.abs_diff(before_b) > 1 {
                let nearest = before_a.min(before_b);
                layer[a as usize] = before_a.min(nearest + 1);
                layer[b as usize] = before_b.min(nearest + 1);
                any = true;
            }
        }
        if !any {
            return;
        }
    }
}
