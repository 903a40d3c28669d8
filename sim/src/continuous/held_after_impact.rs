//! Bodies that bounced within the step and are held by another contact after all.
//!
//! The path of a body that bounced at time t is extended backwards to the start of the step, to a
//! point behind the surface that reflected it, where it never was. That is right as long as the
//! body leaves at the speed of the bounce. If other constraints slow it down, h times its new speed
//! may not bring it out again. The body then gives up the start of its step: it stays where it
//! bounced, with the velocity it had there, and has a whole step ahead. It gains t of
//! simulated time; energy is kept, and no wall is crossed.

use super::impact_prediction::gravity_on;
use super::impact_queue::ImpactQueue;
use super::paths::Paths;
use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::continuous::paths::predict_manifold;
use crate::continuous::thin::{overlap_limit, thickness};
use crate::integrate::Displacements;
use crate::math::max;
use crate::narrow_phase::manifold::Manifold;
use crate::solver::contact_constraint::FAR;
use crate::solver::contact_constraint::{ContactConstraint, ContactInfo, ContactSet};
use crate::solver::step_context::StepContext;
use crate::solver::tolerances::OVERLAP;

/// Times that an island may be solved in a step; what is still wrong after that stays.
pub(crate) const ROUNDS_MAX: u32 = 5;

/// Finds such bodies in an island and renews their constraints; returns whether there were any.
pub(crate) fn resolve(
    bodies: &mut Bodies,
    contacts: &mut ContactSet,
    island: &[u32],
    pairs: &[Pair],
    impacts: &mut ImpactQueue,
    displacements: &mut Displacements,
    context: &StepContext,
) -> bool {
    if impacts.is_empty() {
        return false;
    }
    let allowed = OVERLAP + context.fall_distance();
    impacts.held.clear();
    for &index in island {
        let (constraint, info) =
            (&contacts.constraints[index as usize], &contacts.infos[index as usize]);
        let pair = &pairs[constraint.pair as usize];
        if impacts.paths.start_time(pair) <= 0.0 {
            continue;
        }
        let allowed = overlap_limit(thickness(bodies, pair), allowed);
        let closing = -constraint.normal.dot(constraint.relative_velocity(&bodies.velocity));
        if closing * context.dt > info.separation + allowed {
            for slot in [constraint.a, constraint.b] {
                hold_at_impact(bodies, slot as usize, impacts, displacements, context);
            }
        }
    }
    if impacts.held.is_empty() {
        return false;
    }
    for &index in island {
        let constraint = &mut contacts.constraints[index as usize];
        let info = &mut contacts.infos[index as usize];
        if impacts.held.contains(&constraint.a) || impacts.held.contains(&constraint.b) {
            let pair = &pairs[constraint.pair as usize];
            renew_contact(bodies, constraint, info, pair, &impacts.paths, context.dt);
        }
    }
    true
}

/// Resets a constraint to the present positions of its bodies.
fn renew_contact(
    bodies: &mut Bodies,
    constraint: &mut ContactConstraint,
    info: &mut ContactInfo,
    pair: &Pair,
    paths: &Paths,
    dt: f32,
) {
    release(bodies, constraint);
    let path = constraint.relative_velocity(&bodies.velocity) * dt;
    let manifold = predict_manifold(bodies, paths, pair, path, dt);
    let manifold = manifold.unwrap_or(Manifold { normal: constraint.normal, separation: FAR });
    constraint.normal = manifold.normal;
    constraint.min_normal_velocity = -max(manifold.separation, 0.0) / dt;
    info.separation = manifold.separation;
}

/// Takes back the impulses of a constraint.
fn release(bodies: &mut Bodies, constraint: &mut ContactConstraint) {
    let own = constraint.accumulated::<true>();
    constraint.apply(&mut bodies.velocity, -own);
    constraint.normal_impulse = 0.0;
    constraint.tangent_impulse = 0.0;
}

/// Moves a body to the position of its last impact.
fn hold_at_impact(
    bodies: &mut Bodies,
    slot: usize,
    impacts: &mut ImpactQueue,
    displacements: &mut Displacements,
    context: &StepContext,
) {
    let time = impacts.paths.impact_time[slot];
    if time <= 0.0 {
        return;
    }
    let gain = gravity_on(bodies, slot, context) * time;
    bodies.center[slot] = impacts.paths.impact_position[slot];
    bodies.velocity[slot] += gain;
    displacements.start_velocity[slot] += gain;
    impacts.paths.impact_time[slot] = 0.0;
    impacts.held.push(slot as u32);
}
