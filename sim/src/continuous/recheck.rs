//! Constraints of fast pairs, checked again with the solved velocities.
//!
//! A constraint is the tangent of a shape where the velocities before the step would lead. Where a
//! step is longer than a body is large and another contact stops or deflects one of the two, they
//! end elsewhere: the tangent may push bodies that pass each other, and the pair may meet after
//! all. So for each such constraint the two are swept once more, as they would move if this
//! constraint alone did nothing. A pair that does not touch then is released; one that does is held
//! there. If anything changed the island is solved again (sequential convex programming, with the
//! sweep in place of the distance; Schulman et al. 2014, "Motion planning with sequential convex
//! optimization").

use super::paths::Paths;
use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::continuous::paths::predict_manifold;
use crate::math::max;
use crate::narrow_phase::separation::FAR;
use crate::shape::shapes;
use crate::solver::contact_constraint::{ContactConstraint, ContactInfo, ContactSet};
use crate::solver::tolerances::{OVERLAP, SAME_NORMAL};

/// Times that an island may be solved in a step; what is still wrong after that stays.
pub(crate) const ROUNDS_MAX: u32 = 5;

/// Rechecks the fast constraints of an island; returns whether any changed.
pub(crate) fn recheck_island(
    bodies: &mut Bodies,
    contacts: &mut ContactSet,
    island: &[u32],
    pairs: &[Pair],
    paths: &Paths,
    dt: f32,
) -> bool {
    let mut any = false;
    for &index in island {
        let info = &mut contacts.infos[index as usize];
        if info.fast {
            let constraint = &mut contacts.constraints[index as usize];
            let pair = &pairs[constraint.pair as usize];
            any |= recheck_contact(bodies, constraint, info, pair, paths, dt);
        }
    }
    any
}

/// Rechecks a constraint; returns whether it changed.
fn recheck_contact(
    bodies: &mut Bodies,
    constraint: &mut ContactConstraint,
    info: &mut ContactInfo,
    pair: &Pair,
    paths: &Paths,
    dt: f32,
) -> bool {
    let own = constraint.accumulated::<true>() / constraint.effective_mass;
    let path = (constraint.relative_velocity(&bodies.velocity) - own) * dt;
    let manifold = predict_manifold::<{ shapes::BOTH }>(bodies, paths, pair, path, dt);
    match manifold.filter(|manifold| manifold.separation + manifold.normal.dot(path) < -OVERLAP) {
        None if constraint.normal_impulse <= 0.0 => false,
        None => {
            release(bodies, constraint);
            constraint.min_normal_velocity = -FAR / dt;
            info.separation = FAR;
            true
        }
        Some(manifold)
            if constraint.normal_impulse > 0.0
                && manifold.normal.dot(constraint.normal) > SAME_NORMAL =>
        {
            false
        }
        Some(manifold) => {
            release(bodies, constraint);
            constraint.normal = manifold.normal;
            constraint.min_normal_velocity = -max(manifold.separation, 0.0) / dt;
            info.separation = manifold.separation;
            true
        }
    }
}

/// Takes back the impulses of a constraint.
pub(crate) fn release(bodies: &mut Bodies, constraint: &mut ContactConstraint) {
    let own = constraint.accumulated::<true>();
    constraint.apply(&mut bodies.velocity, -own);
    constraint.normal_impulse = 0.0;
    constraint.tangent_impulse = 0.0;
}
