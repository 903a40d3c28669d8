//! A warm start begins with the previous step's impulses, scaled so that they cannot add energy.
//!
//! For impulses l, D(l) = l.(b - J v*) - l.A.l / 2 is the objective that the constraints maximise,
//! and the kinetic energy changes by l.b - D(l), where b <= 0. So impulses with D >= 0 never raise
//! the energy, and a sweep never lowers D. Along the stored impulses, D is a parabola c x - q x^2 /
//! 2, which is positive up to x = 2 c / q and greatest at x = c / q. If the world has not changed,
//! the stored impulses solve the new step, so c = q, and they are applied in full. Those from a
//! past impact are not applied again.

use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::tolerances::WARM_START_SHARE;
use glam::Vec2;

/// Applies the stored impulses of an island's constraints to the velocities, scaled back to a safe
/// share.
pub(crate) fn start<const FRICTION: bool>(
    constraints: &mut [ContactConstraint],
    island: &[u32],
    velocity: &mut [Vec2],
) {
    let (mut gain, mut before) = (0.0, 0.0);
    for &index in island {
        let constraint = &constraints[index as usize];
        gain += constraint.normal_impulse * constraint.min_normal_velocity;
        before += constraint.accumulated::<FRICTION>().dot(constraint.relative_velocity(velocity));
    }
    for &index in island {
        let constraint = &constraints[index as usize];
        constraint.apply(velocity, constraint.accumulated::<FRICTION>());
    }
    let mut after = 0.0;
    for &index in island {
        let constraint = &constraints[index as usize];
        after += constraint.accumulated::<FRICTION>().dot(constraint.relative_velocity(velocity));
    }
    // c = l.(b - J v*), q = l.A.l = l.J(v - v*).
    let (slope, curve) = (gain - before, after - before);
    if slope >= WARM_START_SHARE * curve {
        return;
    }
    let share = if slope > 0.0 { slope / curve } else { 0.0 };
    for &index in island {
        let constraint = &mut constraints[index as usize];
        constraint.apply(velocity, constraint.accumulated::<FRICTION>() * (share - 1.0));
        constraint.normal_impulse *= share;
        constraint.tangent_impulse *= share;
    }
}
