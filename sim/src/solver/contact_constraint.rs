//! Contact constraints are the solver's data for every pair that may touch within the step.
//!
//! A constraint makes two demands on the velocities at the end of the step. Along the normal, the bodies may close by
//! no more than their separation: n.(vb - va) >= -s / h, enforced by an impulse that only pushes. Across it, Coulomb
//! friction opposes sliding with at most mu times that impulse. Pairs that are still apart also have constraints
//! (speculative contacts; Catto 2013, "Continuous collision"), so that a body lands exactly and nothing overlaps. A
//! constraint without an impulse costs one comparison per sweep.

use crate::bodies::Bodies;
use crate::broad_phase::pairs::{Axis, Pair};
use crate::continuous::paths::{Paths, predict_manifold};
use crate::growth::{push, reserve};
use crate::math::{max, min};
use crate::narrow_phase::Manifold;
use crate::narrow_phase::separation::{self, PlacedShape};
use crate::shape::{Shape, shapes};
use crate::solver::tolerances::{DEEP_SHARE, ROUNDING, SLIDING, SPECULATIVE};
use glam::Vec2;

/// Number of deep contacts that a body keeps in any case. Beyond this, a contact is dropped if the other body has as
/// many.
const DEEP_CONTACTS_MAX: u8 = 32;

/// A pair's data that a sweep reads and writes. It fits in one cache line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactConstraint {
    pub a: u32,
    pub b: u32,
    /// Unit vector from a to b. Friction acts along this vector rotated 90 degrees to the left.
    pub normal: Vec2,
    /// Smallest allowed relative speed along the normal, units/s; not positive.
    pub min_normal_velocity: f32,
    /// Effective mass: 1 / (sum of the inverse masses).
    pub effective_mass: f32,
    pub inv_mass_a: f32,
    pub inv_mass_b: f32,
    /// Coulomb coefficient, the geometric mean of both bodies' values.
    pub friction: f32,
    /// Accumulated impulses of this step, along the normal (not negative) and across it.
    pub normal_impulse: f32,
    pub tangent_impulse: f32,
    /// Values of the impulses before the last sweep.
    pub normal_before: f32,
    pub tangent_before: f32,
    /// The search direction of the conjugate gradients.
    pub normal_direction: f32,
    pub tangent_direction: f32,
    /// Index of the pair in the pair list.
    pub pair: u32,
}

/// A constraint's data that sweeps do not need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactInfo {
    /// Distance by which the two may close along the normal, world units; negative if they overlap.
    pub separation: f32,
    /// Separation after the bodies have moved, measured along the normal and therefore never more than the distance
    /// between the shapes.
    pub separation_after: f32,
    /// Whether `separation_after` and the normal are valid for the shapes at their current positions.
    pub exact: bool,
    /// Largest closing speed in this step, units/s; not negative.
    pub closing: f32,
    /// Whether the two bounced in this step.
    pub bounced: bool,
    /// Whether the two slid on each other in the previous step.
    pub slid: bool,
    /// How a remaining overlap is corrected.
    pub correction: Correction,
}

/// Share of the slop beyond which overlaps are pushed apart. What rounding leaves behind stays below it.
pub(crate) const PUSHED_FROM: f32 = 0.999;

impl ContactInfo {
    /// Returns the overlap that may remain. Resting bodies are not pushed, and may rest at exactly the slop.
    pub fn tolerated(&self, slop: f32) -> f32 {
        match self.correction {
            Correction::Thorough => slop,
            Correction::Light | Correction::Singly => slop * PUSHED_FROM,
        }
    }
}

/// How the positions of an island are corrected; see `position_correction`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Correction {
    /// In several passes, until only the slop is left.
    Thorough,
    /// With little time spent on small overlaps, because the bodies are still moving and the next step will see
    /// other overlaps. The rest is pushed apart contact by contact.
    Light,
    /// Only contact by contact, because the bodies slide past each other.
    Singly,
}

/// A step's contact constraints in (a, b) order, with hot and cold data kept apart.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactSet {
    /// Data read and written by every sweep.
    pub constraints: Vec<ContactConstraint>,
    /// The remaining data, one entry per constraint.
    pub infos: Vec<ContactInfo>,
}

impl ContactSet {
    pub fn clear(&mut self) {
        self.constraints.clear();
        self.infos.clear();
    }

    #[inline]
    pub fn push(&mut self, constraint: ContactConstraint, info: ContactInfo) {
        push(&mut self.constraints, constraint);
        push(&mut self.infos, info);
    }

