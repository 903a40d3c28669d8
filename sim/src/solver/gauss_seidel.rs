//! Gauss-Seidel solves contact constraints one by one. For each, it finds first the normal impulse that stops the
//! two bodies from closing too fast, and then friction, whose limit is known by then (Moreau 1988; Jean 1999).

use super::contact_constraint::ContactConstraint;
use crate::math::{clamp, max, without_dust};
use glam::Vec2;

/// The changes made by a sweep.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SweepChange {
    /// Largest change in a relative velocity, units/s.
    pub worst: f32,
    /// |d|^2.
    pub squared: f32,
}

impl SweepChange {
    /// Counts a constraint that changed a relative velocity by up to `off`.
    #[inline]
    pub fn count<const FRICTION: bool>(&mut self, constraint: &ContactConstraint, off: f32) {
        let normal = constraint.normal_impulse - constraint.normal_before;
        let tangent =
            if FRICTION { constraint.tangent_impulse - constraint.tangent_before } else { 0.0 };
        let squared = if FRICTION { normal * normal + tangent * tangent } else { normal * normal };
        self.worst = max(self.worst, off);
        self.squared += squared * (constraint.inv_mass_a + constraint.inv_mass_b);
    }
}

/// Solves both impulses of a constraint. The normal impulse leaves the sliding velocity unchanged, since nothing
/// rotates, so the velocities are read only once. Returns the largest change in a relative velocity.
#[inline]
pub(crate) fn solve_contact<const FRICTION: bool>(
    constraint: &mut ContactConstraint,
    velocity: &mut [Vec2],
) -> f32 {
    let relative = constraint.relative_velocity(velocity);
    let excess = constraint.normal.dot(relative) - constraint.min_normal_velocity;
    let normal = max(constraint.normal_impulse - excess * constraint.effective_mass, 0.0);
    let normal_change = normal - constraint.normal_impulse;
    constraint.normal_impulse = normal;
    let tangent_change = if FRICTION { apply_friction(constraint, relative) } else { 0.0 };
    constraint.apply(velocity, constraint.impulse_of::<FRICTION>(normal_change, tangent_change));
    let change =
        if FRICTION { max(normal_change.abs(), tangent_change.abs()) } else { normal_change.abs() };
    change * (constraint.inv_mass_a + constraint.inv_mass_b)
}

/// The largest change in a relative velocity that [`solve_contact`] would make, units/s.
#[inline]
pub(crate) fn visit_change(constraint: &ContactConstraint, velocity: &[Vec2]) -> f32 {
    let relative = constraint.relative_velocity(velocity);
    let excess = constraint.normal.dot(relative) - constraint.min_normal_velocity;
    let normal = max(constraint.normal_impulse - excess * constraint.effective_mass, 0.0);
    let slide = without_dust(constraint.normal.perp().dot(relative));
    let wanted = constraint.tangent_impulse - slide * constraint.effective_mass;
    let tangent = limited(wanted, constraint.friction * normal);
    let normal_change = (normal - constraint.normal_impulse).abs();
    let change = max(normal_change, (tangent - constraint.tangent_impulse).abs());
    change * (constraint.inv_mass_a + constraint.inv_mass_b)
}

/// Solves the friction of a constraint whose normal impulse is known. Returns the change in the
/// sliding velocity.
#[inline]
pub(crate) fn solve_friction(constraint: &mut ContactConstraint, velocity: &mut [Vec2]) -> f32 {
    if constraint.friction * constraint.normal_impulse <= 0.0 && constraint.tangent_impulse == 0.0 {
        return 0.0;
    }
    let change = apply_friction(constraint, constraint.relative_velocity(velocity));
    constraint.apply(velocity, constraint.normal.perp() * change);
    change.abs() * (constraint.inv_mass_a + constraint.inv_mass_b)
}

/// Applies friction opposing a relative velocity; returns the change in the friction impulse.
#[inline]
fn apply_friction(constraint: &mut ContactConstraint, relative: Vec2) -> f32 {
    let limit = constraint.friction * constraint.normal_impulse;
    let slide = without_dust(constraint.normal.perp().dot(relative));
    let tangent = limited(constraint.tangent_impulse - slide * constraint.effective_mass, limit);
    let change = tangent - constraint.tangent_impulse;
    constraint.tangent_impulse = tangent;
    change
}

/// Limits a friction impulse. Never returns -0, so that a limit of 0 leaves no trace. A NaN limit, caused by an
/// infinite impulse without friction, also counts as 0.
#[inline]
pub(crate) fn limited(tangent: f32, limit: f32) -> f32 {
    if limit > 0.0 { clamp(tangent, -limit, limit) + 0.0 } else { 0.0 }
}
