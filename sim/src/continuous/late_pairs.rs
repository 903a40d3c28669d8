//! Late pairs are those without a constraint that the solved velocities bring together.
//!
//! Constraints are gathered for the velocities before the step. A body at rest that is hit hard may leave its reach
//! within the same step, and a fast one may be deflected towards another body. So once the velocities are solved,
//! bodies that outran their reach or may jump over another body are checked again. Every body is also checked
//! against immovable ones. For example, one corner of a narrow passage may deflect a ball towards the other corner,
//! which it would have passed on its earlier path. Pairs that would touch at the new velocities get a constraint,
//! and their islands are solved again from their current impulses.

use super::impact_prediction::restitution;
use super::paths::{Paths, is_fast, predict_manifold};
use crate::bodies::{Bodies, REACH_MIN};
use crate::broad_phase::pairs::{Pair, near};
use crate::forces::{Move, MoveKind};
use crate::math::max;
use crate::narrow_phase::Manifold;
use crate::shape::shapes;
use crate::solver::contact_constraint::{ContactConstraint, ContactSet, PackedBody, make_contact};
use crate::solver::step_context::StepContext;
use crate::solver::tolerances::OVERLAP;
use glam::Vec2;

/// Maximum number of rounds of late pairs in a step.
pub(crate) const ROUNDS_MAX: u32 = 3;

/// The constraints to add, and the bodies that outran their reach.
#[derive(Clone, Debug, Default)]
pub(crate) struct LatePairs {
    outruns_reach: Vec<bool>,
    /// By slot: whether the body outruns its reach or moves by more than the thinnest body's half-size. Only pairs
    /// with such a body can be late. `None` for bodies that the step does not move and may have left out.
    may_be_late: Vec<Option<bool>>,
    /// Whether any island is in motion.
    pub any_in_motion: bool,
    /// By slot: whether its island is in motion. Pairs of such bodies are not added; the next step detects their
    /// overlaps.
    is_in_motion: Vec<bool>,
    late: ContactSet,
    /// By constraint: whether it is new. Islands with a new constraint are solved again.
    pub is_new: Vec<bool>,
}

impl LatePairs {
    /// Begins a step, in which no island is in motion yet.
    pub fn begin(&mut self, slots: usize) {
        self.any_in_motion = false;
        self.is_in_motion.clear();
        self.is_in_motion.resize(slots, false);
    }

    /// Records that the bodies of this island move past each other.
    pub fn note_motion(&mut self, constraints: &[ContactConstraint], island: &[u32]) {
        self.any_in_motion = true;
        for &index in island {
            for (slot, inv_mass) in constraints[index as usize].bodies() {
                self.is_in_motion[slot as usize] |= inv_mass > 0.0;
            }
        }
    }

    /// Extends the reach of bodies that became faster, and returns whether any body moves.
    pub fn extend_reach(&mut self, bodies: &mut Bodies, moves: &[Move], dt: f32) -> bool {
        self.outruns_reach.clear();
        self.outruns_reach.resize(bodies.alive.len(), false);
        self.may_be_late.clear();
        self.may_be_late.resize(bodies.alive.len(), None);
        let thinnest = bodies.thinnest();
        let Bodies { moving, velocity, reach, .. } = bodies;
        let mut any = false;
        for &slot in moving.iter() {
            let slot = slot as usize;
            let path = velocity[slot].length() * dt;
            // The other half of the smallest reach is reserved for the motion of other bodies.
            if path > reach[slot] - REACH_MIN * 0.5 {
                reach[slot] = REACH_MIN + path;
                self.outruns_reach[slot] = true;
            }
            // A vector's length may be rounded to less than its longest component.
            let speed = velocity[slot].abs();
            let is_fast = path > thinnest || max(speed.x, speed.y) * dt > thinnest;
            self.may_be_late[slot] = Some(self.outruns_reach[slot] || is_fast);
            any |= path > 0.0;
        }
        for found in moves {
            // A spring may take a body further than either of its velocities would.
            let (slot, path) = (found.slot as usize, found.path.length());
            let is_far = path > reach[slot] - REACH_MIN * 0.5;
            if is_far || !matches!(found.kind, MoveKind::Smooth) {
                reach[slot] = max(reach[slot], REACH_MIN + path);
                self.outruns_reach[slot] = true;
                self.may_be_late[slot] = Some(true);
                any = true;
            }
        }
        any
    }

