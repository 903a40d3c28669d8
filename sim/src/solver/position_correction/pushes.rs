//! Pushes overlapping pairs apart along the normals at their current positions, where bodies slide past each other.

use crate::bodies::Bodies;
use crate::growth::push;
use crate::math::{max, min};
use crate::solver::contact_constraint::{ContactConstraint, ContactInfo};
use glam::Vec2;

/// Maximum number of rounds over all pairs, in which each is pushed apart by its whole overlap. With more
/// rounds, a compressed heap takes longer to come apart.
const ROUNDS: u32 = 6;
/// Number of sweeps over the pairs whose overlap or distance is at most [`SHALLOW_SLOPS`] slops, and which move past
/// each other by no more than that in a step. This keeps a crowd that comes to rest within the slop.
const SHALLOW_SWEEPS: u32 = 12;
const SHALLOW_SLOPS: f32 = 4.0;
/// Factor applied to the steps of these sweeps (successive over-relaxation), and the number of final sweeps with whole
/// steps.
const FACTOR: f32 = 1.7;
const LAST_SWEEPS: u32 = 2;
/// Share of the slop to which a push reduces an overlap. With 0.9 or 0.98, more crushed crowds end up beyond the slop.
const SLOP_LEFT: f32 = 0.95;
/// Number of pushes that take as long as one visit of a pass.
const PER_VISIT: u64 = 8;

/// The 28 bytes of a contact's data that pushes read.
#[derive(Clone, Copy, Debug)]
struct Push {
    a: u32,
    b: u32,
    normal: Vec2,
    /// Separation before the pushes.
    separation: f32,
    /// Share of a displacement by which `a` moves, in [0, 1]; `b` moves by the rest.
    share: f32,
    /// Distance by which the sweeps have moved the two apart; not negative.
    distance: f32,
}

impl Push {
    /// Separation after the bodies have moved by these paths.
    #[inline]
    fn separation(&self, path: &[Vec2]) -> f32 {
        let path = path[self.b as usize] - path[self.a as usize];
        self.separation + self.normal.dot(path)
    }

    /// Moves the two apart.
    #[inline]
    fn apply(&self, path: &mut [Vec2], distance: f32) {
        let push = self.normal * distance;
        path[self.a as usize] -= push * self.share;
        path[self.b as usize] += push * (1.0 - self.share);
    }
}

/// Limits on pushes, world units.
#[derive(Clone, Copy, Debug)]
pub(super) struct PushLimits {
    /// Overlap beyond which a pair is pushed.
    pub slop: f32,
    /// Longest push in a round.
    pub distance_max: f32,
}

/// The pairs that may be pushed apart in a step.
#[derive(Clone, Debug, Default)]
pub(super) struct Pushes {
    pushes: Vec<Push>,
}

impl Pushes {
    pub fn clear(&mut self) {
        self.pushes.clear();
    }

    /// Adds a contact's pair.
    pub fn add(&mut self, constraint: &ContactConstraint, info: &ContactInfo) {
        let ContactConstraint { a, b, normal, inv_mass_a, inv_mass_b, .. } = *constraint;
        let share = inv_mass_a / (inv_mass_a + inv_mass_b);
        let separation = info.separation_after;
        push(&mut self.pushes, Push { a, b, normal, separation, share, distance: 0.0 });
    }

    /// Finds the paths of the bodies, which must be 0 on entry. Returns the cost in visits.
    ///
    /// Islands are not treated separately, but an island in which no pair overlaps by more than the slop is left
    /// unchanged.
    pub fn find_paths(
        &mut self,
        path: &mut [Vec2],
        bodies: &Bodies,
        dt: f32,
        limits: PushLimits,
    ) -> u64 {
        let mut visits = 0;
        let mut is_left = true;
        for _ in 0..ROUNDS {
            visits += self.pushes.len() as u64;
            is_left = self.push_each(path, limits);
            if !is_left {
                break;
            }
        }
        if is_left {
            let shallow = SHALLOW_SLOPS * limits.slop;
            self.pushes.retain(|push| {
                let [a, b] = [push.a as usize, push.b as usize];
                let passing = (bodies.velocity[b] - bodies.velocity[a]).length() * dt;
                push.separation(path).abs() < shallow && passing < shallow
            });
            for left in (0..SHALLOW_SWEEPS).rev() {
                visits += self.pushes.len() as u64;
                let factor = if left < LAST_SWEEPS { 1.0 } else { FACTOR };
                if !self.sweep(path, limits, factor) {
                    break;
                }
            }
        }
        visits / PER_VISIT
    }

    /// Pushes each overlapping pair apart by its whole overlap, and returns whether there were any.
    fn push_each(&self, path: &mut [Vec2], PushLimits { slop, distance_max }: PushLimits) -> bool {
        let mut any = false;
        for push in &self.pushes {
            let separation = push.separation(path);
            if separation < -slop {
                any = true;
                push.apply(path, min(-separation - slop * SLOP_LEFT, distance_max));
            }
        }
        any
    }

    /// Moves each pair towards the smallest displacement that removes its overlap, and returns whether anything
    /// changed.
    fn sweep(
        &mut self,
        path: &mut [Vec2],
        PushLimits { slop, .. }: PushLimits,
        factor: f32,
    ) -> bool {
        let mut any = false;
        for push in &mut self.pushes {
            let separation = push.separation(path);
            if push.distance == 0.0 && separation >= -slop {
                continue;
            }
            let wanted = -separation - slop * SLOP_LEFT;
            let distance = max(push.distance + factor * wanted, 0.0);
            let change = distance - push.distance;
            push.distance = distance;
            if change != 0.0 {
                any = true;
                push.apply(path, change);
            }
        }
        any
    }
}