    /// Makes room for `len` constraints.
    pub fn reserve(&mut self, len: usize) {
        reserve(&mut self.constraints, len);
        reserve(&mut self.infos, len);
    }

    /// Drops the constraints of bodies whose position or velocity is not finite. Such bodies have no contacts and
    /// leave the world at the end of the step.
    #[cold]
    pub fn drop_non_finite(&mut self, bodies: &Bodies) {
        let is_finite = |constraint: &ContactConstraint| {
            bodies.is_finite(constraint.a as usize) && bodies.is_finite(constraint.b as usize)
        };
        let mut kept = self.constraints.iter().map(is_finite);
        self.infos.retain(|_| kept.next().is_some_and(|kept| kept));
        self.constraints.retain(is_finite);
    }
}

#[derive(Clone, Debug, Default)]
pub(crate) struct GatherScratch {
    packed: Vec<PackedBody>,
    /// By slot: number of contacts in which the body is too deep inside another one to tell the sides apart.
    deep_contacts: Vec<u8>,
}

/// Constants for a step, on which constraints depend.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GatherStep {
    /// Length of the step, seconds.
    pub dt: f32,
    /// Distance that a body falls in the step, world units.
    pub fall: f32,
}

/// The data about a body that gathering reads, packed into 40 bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedBody {
    center: Vec2,
    velocity: Vec2,
    half: Vec2,
    reach: f32,
    inv_mass: f32,
    friction: f32,
    is_circle: bool,
    takes_no_part: bool,
    /// Whether the body had an impact in the step, which bends its path.
    is_impacted: bool,
}

impl PackedBody {
    pub fn of(bodies: &Bodies, slot: u32) -> PackedBody {
        let slot = slot as usize;
        PackedBody {
            center: bodies.center[slot],
            velocity: bodies.velocity[slot],
            half: bodies.half[slot],
            reach: bodies.reach[slot],
            inv_mass: bodies.inverse_mass[slot],
            friction: bodies.material[slot].friction,
            is_circle: matches!(bodies.shape[slot], Shape::Circle { .. }),
            takes_no_part: false,
            is_impacted: false,
        }
    }

    /// Returns its shape in a world that has only these [`shapes`]. If there is only one kind, no lookup is needed.
    #[inline(always)]
    fn shape<const SHAPES: u8>(&self) -> Shape {
        let is_circle = SHAPES == shapes::CIRCLES || SHAPES != shapes::BOXES && self.is_circle;
        if is_circle {
            Shape::Circle { radius: self.half.x }
        } else {
            Shape::Box { half: self.half }
        }
    }

    #[inline(always)]
    fn placed<const SHAPES: u8>(&self, slot: u32) -> PlacedShape {
        PlacedShape { shape: self.shape::<SHAPES>(), center: self.center, slot }
    }

    #[inline(always)]
    fn thickness(&self) -> f32 {
        min(self.half.x, self.half.y)
    }
}

/// The two bodies of a contact.
type PackedPair<'a> = [&'a PackedBody; 2];

fn pack(bodies: &Bodies, takes_no_part: &[bool], paths: &Paths, packed: &mut Vec<PackedBody>) {
    packed.clear();
    packed.extend((0..bodies.alive.len()).map(|slot| PackedBody {
        takes_no_part: takes_no_part[slot],
        is_impacted: paths.impact_time[slot] != 0.0,
        ..PackedBody::of(bodies, slot as u32)
    }));
}

