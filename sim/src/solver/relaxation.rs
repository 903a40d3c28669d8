//! The relaxation solver (A0.13) uses projection and impulses. It handles all pairs of the scene together in id
//! order (C22f, C22h), in at most N passes (C22a), ending early when nothing is left to correct.
//!
//! A step calls `start`, `advance`, `gather` and `solve`. Each pass visits every pair at the current positions: it
//! finds the contact, applies the normal impulse and friction, and then separates the two by a share of the overlap.
//!
//! A body between two others that close in on it cannot satisfy both contacts, and both impulses grow with every
//! pass. Several rules limit the damage. Impulses that held nothing at rest are not applied again. A warm start
//! changes no velocity by many times as much as gravity does. Corrections move a body no further in a step than its
//! half-size or than the largest speed would. If the passes end before they converge, immovable bodies take
//! precedence. Pushes do not depend on where a body came from, so before the passes it is moved back along its path,
//! out of gaps and boxes that it could not have entered.
//!
//! The passes are compiled for each set of shapes, with and without friction and restitution, so that features
//! which no body has are not even tested for. All variants produce the same bits.

pub(crate) mod constraint;
mod step_back;

use crate::bodies::Bodies;
use crate::body::Motion;
use crate::broad_phase::pairs::{Pair, near};
use crate::features::Features;
use crate::forces::{Forces, Move};
use crate::growth::push;
use crate::integrate;
use crate::math::{clamp, clamp_length, max, min};
use crate::narrow_phase::overlap::overlap;
use crate::shape::shapes;
use crate::solver::settings::Relaxation;
use crate::solver::tolerances::{OVERLAP, RELAXED_SPEED, UNBALANCED};
use crate::touches::Found;
use crate::world::settings::WorldSettings;
use constraint::RelaxationConstraint;
use glam::Vec2;

/// Scratch memory for the relaxation solver.
#[derive(Debug, Default)]
pub(crate) struct RelaxationSolver {
    /// The pairs that take part in the step, in (a, b) order.
    pub constraints: Vec<RelaxationConstraint>,
    /// Normals of this step's warm start, in (a, b) order.
    warm_normals: Vec<WarmNormal>,
    /// By slot: velocity of a moving body at the start of the step, and its velocity before the warm start.
    start_velocity: Vec<Vec2>,
    free_velocity: Vec<Vec2>,
    /// By slot: position before the passes, and position before the bodies moved.
    start_position: Vec<Vec2>,
    from: Vec<Vec2>,
    /// Pairs with an immovable body, stored as the slot of the other body followed by that of the immovable one.
    walls: Vec<u64>,
    /// By slot: `Some` if springs act on the body; empty in a world without springs.
    sprung: Vec<Option<Vec2>>,
    /// Number of passes made in the latest step.
    pub passes: u32,
}

/// The normal along which a pair's stored impulse was applied.
#[derive(Clone, Copy, Debug)]
struct WarmNormal {
    a: u32,
    b: u32,
    normal: Vec2,
}

/// Leaves out scratch, as in the conjugate solver.
impl Clone for RelaxationSolver {
    fn clone(&self) -> RelaxationSolver {
        let (constraints, passes) = (self.constraints.clone(), self.passes);
        RelaxationSolver { constraints, passes, ..RelaxationSolver::default() }
    }
}

impl RelaxationSolver {
    pub fn release(&mut self) {
        self.constraints.clear();
        *self = self.clone();
    }

    /// Integrates the velocities (first half of symplectic Euler), and applies the previous step's resting impulses.
    pub fn start(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut [Pair],
        moves: &[Move],
        settings: Option<&Relaxation>,
        world: &WorldSettings,
    ) {
        let gain = world.gravity * world.dt;
        integrate::accelerate(bodies, gain, world.speed_max, &mut self.start_velocity);
        for found in moves {
            bodies.velocity[found.slot as usize] = found.velocity;
        }
        self.warm_normals.clear();
        if settings.is_some_and(|settings| settings.warm_start) {
            self.warm_start(bodies, pairs);
        }
        self.from.clone_from(&bodies.center);
    }