    /// Adds constraints for pairs that would touch, and returns whether there are any.
    pub fn gather(
        &mut self,
        bodies: &Bodies,
        pairs: &[Pair],
        paths: &Paths,
        context: &StepContext,
        contacts: &mut ContactSet,
    ) -> bool {
        let (dt, threshold) = (context.dt, context.settings.bounce_threshold);
        self.late.clear();
        let mut known = contacts.constraints.iter().map(|constraint| constraint.pair).peekable();
        for (index, pair) in (0u32..).zip(pairs) {
            if known.next_if_eq(&index).is_some() {
                continue;
            }
            let (a, b) = (pair.a as usize, pair.b as usize);
            if self.is_in_motion[a] && self.is_in_motion[b] {
                // See `is_in_motion`. Most pairs in a crowd are dismissed here.
                continue;
            }
            let path = (bodies.velocity[b] - bodies.velocity[a]) * dt;
            let may_be_late =
                self.may_be_late(bodies, pair, dt) || self.ends_in_wall(bodies, pair, path);
            if !may_be_late || !near(bodies, pair.a, pair.b) {
                continue;
            }
            let manifold = predict_manifold(bodies, paths, pair, path, dt);
            let overlaps = |manifold: &Manifold| {
                let along = manifold.normal.dot(path);
                // A flying body ends up above the path of its final velocity, and bounces in the next step.
                let bounces = -along > threshold * dt && restitution(bodies, pair) > 0.0;
                let fallen = if bounces { context.fall_distance() } else { 0.0 };
                manifold.separation + along < -OVERLAP - fallen
            };
            if let Some(manifold) = manifold.filter(overlaps) {
                let [a, b] = [pair.a, pair.b].map(|slot| PackedBody::of(bodies, slot));
                let (constraint, info) =
                    make_contact::<{ shapes::BOTH }>([&a, &b], pair, index, manifold, dt);
                // The impulse stored by the previous step was not applied in this one.
                let constraint =
                    ContactConstraint { normal_impulse: 0.0, tangent_impulse: 0.0, ..constraint };
                self.late.push(constraint, info);
            }
        }
        if self.late.constraints.is_empty() {
            return false;
        }
        self.merge(contacts);
        true
    }

    /// Whether one body of a pair outran its reach, or may have jumped over the other.
    fn may_be_late(&self, bodies: &Bodies, pair: &Pair, dt: f32) -> bool {
        let (a, b) = (pair.a as usize, pair.b as usize);
        (self.may_be_late[a] == Some(true) || self.may_be_late[b] == Some(true))
            && (self.outruns_reach[a] || self.outruns_reach[b] || is_fast(bodies, pair, dt, 1.0))
    }

    /// Whether a contact may have deflected a body into an immovable one. This is so if their boxes overlap at the
    /// end of the step and neither body is in an island in motion.
    fn ends_in_wall(&self, bodies: &Bodies, pair: &Pair, path: Vec2) -> bool {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let end = (bodies.center[b] - bodies.center[a] + path).abs();
        let reach = bodies.half[a] + bodies.half[b];
        let has_wall = bodies.inverse_mass[a] == 0.0 || bodies.inverse_mass[b] == 0.0;
        let in_motion = self.is_in_motion[a] || self.is_in_motion[b];
        let moves = self.may_be_late[a].or(self.may_be_late[b]).is_some() && path != Vec2::ZERO;
        let may_meet = has_wall && moves && !in_motion;
        may_meet && end.x < reach.x && end.y < reach.y
    }

    /// Merges the late constraints into the others, back to front, in (a, b) order.
    fn merge(&mut self, contacts: &mut ContactSet) {
        let mut from = contacts.constraints.len();
        let mut to = from + self.late.constraints.len();
        contacts.reserve(to);
        let ContactSet { constraints, infos } = contacts;
        constraints.extend_from_slice(&self.late.constraints);
        infos.extend_from_slice(&self.late.infos);
        self.is_new.clear();
        self.is_new.resize(to, false);
        for (late, info) in self.late.constraints.iter().zip(&self.late.infos).rev() {
            while from > 0 && constraints[from - 1].pair > late.pair {
                (from, to) = (from - 1, to - 1);
                (constraints[to], infos[to]) = (constraints[from], infos[from]);
            }
            to -= 1;
            (constraints[to], infos[to], self.is_new[to]) = (*late, *info, true);
        }
    }
}

/// Updates the pair indices of constraints after the pair list was rebuilt.
pub(crate) fn reindex_pairs(constraints: &mut [ContactConstraint], pairs: &[Pair]) {
    let mut index = 0;
    for constraint in constraints {
        while (pairs[index].a, pairs[index].b) < (constraint.a, constraint.b) {
            index += 1;
        }
        constraint.pair = index as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::broad_phase::pairs::Axis;
    use crate::shape::Shape;
    use crate::solver::settings::Conjugate;
    use crate::world::{BodyDef, World, WorldSettings};

    #[test]
    fn a_late_pair_starts_without_an_impulse() {
        let mut world = World::new(WorldSettings::default());
        for (x, speed) in [(0.0, 100.0), (3.0, -100.0)] {
            let (position, velocity) = (Vec2::new(x, 0.0), Vec2::new(speed, 0.0));
            let def =
                BodyDef { shape: Shape::circle(1.0), position, velocity, ..BodyDef::default() };
            world.add(&def).expect("there is room");
        }
        let mut bodies = world.bodies.clone();
        let (mut late_pairs, mut paths, dt) = (LatePairs::default(), Paths::default(), 1.0 / 60.0);
        paths.impact_time.resize(2, 0.0);
        late_pairs.begin(2);
        assert!(late_pairs.extend_reach(&mut bodies, &[], dt));
        let pair = Pair { a: 0, b: 1, normal_impulse: 5.0, tangent_impulse: 1.0, axis: Axis::Free };
        let (mut contacts, settings) = (ContactSet::default(), Conjugate::default());
        let context = StepContext::new(&settings, world.settings());
        assert!(late_pairs.gather(&bodies, &[pair], &paths, &context, &mut contacts));
        let constraints = &contacts.constraints;
        assert_eq!(
            (constraints.len(), constraints[0].normal_impulse, constraints[0].tangent_impulse),
            (1, 0.0, 0.0)
        );
    }
}