/// Gathers a step's constraints in (a, b) order, except between two bodies that [take no part], from the current
/// positions and the velocities before gravity and contacts act, in a world that has only these [`shapes`]. In a heap
/// at one point, the number of pairs grows with the square of the number of bodies, so there each body gets
/// [`DEEP_CONTACTS_MAX`] contacts, which separate first.
///
/// [take no part]: crate::steady::Steady::takes_no_part
/// [`shapes`]: crate::shape::shapes
pub(crate) fn gather<const SHAPES: u8>(
    bodies: &Bodies,
    pairs: &[Pair],
    takes_no_part: &[bool],
    paths: &Paths,
    step: GatherStep,
    contacts: &mut ContactSet,
    scratch: &mut GatherScratch,
) {
    let GatherStep { dt, fall } = step;
    contacts.clear();
    let GatherScratch { packed, deep_contacts } = scratch;
    pack(bodies, takes_no_part, paths, packed);
    deep_contacts.clear();
    deep_contacts.resize(bodies.alive.len(), 0);
    for (index, pair) in (0u32..).zip(pairs) {
        let [a, b] = [&packed[pair.a as usize], &packed[pair.b as usize]];
        let apart = (b.center - a.center).abs() - a.half - b.half;
        let reach = a.reach + b.reach;
        if a.takes_no_part && b.takes_no_part || !(apart.x < reach && apart.y < reach) {
            continue;
        }
        let path = (b.velocity - a.velocity) * dt;
        let manifold = if a.is_impacted || b.is_impacted {
            predict_manifold(bodies, paths, pair, path, dt)
        } else {
            // Their boxes stay further apart than the distance within which constraints are created.
            let thinnest = min(a.thickness(), b.thickness());
            let near = path.abs() + Vec2::splat(SPECULATIVE + fall + thinnest);
            if apart.x >= near.x || apart.y >= near.y {
                continue;
            }
            let [at_a, at_b] = [a.placed::<SHAPES>(pair.a), b.placed::<SHAPES>(pair.b)];
            separation::between(at_a, at_b, path, pair.axis)
        };
        let Some(manifold) = manifold else { continue };
        if manifold.separation >= SPECULATIVE + fall + closing_distance([a, b], &manifold, dt) {
            continue;
        }
        let (constraint, info) = make_contact::<SHAPES>([a, b], pair, index, manifold, dt);
        if constraint.is_deep(bodies, manifold.separation) {
            let (a, b) = (pair.a as usize, pair.b as usize);
            if deep_contacts[a] >= DEEP_CONTACTS_MAX && deep_contacts[b] >= DEEP_CONTACTS_MAX {
                continue;
            }
            deep_contacts[a] = deep_contacts[a].saturating_add(1);
            deep_contacts[b] = deep_contacts[b].saturating_add(1);
        }
        contacts.push(constraint, info);
    }
}

/// Distance by which a pair may close in the step. It follows from the bodies' own velocities and not from the
/// relative one, since a contact that stops one of them must not let it overlap the other, which fell next to it at
/// the same speed. It exceeds the relative path by at most a half-size. If a third body pushes further, that is a
/// late pair. With half of that limit, bodies that fall side by side would land inside each other; without it, most
/// flying pairs would have a useless constraint.
#[inline(always)]
fn closing_distance([a, b]: PackedPair, manifold: &Manifold, dt: f32) -> f32 {
    let approach = max(-manifold.normal.dot(b.velocity - a.velocity), 0.0);
    let speeds = manifold.normal.dot(a.velocity).abs() + manifold.normal.dot(b.velocity).abs();
    min(speeds * dt, approach * dt + min(a.thickness(), b.thickness()))
}

/// Creates a pair's constraint.
#[inline]
pub(crate) fn make_contact<const SHAPES: u8>(
    [a, b]: PackedPair,
    pair: &Pair,
    index: u32,
    manifold: Manifold,
    dt: f32,
) -> (ContactConstraint, ContactInfo) {
    let approach = -manifold.normal.dot(b.velocity - a.velocity);
    let size = manifold.normal.abs().dot(a.center.abs() + b.center.abs());
    let is_apart = manifold.separation > ROUNDING * size;
    // The impulse of one face says nothing about another face or a corner. It would push a circle that has just left
    // a tile.
    let axis = || separation::axis_of(a.shape::<SHAPES>(), b.shape::<SHAPES>(), manifold.normal);
    let is_kept = pair.axis == Axis::Free || pair.axis == axis();
    let (normal_impulse, tangent_impulse) =
        if is_kept { (pair.normal_impulse, pair.tangent_impulse) } else { (0.0, 0.0) };
    let constraint = ContactConstraint {
        a: pair.a,
        b: pair.b,
        normal: manifold.normal,
        min_normal_velocity: if is_apart { -manifold.separation / dt } else { 0.0 },
        effective_mass: 1.0 / (a.inv_mass + b.inv_mass),
        inv_mass_a: a.inv_mass,
        inv_mass_b: b.inv_mass,
        friction: (a.friction * b.friction).sqrt(),
        normal_impulse,
        tangent_impulse,
        normal_before: 0.0,
        tangent_before: 0.0,
        normal_direction: 0.0,
        tangent_direction: 0.0,
        pair: index,
    };
    let info = ContactInfo {
        separation: manifold.separation,
        separation_after: manifold.separation,
        exact: false,
        closing: max(approach, 0.0),
        bounced: false,
        slid: constraint.normal_impulse > 0.0 && !constraint.sticks(),
        correction: Correction::Thorough,
    };
    (constraint, info)
}