    /// Applies the previous step's resting impulses to the velocities, before the bodies move.
    ///
    /// Resting impulses balance the effect of gravity and other forces on a body in the step. If they cause a change
    /// in velocity that is many times greater, a balancing impulse must be missing. The body then gets only the
    /// share that changes its velocity no more than the forces alone.
    fn warm_start(&mut self, bodies: &mut Bodies, pairs: &mut [Pair]) {
        if pairs.iter().all(|pair| pair.normal_impulse <= 0.0) {
            return;
        }
        self.free_velocity.clone_from(&bodies.velocity);
        apply_stored(bodies, pairs, &mut self.warm_normals);
        let Bodies { moving, velocity, warm_start_scale, .. } = bodies;
        let mut any = false;
        for &slot in moving.iter() {
            let slot = slot as usize;
            let (start, free) = (self.start_velocity[slot], self.free_velocity[slot]);
            let (gain, held) = (free - start, velocity[slot] - free);
            warm_start_scale[slot] = 1.0;
            if (gain + held).length_squared() > gain.length_squared() * UNBALANCED {
                let share = clamp(-2.0 * gain.dot(held) / held.length_squared(), 0.0, 1.0);
                // The square of an implausible impulse may be infinite.
                let share = if share.is_finite() { share } else { 0.0 };
                velocity[slot] = free + held * share;
                warm_start_scale[slot] = share;
                any = true;
            }
        }
        if any {
            pairs.iter_mut().for_each(|pair| scale_stored(bodies, pair));
        }
    }

    /// Moves the bodies (second half of symplectic Euler).
    pub fn advance(&self, bodies: &mut Bodies, moves: &[Move], dt: f32) {
        integrate::advance(bodies, moves, &self.start_velocity, dt);
    }

    /// Gathers the pairs that take part in this step, in (a, b) order.
    pub fn gather(&mut self, bodies: &Bodies, pairs: &[Pair], features: Features) {
        let gather = match features.takes_shapes() {
            shapes::CIRCLES => gather::<{ shapes::CIRCLES }>,
            shapes::BOXES => gather::<{ shapes::BOXES }>,
            _ => gather::<{ shapes::BOTH }>,
        };
        gather(bodies, pairs, &self.warm_normals, &mut self.constraints);
    }

    /// Lets bodies on springs bounce at the speeds they had at the start of the step, since the speed that a
    /// spring adds while pressing one body onto another would keep it hopping. Elastic bodies keep this speed, as
    /// the energy guard limits them.
    pub fn limit_bounces(&mut self, bodies: &Bodies, forces: &Forces, dt: f32) {
        forces.find_sprung(bodies, dt, &mut self.sprung);
        if self.sprung.is_empty() {
            return;
        }
        let is_sprung = |slot: u32| self.sprung[slot as usize].is_some();
        let start = |slot: u32| {
            let slot = slot as usize;
            let is_pushed = Bodies::is_pushed(bodies.motion[slot]);
            if is_pushed { self.start_velocity[slot] } else { bodies.velocity[slot] }
        };
        for constraint in &mut self.constraints {
            let is_sprung = is_sprung(constraint.a) || is_sprung(constraint.b);
            if !is_sprung || constraint.restitution >= 1.0 {
                continue;
            }
            let before = -constraint.normal.dot(start(constraint.b) - start(constraint.a));
            let now = -constraint.normal.dot(constraint.relative_velocity(bodies));
            if now > 0.0 {
                constraint.restitution *= clamp(before / now, 0.0, 1.0);
            }
        }
    }

    /// Solves the contacts, and stores their impulses for the next step.
    pub fn solve(
        &mut self,
        bodies: &mut Bodies,
        pairs: &mut [Pair],
        settings: Option<&Relaxation>,
        world: &WorldSettings,
    ) {
        self.drop_non_finite(bodies);
        self.passes = 0;
        let Some(settings) = settings else { return };
        let passes = match world.features.takes_shapes() {
            shapes::CIRCLES => passes_with::<{ shapes::CIRCLES }>(world.features),
            shapes::BOXES => passes_with::<{ shapes::BOXES }>(world.features),
            _ => passes_with::<{ shapes::BOTH }>(world.features),
        };
        if !self.constraints.is_empty() {
            self.step_back(bodies, settings.slop);
            self.start_position.clone_from(&bodies.center);
        }
        let limits = Limits {
            settings,
            start: &self.start_position,
            correction_max: world.speed_max * world.dt,
        };
        self.passes = passes(bodies, &mut self.constraints, &limits);
        store(&self.constraints, pairs);
        self.find_warm_start_scales(bodies, world.gravity.length() * world.dt);
    }

