//! Guard: islands whose masses are so different that f32 may not solve them.
//!
//! Impulses that are right can only lower the energy of an island: with l.(b - J v*) >= l.A.l / 2 and
//! b <= 0 (see `warm`) its kinetic energy ends at or below where it began, but for what kinematic
//! bodies do. Directions and exact blocks that move a heavy body's rounding errors about break that
//! rule, by any factor, where a light one carries a millionth of a millionth of its mass. So such an
//! island is weighed before and after. If it gained, it is solved again from nothing by plain sweeps,
//! which only ever move a pair towards what it should do; if even they gained, it stands still for a
//! step: whoever does not move passes no wall and gains nothing.

use super::rows::Row;
use super::sweep;
use crate::math::max;
use glam::Vec2;

/// Ratio of masses in an island from which on it is guarded.
pub(crate) const RATIO: f32 = 1e4;
/// Plain sweeps.
const SWEEPS: u32 = 60;
/// Share of the energy that is rounding.
const ROUNDING: f64 = 1e-5;

/// A body of an island.
#[derive(Clone, Copy, Debug)]
struct Member {
    body: u32,
    /// Inverse mass.
    weight: f32,
    /// Before any impulse of the step, and with those of the start.
    free: Vec2,
    started: Vec2,
}

/// An island as it was.
#[derive(Clone, Debug, Default)]
pub(crate) struct Guard {
    /// All bodies of its rows, once each: an infinite impulse makes no number even of a wall's speed.
    members: Vec<Member>,
    /// Fastest of the bodies that nothing moves, units/s.
    driven: f32,
}

impl Guard {
    /// Keeps an island.
    pub fn remember(&mut self, rows: &[Row], island: &[u32], velocity: &mut [Vec2]) {
        self.members.clear();
        self.driven = 0.0;
        for &place in island {
            let row = &rows[place as usize];
            for (body, weight) in [(row.a, row.weight_a), (row.b, row.weight_b)] {
                let started = velocity[body as usize];
                self.members.push(Member { body, weight, free: started, started });
                if weight == 0.0 {
                    self.driven = max(self.driven, started.length());
                }
            }
        }
        self.members.sort_unstable_by_key(|member| member.body);
        self.members.dedup_by_key(|member| member.body);
        for &place in island {
            let row = &rows[place as usize];
            row.apply(velocity, row.impulse(-row.press, -row.rub));
        }
        for member in &mut self.members {
            member.free = velocity[member.body as usize];
            velocity[member.body as usize] = member.started;
        }
    }

    /// Looks at what was made of it, and mends that.
    pub fn check(&self, rows: &mut [Row], island: &[u32], velocity: &mut [Vec2]) {
        let allowed = self.energy(|member| member.free) * (1.0 + ROUNDING);
        if self.holds(velocity, allowed) {
            return;
        }
        self.set(rows, island, velocity, |member| member.free);
        for _ in 0..SWEEPS {
            sweep::plainly(rows, island, velocity);
        }
        if !self.holds(velocity, allowed) {
            self.set(rows, island, velocity, |_| Vec2::ZERO);
        }
    }

    fn holds(&self, velocity: &[Vec2], allowed: f64) -> bool {
        let numbers = |member: &Member| velocity[member.body as usize].is_finite();
        self.energy(|member| velocity[member.body as usize]) <= allowed
            && self.members.iter().all(numbers)
    }

    /// Kinetic energy, twice, beyond what driven bodies may give; what is no number stays none.
    fn energy(&self, velocity: impl Fn(&Member) -> Vec2) -> f64 {
        let mut sum = 0.0;
        for member in self.members.iter().filter(|member| member.weight > 0.0) {
            let beyond = velocity(member).length() - 2.0 * self.driven;
            let speed = if beyond <= 0.0 { 0.0 } else { f64::from(beyond) };
            sum += speed * speed / f64::from(member.weight);
        }
        sum
    }

    /// Gives all members a velocity, and no row an impulse.
    fn set(
        &self,
        rows: &mut [Row],
        island: &[u32],
        velocity: &mut [Vec2],
        to: impl Fn(&Member) -> Vec2,
    ) {
        for member in &self.members {
            let driven = member.weight == 0.0;
            velocity[member.body as usize] = if driven { member.started } else { to(member) };
        }
        for &place in island {
            let row = &mut rows[place as usize];
            (row.press, row.rub) = (0.0, 0.0);
        }
    }
}