impl ContactConstraint {
    /// Velocity of b relative to a.
    #[inline]
    pub fn relative_velocity(&self, velocity: &[Vec2]) -> Vec2 {
        velocity[self.b as usize] - velocity[self.a as usize]
    }

    /// Applies an impulse to b and its opposite to a.
    #[inline]
    pub fn apply(&self, velocity: &mut [Vec2], impulse: Vec2) {
        velocity[self.a as usize] -= impulse * self.inv_mass_a;
        velocity[self.b as usize] += impulse * self.inv_mass_b;
    }

    /// The two impulses as one vector.
    #[inline]
    pub fn impulse(&self, normal: f32, tangent: f32) -> Vec2 {
        self.normal * normal + self.normal.perp() * tangent
    }

    /// The same, but if `FRICTION` is false, without the friction impulse, which is then 0.
    #[inline]
    pub fn impulse_of<const FRICTION: bool>(&self, normal: f32, tangent: f32) -> Vec2 {
        if FRICTION { self.impulse(normal, tangent) } else { self.normal * normal }
    }

    /// The accumulated impulses as one vector.
    #[inline]
    pub fn accumulated<const FRICTION: bool>(&self) -> Vec2 {
        self.impulse_of::<FRICTION>(self.normal_impulse, self.tangent_impulse)
    }

    /// Both bodies with their inverse masses.
    #[inline]
    pub fn bodies(&self) -> [(u32, f32); 2] {
        [(self.a, self.inv_mass_a), (self.b, self.inv_mass_b)]
    }

    /// Saves the impulses at the start of a sweep.
    #[inline]
    pub fn remember(&mut self) {
        (self.normal_before, self.tangent_before) = (self.normal_impulse, self.tangent_impulse);
    }

    /// Whether friction keeps the two from sliding; meaningless without friction.
    #[inline]
    pub fn sticks(&self) -> bool {
        self.tangent_impulse.abs() < SLIDING * self.friction * self.normal_impulse
    }

    /// Whether both bodies are movable and overlap so deeply that the normal is arbitrary.
    pub fn is_deep(&self, bodies: &Bodies, separation: f32) -> bool {
        if separation >= 0.0 || !self.is_free() {
            return false;
        }
        let thickness = |slot: u32| bodies.thickness(slot as usize);
        separation < -DEEP_SHARE * min(thickness(self.a), thickness(self.b))
    }

    /// The values that the pair keeps for the next step, which are both impulses and the axis of the face.
    #[inline]
    fn stored(&self, bodies: &Bodies) -> (f32, f32, Axis) {
        if self.normal_impulse <= 0.0 {
            return (0.0, 0.0, Axis::Free);
        }
        let shape = |slot: u32| bodies.shape[slot as usize];
        let axis = separation::axis_of(shape(self.a), shape(self.b), self.normal);
        (self.normal_impulse, self.tangent_impulse, axis)
    }

    /// Whether both bodies can be pushed.
    #[inline]
    pub fn is_free(&self) -> bool {
        self.inv_mass_a > 0.0 && self.inv_mass_b > 0.0
    }
}

/// Determines for each constraint whether its stored impulses are about to change.
pub(crate) fn find_changed(
    bodies: &Bodies,
    constraints: &[ContactConstraint],
    pairs: &[Pair],
    is_changed: &mut Vec<bool>,
) {
    is_changed.clear();
    is_changed.extend(constraints.iter().map(|constraint| {
        let (before, after) = (&pairs[constraint.pair as usize], constraint.stored(bodies));
        let bits =
            |(normal, tangent, axis): (f32, f32, Axis)| (normal.to_bits(), tangent.to_bits(), axis);
        bits((before.normal_impulse, before.tangent_impulse, before.axis)) != bits(after)
    }));
}

/// Stores the impulses for the next step in all pairs except those of two bodies that [take no part].
///
/// [take no part]: crate::steady::Steady::takes_no_part
pub(crate) fn store(
    bodies: &Bodies,
    constraints: &[ContactConstraint],
    pairs: &mut [Pair],
    takes_no_part: &[bool],
) {
    for pair in pairs.iter_mut() {
        if !(takes_no_part[pair.a as usize] && takes_no_part[pair.b as usize]) {
            pair.clear_impulses();
        }
    }
    for constraint in constraints.iter().filter(|constraint| constraint.normal_impulse > 0.0) {
        let pair = &mut pairs[constraint.pair as usize];
        (pair.normal_impulse, pair.tangent_impulse, pair.axis) = constraint.stored(bodies);
    }
}
