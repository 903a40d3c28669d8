//! Guards islands whose masses differ so much that f32 may not solve them.
//!
//! Correct impulses can only lower the energy of an island: with l.(b - J v*) >= l.A.l / 2 and b <= 0 (see
//! `warm_start`), its kinetic energy ends up at or below its initial value, except for the work done by kinematic
//! bodies. Search directions and exact blocks spread a heavy body's rounding errors, and can violate this rule by
//! any factor if a light body supports 10^12 times its own mass. The energy of such an island is therefore compared
//! before and after. If it grew, the island is solved again from zero by plain sweeps, which only ever move a pair
//! towards its target. If it grew even then, the island does not move for a step, since a body without velocity
//! passes no wall and gains nothing.

use crate::math::max;
use crate::solver::contact_constraint::ContactConstraint;
use crate::solver::sweep;
use crate::solver::tolerances::ENERGY_ROUNDING;
use glam::Vec2;

/// Maximum and minimum number of plain sweeps, and the number of visits that they may take over a large island.
const SWEEPS_MAX: usize = 60;
const SWEEPS_MIN: usize = 8;
const VISITS: usize = 16_000;

/// A body of an island.
#[derive(Clone, Copy, Debug)]
struct IslandMember {
    body: u32,
    inv_mass: f32,
    /// Velocity before any impulse in the step, and after the warm start.
    free: Vec2,
    warm_started: Vec2,
}

/// State of an island before it is swept.
#[derive(Clone, Debug, Default)]
pub(crate) struct EnergyGuard {
    /// All bodies in its constraints, once each. Walls are included, since an infinite impulse turns even their
    /// velocity into NaN.
    members: Vec<IslandMember>,
    /// Scratch for slots, and the bits of their inverse masses.
    slots: Vec<u64>,
    /// Largest speed of the immovable bodies, units/s.
    driven_speed_max: f32,
}

impl EnergyGuard {
    /// Saves the state of an island.
    pub fn remember(
        &mut self,
        constraints: &[ContactConstraint],
        island: &[u32],
        velocity: &mut [Vec2],
    ) {
        self.slots.clear();
        self.driven_speed_max = 0.0;
        for &index in island {
            let constraint = &constraints[index as usize];
            for (body, inv_mass) in constraint.bodies() {
                self.slots.push(u64::from(body) << 32 | u64::from(inv_mass.to_bits()));
                if inv_mass == 0.0 {
                    let speed = velocity[body as usize].length();
                    self.driven_speed_max = max(self.driven_speed_max, speed);
                }
            }
        }
        self.slots.sort_unstable();
        self.slots.dedup();
        self.members.clear();
        self.members.extend(self.slots.iter().map(|&entry| {
            let (body, inv_mass) = ((entry >> 32) as u32, f32::from_bits(entry as u32));
            let warm_started = velocity[body as usize];
            IslandMember { body, inv_mass, free: warm_started, warm_started }
        }));
        for &index in island {
            let constraint = &constraints[index as usize];
            constraint.apply(
                velocity,
                constraint.impulse(-constraint.normal_impulse, -constraint.tangent_impulse),
            );
        }
        for member in &mut self.members {
            member.free = velocity[member.body as usize];
            velocity[member.body as usize] = member.warm_started;
        }
    }

    /// Checks the energy of the solved island, and solves it again if it grew. Returns the number of constraint
    /// visits.
    pub fn check(
        &self,
        constraints: &mut [ContactConstraint],
        island: &[u32],
        velocity: &mut [Vec2],
    ) -> u32 {
        let allowed = self.energy(|member| member.free) * (1.0 + ENERGY_ROUNDING);
        if self.is_within(velocity, allowed) {
            return 0;
        }
        self.reset(constraints, island, velocity, |member| member.free);
        let sweeps = (VISITS / island.len()).clamp(SWEEPS_MIN, SWEEPS_MAX);
        for _ in 0..sweeps {
            sweep::plain_sweep(constraints, island, velocity);
        }
        if !self.is_within(velocity, allowed) {
            self.reset(constraints, island, velocity, |_| Vec2::ZERO);
        }
        (sweeps * island.len()) as u32
    }

    fn is_within(&self, velocity: &[Vec2], allowed: f64) -> bool {
        let numbers = |member: &IslandMember| velocity[member.body as usize].is_finite();
        self.energy(|member| velocity[member.body as usize]) <= allowed
            && self.members.iter().all(numbers)
    }

    /// Twice the kinetic energy in excess of the work done by kinematic bodies. NaN stays NaN.
    fn energy(&self, velocity: impl Fn(&IslandMember) -> Vec2) -> f64 {
        let mut sum = 0.0;
        for member in self.members.iter().filter(|member| member.inv_mass > 0.0) {
            let beyond = velocity(member).length() - 2.0 * self.driven_speed_max;
            let speed = if beyond <= 0.0 { 0.0 } else { f64::from(beyond) };
            sum += speed * speed / f64::from(member.inv_mass);
        }
        sum
    }

    /// Resets the velocities of all members and zeroes the impulses of all constraints.
    fn reset(
        &self,
        constraints: &mut [ContactConstraint],
        island: &[u32],
        velocity: &mut [Vec2],
        to: impl Fn(&IslandMember) -> Vec2,
    ) {
        for member in &self.members {
            let is_driven = member.inv_mass == 0.0;
            velocity[member.body as usize] =
                if is_driven { member.warm_started } else { to(member) };
        }
        for &index in island {
            let constraint = &mut constraints[index as usize];
            (constraint.normal_impulse, constraint.tangent_impulse) = (0.0, 0.0);
        }
    }
}
