//! Distances of bodies in contacts.

use crate::solver::contact_constraint::ContactConstraint;

/// Distance of a body that was not reached.
pub(crate) const UNREACHED: u8 = u8::MAX;

/// The movable bodies of a contact; twice the same one if the other is immovable, which passes
/// nothing on.
#[inline]
pub(crate) fn movable_ends(constraint: &ContactConstraint) -> [u32; 2] {
    let [(a, inv_mass_a), (b, inv_mass_b)] = constraint.bodies();
    [if inv_mass_a > 0.0 { a } else { b }, if inv_mass_b > 0.0 { b } else { a }]
}

/// Finds the distances, in contacts with these ends, up to `distance_max` from the bodies whose
/// `layer`, by slot, is set before; all others are [`UNREACHED`]. Those further away stay further
/// away than `distance_max`.
pub(crate) fn spread(layer: &mut [u8], ends: &[[u32; 2]], distance_max: u8) {
    // After n passes all distances up to n are right, and usually all of them after a few.
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
