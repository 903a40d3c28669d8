//! The contact problem of one step with Coulomb friction, in f64: v = v* + M^-1 J^T p, where the normal impulse can
//! only push and ensures n.(vb - va) >= `min_normal_velocity`, and friction opposes slip with at most mu times the
//! normal impulse.
//!
//! Two methods that share no code: Gauss-Seidel that updates both impulses of a contact together (Moreau 1988; Jean
//! 1999), and fixed-point iteration over problems with given friction bounds (Tresca), each a quadratic program solved
//! by accelerated projected gradients (Haslinger 1983).

use super::program::{Contact, Program};
use glam::DVec2;

/// The normal and friction impulses of a contact. Friction acts along the normal rotated to the left.
pub type Impulse = DVec2;

/// A step's contacts, all with the same coefficient of friction.
pub struct Coulomb<'a> {
    pub program: &'a Program,
    /// Friction coefficient of every contact.
    pub friction: f64,
}

impl Coulomb<'_> {
    fn inverse_mass(&self, contact: &Contact) -> f64 {
        self.program.inverse_masses[contact.a] + self.program.inverse_masses[contact.b]
    }

    /// How much the conditions are violated: the excess closing speed and the slip.
    fn violation(&self, velocities: &[DVec2], contact: &Contact) -> DVec2 {
        let relative = velocities[contact.b] - velocities[contact.a];
        let normal = contact.normal;
        DVec2::new(normal.dot(relative) - contact.min_normal_velocity, normal.perp().dot(relative))
    }

    fn push(&self, velocities: &mut [DVec2], contact: &Contact, change: Impulse) {
        let impulse = contact.normal * change.x + contact.normal.perp() * change.y;
        velocities[contact.a] -= impulse * self.program.inverse_masses[contact.a];
        velocities[contact.b] += impulse * self.program.inverse_masses[contact.b];
    }

    /// Returns v* plus the effect of the impulses.
    fn velocities(&self, impulses: &[Impulse]) -> Vec<DVec2> {
        let mut velocities = self.program.free.clone();
        for (contact, &impulse) in self.program.contacts.iter().zip(impulses) {
            self.push(&mut velocities, contact, impulse);
        }
        velocities
    }

    /// Solves for the velocities by Gauss-Seidel until none changes by more than `tolerance`, in units/s.
    pub fn gauss_seidel(&self, tolerance: f64, sweeps_max: u32) -> Vec<DVec2> {
        let contacts = &self.program.contacts;
        let mut velocities = self.program.free.clone();
        let mut impulses = vec![Impulse::ZERO; contacts.len()];
        for _ in 0..sweeps_max {
            let mut largest = 0f64;
            for (contact, impulse) in contacts.iter().zip(&mut impulses) {
                let inverse_mass = self.inverse_mass(contact);
                let wanted = *impulse - self.violation(&velocities, contact) / inverse_mass;
                let press = wanted.x.max(0.0);
                let limit = self.friction * press;
                let next = Impulse::new(press, wanted.y.clamp(-limit, limit));
                self.push(&mut velocities, contact, next - *impulse);
                largest = largest.max((next - *impulse).length() * inverse_mass);
                *impulse = next;
            }
            if largest <= tolerance {
                break;
            }
        }
        velocities
    }

    /// Solves for the velocities by fixed-point iteration until no bound changes by more than `tolerance`.
    pub fn fixed_point(&self, tolerance: f64, rounds_max: u32) -> Vec<DVec2> {
        let mut impulses = vec![Impulse::ZERO; self.program.contacts.len()];
        for _ in 0..rounds_max {
            let bounds: Vec<f64> = impulses.iter().map(|p| self.friction * p.x).collect();
            impulses = self.bounded(&bounds, impulses, tolerance);
            let changed =
                impulses.iter().zip(&bounds).map(|(p, s)| (self.friction * p.x - s).abs());
            if changed.fold(0.0, f64::max) <= tolerance {
                break;
            }
        }
        self.velocities(&impulses)
    }

    /// Solves the problem with given friction bounds, starting from `start`.
    fn bounded(&self, bounds: &[f64], start: Vec<Impulse>, tolerance: f64) -> Vec<Impulse> {
        const ITERATIONS_MAX: u32 = 100_000;
        let mut loads = vec![0.0; self.program.free.len()];
        for contact in &self.program.contacts {
            loads[contact.a] += self.program.inverse_masses[contact.a];
            loads[contact.b] += self.program.inverse_masses[contact.b];
        }
        let steepest = 2.0 * loads.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let (mut impulses, mut ahead, mut theta) = (start.clone(), start, 1.0f64);
        for _ in 0..ITERATIONS_MAX {
            let velocities = self.velocities(&ahead);
            let descend = |index: usize| {
                let violation = self.violation(&velocities, &self.program.contacts[index]);
                let free = ahead[index] - violation / steepest;
                let bound = bounds[index];
                Impulse::new(free.x.max(0.0), free.y.clamp(-bound, bound))
            };
            let next: Vec<Impulse> = (0..ahead.len()).map(descend).collect();
            let all = || 0..next.len();
            let moved = all().map(|i| (next[i] - ahead[i]).length()).fold(0.0, f64::max);
            let uphill: f64 = all().map(|i| (ahead[i] - next[i]).dot(next[i] - impulses[i])).sum();
            let wider = (1.0 + (1.0 + 4.0 * theta * theta).sqrt()) / 2.0;
            let momentum = if uphill > 0.0 { 0.0 } else { (theta - 1.0) / wider };
            theta = if uphill > 0.0 { 1.0 } else { wider };
            ahead = all().map(|i| next[i] + (next[i] - impulses[i]) * momentum).collect();
            impulses = next;
            if moved <= tolerance {
                break;
            }
        }
        impulses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc's velocity after hitting a floor at 45 degrees.
    fn thrown(friction: f64) -> DVec2 {
        let contact = Contact { a: 0, b: 1, normal: DVec2::Y, min_normal_velocity: 0.0 };
        let program = Program {
            inverse_masses: vec![0.0, 1.0],
            free: vec![DVec2::ZERO, DVec2::new(3.0, -3.0)],
            contacts: vec![contact],
        };
        let coulomb = Coulomb { program: &program, friction };
        let (one, other) =
            (coulomb.gauss_seidel(1e-14, 1000)[1], coulomb.fixed_point(1e-14, 1000)[1]);
        assert!(one.distance(other) < 1e-12, "{one} and {other}");
        one
    }

    #[test]
    fn friction_takes_what_its_limit_allows() {
        assert!(thrown(0.0).distance(DVec2::new(3.0, 0.0)) < 1e-12);
        assert!(thrown(0.5).distance(DVec2::new(1.5, 0.0)) < 1e-12);
        assert!(thrown(2.0).distance(DVec2::ZERO) < 1e-12);
    }
}
