//! A pair in a relaxation step, with its contact at the current positions and the impulses applied so far.

use crate::bodies::Bodies;
use crate::broad_phase::pairs::Pair;
use crate::math::{max, min};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::overlap::{overlap_of, separation_along, spread_circles};
use crate::shape::shapes;
use crate::solver::tolerances::SAME_FACE;
use glam::Vec2;

/// A pair that takes part in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RelaxationConstraint {
    pub a: u32,
    pub b: u32,
    /// Index in the pair list.
    pub pair: u32,
    /// Values of [`Bodies::moves`] for which `normal` and `separation` are valid.
    pub moves_a: u32,
    pub moves_b: u32,
    /// Inverse masses of the two bodies.
    pub inv_mass_a: f32,
    pub inv_mass_b: f32,
    /// Effective mass: 1 / (sum of the inverse masses).
    pub effective_mass: f32,
    /// Coulomb coefficient of the pair, which is the geometric mean.
    pub friction: f32,
    /// Restitution of the pair, which is the smaller value.
    pub restitution: f32,
    /// Normal from a to b of the latest contact or, before the first contact, of the warm start.
    pub normal: Vec2,
    /// Normal along which the impulses were applied.
    pub impulse_normal: Vec2,
    /// Separation, world units. It is negative while the two overlap, and 0 while they are apart.
    pub separation: f32,
    /// Largest closing speed so far in this step, units/s; not negative.
    pub closing: f32,
    /// Normal impulse that holds the pair apart; later passes may reduce it to 0.
    pub normal_impulse: f32,
    /// Normal impulse spent on bounces, which is final.
    pub bounce_impulse: f32,
    /// Friction impulse, along the normal rotated 90 degrees to the left.
    pub tangent_impulse: f32,
}

impl RelaxationConstraint {
    #[inline]
    pub fn new<const SHAPES: u8>(
        bodies: &Bodies,
        pair: &Pair,
        index: u32,
        warm_normal: Vec2,
    ) -> RelaxationConstraint {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let (material_a, material_b) = (bodies.material[a], bodies.material[b]);
        let (inv_mass_a, inv_mass_b) = (bodies.inverse_mass[a], bodies.inverse_mass[b]);
        let mut constraint = RelaxationConstraint {
            a: pair.a,
            b: pair.b,
            pair: index,
            moves_a: 0,
            moves_b: 0,
            inv_mass_a,
            inv_mass_b,
            effective_mass: 1.0 / (inv_mass_a + inv_mass_b),
            friction: (material_a.friction * material_b.friction).sqrt(),
            restitution: min(material_a.restitution, material_b.restitution),
            normal: warm_normal,
            impulse_normal: warm_normal,
            separation: 0.0,
            closing: 0.0,
            normal_impulse: pair.normal_impulse,
            bounce_impulse: 0.0,
            tangent_impulse: pair.tangent_impulse,
        };
        constraint.update_manifold::<SHAPES>(bodies, &bodies.center);
        constraint
    }

    /// Finds the manifold at the current positions; `start` holds the positions before the passes.
    #[inline]
    pub fn update_manifold<const SHAPES: u8>(&mut self, bodies: &Bodies, start: &[Vec2]) {
        self.moves_a = bodies.moves[self.a as usize];
        self.moves_b = bodies.moves[self.b as usize];
        self.separation = 0.0;
        if let Some(manifold) = overlap_of::<SHAPES>(bodies, self.a, self.b) {
            let manifold = if self.is_free() {
                spread_circles(bodies, (self.a, self.b), manifold)
            } else {
                self.on_its_side(bodies, start, manifold)
            };
            self.normal = manifold.normal;
            self.separation = manifold.separation;
        }
    }

    /// Returns the manifold of a body and an immovable one on the side where the body was before the passes. Other
    /// bodies may have pushed it past the middle of a wall, but it must not leave on the far side.
    #[cold]
    pub fn on_its_side(&self, bodies: &Bodies, start: &[Vec2], manifold: Manifold) -> Manifold {
        let began = start[self.b as usize] - start[self.a as usize];
        if manifold.normal.dot(began) >= 0.0 {
            return manifold;
        }
        let normal = -manifold.normal;
        Manifold { normal, separation: separation_along(bodies, (self.a, self.b), normal) }
    }

    /// The same, but only if one of the bodies has moved since. The manifold is a pure function of the two positions,
    /// and in a settled pile nothing moves.
    #[inline]
    pub fn refresh_manifold<const SHAPES: u8>(&mut self, bodies: &Bodies, start: &[Vec2]) {
        let moved_a = bodies.moves[self.a as usize] != self.moves_a;
        let moved_b = bodies.moves[self.b as usize] != self.moves_b;
        if moved_a || moved_b {
            self.update_manifold::<SHAPES>(bodies, start);
        }
    }

    /// Takes back impulses that were applied along another normal. If the contact between two boxes jumps from a top
    /// to a side, the load that it held must not become a push along the new normal. Afterwards the two close no
    /// faster than before; any other effect of the impulse is left for other contacts to take back.
    #[inline]
    pub fn undo_if_turned(&mut self, bodies: &mut Bodies) {
        let holds = self.normal_impulse > 0.0 || self.tangent_impulse != 0.0;
        if holds && self.impulse_normal.dot(self.normal) < SAME_FACE {
            self.undo(bodies);
        }
        self.impulse_normal = self.normal;
    }

    /// Takes back the impulses; see `undo_if_turned`.
    #[cold]
    pub fn undo(&mut self, bodies: &mut Bodies) {
        let leaving = self.relative_velocity(bodies).dot(self.impulse_normal);
        let most = max(leaving + self.closing, 0.0) * self.effective_mass;
        let share = if self.normal_impulse > most { most / self.normal_impulse } else { 1.0 };
        let applied = self.impulse_normal * self.normal_impulse
            + self.impulse_normal.perp() * self.tangent_impulse;
        self.apply(bodies, applied * -share);
        self.normal_impulse = 0.0;
        self.tangent_impulse = 0.0;
    }

    /// Finds the manifold at the end of the step.
    pub fn finish(&mut self, bodies: &Bodies) {
        self.refresh_manifold::<{ shapes::BOTH }>(bodies, &bodies.center);
    }

    /// The movable body of a pair, followed by the immovable one.
    pub fn ends(&self) -> (u32, u32) {
        if self.inv_mass_a > 0.0 { (self.a, self.b) } else { (self.b, self.a) }
    }

    /// Both bodies with their inverse masses.
    pub fn bodies(&self) -> [(u32, f32); 2] {
        [(self.a, self.inv_mass_a), (self.b, self.inv_mass_b)]
    }

    /// Whether both bodies can be pushed.
    #[inline]
    pub fn is_free(&self) -> bool {
        self.inv_mass_a > 0.0 && self.inv_mass_b > 0.0
    }

    /// Velocity of b relative to a.
    #[inline]
    pub fn relative_velocity(&self, bodies: &Bodies) -> Vec2 {
        bodies.velocity[self.b as usize] - bodies.velocity[self.a as usize]
    }

    /// Applies an impulse to b, and the opposite impulse to a.
    #[inline]
    pub fn apply(&self, bodies: &mut Bodies, impulse: Vec2) {
        bodies.velocity[self.a as usize] -= impulse * self.inv_mass_a;
        bodies.velocity[self.b as usize] += impulse * self.inv_mass_b;
    }
}