    /// Finds the share of each body's impulses with which the next step begins. It is 1 for a body at rest.
    /// `free_change` is the change in velocity due to gravity in a step, units/s.
    fn find_warm_start_scales(&self, bodies: &mut Bodies, free_change: f32) {
        for &slot in &bodies.moving {
            let slot = slot as usize;
            let change = bodies.velocity[slot] - self.start_velocity[slot];
            bodies.warm_start_scale[slot] = warm_start_scale_of(change.length(), free_change);
        }
        // If two bodies are still closing, the impulse between them did not hold them at rest.
        for constraint in self.constraints.iter().filter(|found| found.normal_impulse > 0.0) {
            let closing = -constraint.relative_velocity(bodies).dot(constraint.normal);
            if closing > free_change {
                let scale = warm_start_scale_of(closing, free_change);
                for (slot, inv_mass) in constraint.bodies() {
                    if inv_mass > 0.0 {
                        let of_body = &mut bodies.warm_start_scale[slot as usize];
                        *of_body = min(*of_body, scale);
                    }
                }
            }
        }
    }

    /// Drops the constraints of bodies whose position or velocity is not finite. These bodies leave the world at the
    /// end of the step.
    pub fn drop_non_finite(&mut self, bodies: &Bodies) {
        if !bodies.moving.iter().all(|&slot| bodies.is_finite(slot as usize)) {
            let finite = |slot: u32| bodies.is_finite(slot as usize);
            self.constraints.retain(|constraint| finite(constraint.a) && finite(constraint.b));
        }
    }

    /// Pairs that met in the step.
    pub fn contacts(&self) -> impl Iterator<Item = [u32; 2]> {
        let met = |found: &&RelaxationConstraint| found.closing > 0.0 || found.separation < 0.0;
        self.constraints.iter().filter(met).map(|found| [found.a, found.b])
    }

    /// Overlaps at the end of the step.
    pub fn overlaps(&mut self, bodies: &Bodies) -> impl DoubleEndedIterator<Item = Found> + Clone {
        for constraint in &mut self.constraints {
            constraint.finish(bodies);
        }
        let overlapping = self.constraints.iter().filter(|constraint| constraint.separation < 0.0);
        overlapping.map(|constraint| Found {
            a: constraint.a,
            b: constraint.b,
            normal: constraint.normal,
            depth: -constraint.separation,
            closing: constraint.closing,
        })
    }
}

/// Applies the stored impulses of all pairs that still overlap.
///
/// An impulse is scaled by the smaller `warm_start_scale` of its two bodies, since the impulse that stopped an impact
/// would add energy if it were applied again.
fn apply_stored(bodies: &mut Bodies, pairs: &mut [Pair], warm_normals: &mut Vec<WarmNormal>) {
    for pair in pairs.iter_mut().filter(|pair| pair.normal_impulse > 0.0) {
        let Some(manifold) = overlap(bodies, pair.a, pair.b) else {
            pair.clear_impulses();
            continue;
        };
        scale_stored(bodies, pair);
        warm_normals.push(WarmNormal { a: pair.a, b: pair.b, normal: manifold.normal });
        let impulse =
            manifold.normal * pair.normal_impulse + manifold.normal.perp() * pair.tangent_impulse;
        let (a, b) = (pair.a as usize, pair.b as usize);
        bodies.velocity[a] -= impulse * bodies.inverse_mass[a];
        bodies.velocity[b] += impulse * bodies.inverse_mass[b];
    }
}

#[inline]
fn scale_stored(bodies: &Bodies, pair: &mut Pair) {
    let scale =
        min(bodies.warm_start_scale[pair.a as usize], bodies.warm_start_scale[pair.b as usize]);
    pair.normal_impulse *= scale;
    pair.tangent_impulse *= scale;
    if pair.normal_impulse <= 0.0 {
        pair.clear_impulses();
    }
}

fn gather<const SHAPES: u8>(
    bodies: &Bodies,
    pairs: &[Pair],
    warm_normals: &[WarmNormal],
    constraints: &mut Vec<RelaxationConstraint>,
) {
    constraints.clear();
    let mut warm_normals = warm_normals.iter().peekable();
    for (index, pair) in (0u32..).zip(pairs) {
        let of_pair = |warm: &&WarmNormal| (warm.a, warm.b) == (pair.a, pair.b);
        let normal = warm_normals.next_if(of_pair).map_or(Vec2::ZERO, |warm| warm.normal);
        if near(bodies, pair.a, pair.b) {
            let constraint = RelaxationConstraint::new::<SHAPES>(bodies, pair, index, normal);
            push(constraints, constraint);
        }
    }
}

