//! Bounces of bodies in a crowd change only velocities, pair by pair, in chronological order.
//!
//! Where bodies lie close to each other, the queue of impacts needs hundreds of predictions per impact, and paths
//! that bend at each impact are worth little, because the contact solver decides where bodies end up. In a crowd,
//! a bounce therefore only changes the two velocities before the step to those with which the pair leaves its
//! point of impact, as if the impact happened now. Bouncing one pair at a time conserves energy and momentum
//! exactly. Bodies on springs always count as crowded, because their path within a step cannot be traced back to
//! its start.

use super::impact_prediction::{gravity_on, restitution, restitution_of};
use crate::bodies::Bodies;
use crate::broad_phase::pairs::{Pair, near};
use crate::continuous::paths::Paths;
use crate::growth::push;
use crate::math::{clamp, max};
use crate::solver::contact_constraint::{ContactConstraint, ContactInfo, ContactSet};
use crate::solver::step_context::StepContext;
use glam::Vec2;

/// Largest gap at which two bodies count as close, as a share of a half-size.
const CLOSE: f32 = 0.5;
/// Number of searches for bouncing pairs per step. Each bounce may bring another pair together.
const LOOKS: u32 = 4;

/// A step's crowded bodies, and scratch memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Crowd {
    /// By slot: whether another movable body is close.
    is_crowded: Vec<bool>,
    /// Upcoming bounces, with the time in the upper half and the constraint's index in the lower half.
    bounces: Vec<u64>,
    /// Whether this step had any bounces.
    pub has_bounced: bool,
}

/// A predicted bounce.
struct Bounce {
    /// Closing speed, units/s.
    closing: f32,
    /// Increase in the squared closing speed due to gravity until the impact.
    gain: f32,
    /// Seconds into the step.
    time: f32,
}

impl Crowd {
    /// Finds the crowded bodies, which are those close to another movable one. Without gravity, elastic bodies
    /// never count as crowded, since the contact solver would not conserve their energy.
    pub fn find(&mut self, bodies: &Bodies, pairs: &[Pair], paths: &Paths, context: &StepContext) {
        self.is_crowded.clear();
        self.is_crowded.resize(bodies.alive.len(), false);
        for &slot in &bodies.moving {
            self.is_crowded[slot as usize] = paths.sprung_acceleration(slot).is_some();
        }
        let is_weightless = context.gravity == Vec2::ZERO;
        for pair in pairs {
            let (a, b) = (pair.a as usize, pair.b as usize);
            if self.is_crowded[a] && self.is_crowded[b] {
                // Both bodies are already known to be crowded.
                continue;
            }
            if bodies.inverse_mass[a] == 0.0 || bodies.inverse_mass[b] == 0.0 {
                // A single ball bounces off a floor on its exact path.
                continue;
            }
            let gap = (bodies.center[b] - bodies.center[a]).abs() - bodies.half[a] - bodies.half[b];
            let gap = max(gap.x, gap.y);
            if !near(bodies, pair.a, pair.b) {
                // Which pairs beyond reach are listed depends on when the list was built.
                continue;
            }
            if is_weightless && restitution(bodies, pair) >= 1.0 {
                continue;
            }
            self.is_crowded[a] |= gap < CLOSE * bodies.thickness(a);
            self.is_crowded[b] |= gap < CLOSE * bodies.thickness(b);
        }
    }

    /// Whether a body is in a crowd.
    #[inline]
    pub fn has(&self, slot: u32) -> bool {
        self.is_crowded[slot as usize]
    }

    /// Bounces all pairs that are still closing and touch within the step. These include pairs of crowded bodies,
    /// and pairs whose impact gravity delays beyond the end of the step although their final velocities would make
    /// them touch earlier.
    pub fn bounce(
        &mut self,
        bodies: &mut Bodies,
        contacts: &mut ContactSet,
        paths: &Paths,
        context: &StepContext,
    ) {
        self.has_bounced = false;
        let ContactSet { constraints, infos } = contacts;
        for _ in 0..LOOKS {
            self.bounces.clear();
            for (index, (constraint, info)) in (0u32..).zip(constraints.iter().zip(infos.iter())) {
                if let Some(Bounce { time, .. }) =
                    next_bounce(bodies, constraint, info, paths, context)
                {
                    push(&mut self.bounces, u64::from(time.to_bits()) << 32 | u64::from(index));
                }
            }
            if self.bounces.is_empty() {
                break;
            }
            self.bounces.sort_unstable();
            for &entry in &self.bounces {
                let index = entry as u32 as usize;
                let (constraint, info) = (&constraints[index], &mut infos[index]);
                // Another bounce may have separated the two.
                if let Some(bounce) = next_bounce(bodies, constraint, info, paths, context) {
                    self.has_bounced = true;
                    apply(bodies, constraint, &bounce);
                    info.bounced = true;
                    info.closing = max(info.closing, bounce.closing);
                }
            }
        }
    }
}

/// The bounce of a pair that is closing faster than the threshold and touches within the step.
fn next_bounce(
    bodies: &Bodies,
    constraint: &ContactConstraint,
    info: &ContactInfo,
    paths: &Paths,
    context: &StepContext,
) -> Option<Bounce> {
    if restitution_of(bodies, constraint.a, constraint.b) <= 0.0 {
        return None;
    }
    let acceleration = |slot: u32| {
        let sprung = paths.sprung_acceleration(slot);
        sprung.unwrap_or_else(|| gravity_on(bodies, slot as usize, context))
    };
    let pull = constraint.normal.dot(acceleration(constraint.a) - acceleration(constraint.b));
    let closing = -constraint.normal.dot(constraint.relative_velocity(&bodies.velocity));
    let furthest = (closing + pull * context.dt) * context.dt;
    if closing <= context.settings.bounce_threshold || info.separation >= furthest {
        return None;
    }
    let distance = max(info.separation, 0.0);
    Some(Bounce { closing, gain: 2.0 * pull * distance, time: distance / closing })
}

/// Applies the impulse of a bounce. At the point of impact, the pair separates at e times its closing speed w
/// there, where w^2 = c^2 + gain. Here it therefore separates at the speed c' with c'^2 = e^2 w^2 - gain.
fn apply(bodies: &mut Bodies, constraint: &ContactConstraint, bounce: &Bounce) {
    let Bounce { closing, gain, .. } = *bounce;
    let restitution = restitution_of(bodies, constraint.a, constraint.b);
    let leaving = restitution * restitution * (closing * closing + gain) - gain;
    let normal = (closing + max(leaving, 0.0).sqrt()) * constraint.effective_mass;
    let slide = constraint.normal.perp().dot(constraint.relative_velocity(&bodies.velocity));
    let limit = constraint.friction * normal;
    if !(normal + slide + limit).is_finite() {
        // The speeds are close to the largest representable number; the step quarantines such bodies.
        return;
    }
    let tangent = clamp(-slide * constraint.effective_mass, -limit, limit);
    constraint.apply(&mut bodies.velocity, constraint.impulse(normal, tangent));
}