/// Limits on the passes.
#[derive(Clone, Copy, Debug)]
struct Limits<'a> {
    settings: &'a Relaxation,
    /// By slot: position before the passes.
    start: &'a [Vec2],
    /// Longest distance by which corrections may move a body in a step, world units; a body's half-size is also a
    /// limit.
    correction_max: f32,
}

impl Limits<'_> {
    /// Moves a body, but no further from its starting position than allowed.
    fn shift(&self, bodies: &mut Bodies, slot: usize, shift: Vec2) {
        let moved = bodies.center[slot] + shift - self.start[slot];
        let furthest = min(self.correction_max, bodies.thickness(slot));
        if moved.length_squared() > furthest * furthest {
            let end = self.start[slot] + clamp_length(moved, furthest);
            bodies.shift(slot, end - bodies.center[slot]);
        } else {
            bodies.shift(slot, shift);
        }
    }
}

/// Makes at most N passes over all constraints, and returns the number of passes made.
type Passes = fn(&mut Bodies, &mut [RelaxationConstraint], &Limits) -> u32;

/// Selects the passes compiled for exactly these features.
fn passes_with<const SHAPES: u8>(features: Features) -> Passes {
    match (features.takes_friction(), features.takes_restitution()) {
        (true, true) => passes::<SHAPES, true, true>,
        (true, false) => passes::<SHAPES, true, false>,
        (false, true) => passes::<SHAPES, false, true>,
        (false, false) => passes::<SHAPES, false, false>,
    }
}

fn passes<const SHAPES: u8, const FRICTION: bool, const RESTITUTION: bool>(
    bodies: &mut Bodies,
    constraints: &mut [RelaxationConstraint],
    limits: &Limits,
) -> u32 {
    for pass in 1..=limits.settings.iterations {
        let mut changed = false;
        for constraint in constraints.iter_mut() {
            changed |= relax_pair::<SHAPES, FRICTION, RESTITUTION>(bodies, constraint, limits);
        }
        if !changed {
            return pass;
        }
    }
    hold_at_immovable(bodies, constraints, limits);
    limits.settings.iterations
}

/// Gives immovable bodies precedence where the passes ended before they converged, and static ones precedence over
/// kinematic ones, since an overlap between two bodies is better than a body inside a wall.
fn hold_at_immovable(
    bodies: &mut Bodies,
    constraints: &mut [RelaxationConstraint],
    limits: &Limits,
) {
    for motion in [Motion::Kinematic, Motion::Static] {
        for constraint in constraints.iter_mut().filter(|constraint| !constraint.is_free()) {
            let fixed = if constraint.inv_mass_a > 0.0 { constraint.b } else { constraint.a };
            if bodies.motion[fixed as usize] != motion {
                continue;
            }
            constraint.refresh_manifold::<{ shapes::BOTH }>(bodies, limits.start);
            if constraint.separation < 0.0 {
                constraint.undo_if_turned(bodies);
                solve_normal::<false>(bodies, constraint, f32::INFINITY);
                correct_position(bodies, constraint, limits, 1.0);
            }
        }
    }
}

/// Relaxes a pair in one pass, and returns whether it changed enough to need another pass.
#[inline]
fn relax_pair<const SHAPES: u8, const FRICTION: bool, const RESTITUTION: bool>(
    bodies: &mut Bodies,
    constraint: &mut RelaxationConstraint,
    limits: &Limits,
) -> bool {
    constraint.refresh_manifold::<SHAPES>(bodies, limits.start);
    if constraint.separation < 0.0 {
        constraint.undo_if_turned(bodies);
        let changed_normal =
            solve_normal::<RESTITUTION>(bodies, constraint, limits.settings.bounce_threshold);
        let changed_tangent = FRICTION && solve_friction(bodies, constraint);
        let share = limits.settings.correction;
        let changed_position = correct_position(bodies, constraint, limits, share);
        changed_normal | changed_tangent | changed_position
    } else {
        constraint.normal_impulse > 0.0 && release::<FRICTION>(bodies, constraint)
    }
}

/// Applies the normal impulse (A2.21), which is a bounce above the threshold (C16), and otherwise
/// the impulse that stops the approach. It is accumulated so that later passes may take back an
/// excess.
///
/// A pair that is already under load does not bounce. Inside a pile, the passes cause closing speeds that no
/// impact ever had, and bouncing at those would keep the pile boiling.
#[inline]
fn solve_normal<const RESTITUTION: bool>(
    bodies: &mut Bodies,
    constraint: &mut RelaxationConstraint,
    threshold: f32,
) -> bool {
    let speed = constraint.relative_velocity(bodies).dot(constraint.normal);
    constraint.closing = max(constraint.closing, -speed);
    if RESTITUTION
        && -speed > threshold
        && constraint.restitution > 0.0
        && constraint.normal_impulse <= 0.0
    {
        let impulse = -(1.0 + constraint.restitution) * speed * constraint.effective_mass;
        constraint.bounce_impulse += impulse;
        constraint.apply(bodies, constraint.normal * impulse);
        return true;
    }
    let wanted = constraint.normal_impulse - speed * constraint.effective_mass;
    let normal_impulse = if wanted > 0.0 { wanted } else { 0.0 };
    let change = normal_impulse - constraint.normal_impulse;
    constraint.normal_impulse = normal_impulse;
    constraint.apply(bodies, constraint.normal * change);
    change.abs() > RELAXED_SPEED * constraint.effective_mass
}

/// Applies Coulomb friction to the relative tangential velocity, limited by the pair's total normal impulse in this
/// step (C08 to C14).
#[inline]
fn solve_friction(bodies: &mut Bodies, constraint: &mut RelaxationConstraint) -> bool {
    let limit = constraint.friction * (constraint.normal_impulse + constraint.bounce_impulse);
    // Without friction, an infinite impulse makes the limit NaN.
    let acts = limit > 0.0 || constraint.tangent_impulse != 0.0;
    if !acts {
        return false;
    }
    let along = constraint.normal.perp();
    let slide = constraint.relative_velocity(bodies).dot(along);
    let tangent =
        clamp(constraint.tangent_impulse - slide * constraint.effective_mass, -limit, limit);
    let change = tangent - constraint.tangent_impulse;
    constraint.tangent_impulse = tangent;
    constraint.apply(bodies, along * change);
    change.abs() > RELAXED_SPEED * constraint.effective_mass
}

/// Corrects positions (A2.19). Each body moves by its part of a share of the overlap beyond the slop (C19).
#[inline]
fn correct_position(
    bodies: &mut Bodies,
    constraint: &RelaxationConstraint,
    limits: &Limits,
    share: f32,
) -> bool {
    let excess = -constraint.separation - limits.settings.slop;
    if excess <= OVERLAP {
        return false;
    }
    let shift = constraint.normal * (excess * share * constraint.effective_mass);
    limits.shift(bodies, constraint.a as usize, shift * -constraint.inv_mass_a);
    limits.shift(bodies, constraint.b as usize, shift * constraint.inv_mass_b);
    true
}

/// Releases a pair that was held but is separating. The excess of its impulse, which drives it apart, is taken back
/// along with the corresponding friction.
#[inline]
fn release<const FRICTION: bool>(
    bodies: &mut Bodies,
    constraint: &mut RelaxationConstraint,
) -> bool {
    if constraint.relative_velocity(bodies).dot(constraint.normal) <= 0.0 {
        return false;
    }
    let changed_normal = solve_normal::<false>(bodies, constraint, f32::INFINITY);
    let changed_tangent = FRICTION && solve_friction(bodies, constraint);
    changed_tangent | changed_normal
}

/// Stores the resting impulses for the next step's warm start.
fn store(constraints: &[RelaxationConstraint], pairs: &mut [Pair]) {
    pairs.iter_mut().for_each(Pair::clear_impulses);
    for constraint in constraints.iter().filter(|constraint| constraint.normal_impulse > 0.0) {
        let pair = &mut pairs[constraint.pair as usize];
        pair.normal_impulse = constraint.normal_impulse;
        pair.tangent_impulse = constraint.tangent_impulse;
    }
}

/// Factor applied to a body's impulses when they are applied again in the next step. It is 1 at rest, and falls
/// as the change in velocity in the step exceeds that due to gravity alone (`free_change`, units/s).
#[inline]
fn warm_start_scale_of(change: f32, free_change: f32) -> f32 {
    if change <= free_change { 1.0 } else { free_change / change }
}
