//! The contact problem of one step without friction as a quadratic program in f64: the velocities
//! nearest to v* in the mass norm with n.(vb - va) >= `min_normal_velocity` for every contact.
//!
//! Three methods share no code: Gauss-Seidel and accelerated projected gradients on the impulses and, for a chain along
//! one axis, pool-adjacent-violators on the velocities.

use glam::DVec2;

/// Two bodies that must not approach each other faster than allowed.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Index of the first body.
    pub a: usize,
    /// Index of the other body.
    pub b: usize,
    /// Unit vector from a to b.
    pub normal: DVec2,
    /// Smallest allowed n.(vb - va): -separation / h for a contact that is still open.
    pub min_normal_velocity: f64,
}

#[derive(Clone, Debug, Default)]
pub struct Program {
    /// Inverse masses of the bodies; 0 for immovable ones.
    pub inverse_masses: Vec<f64>,
    /// v*, the velocities without contacts.
    pub free: Vec<DVec2>,
    /// All contacts, each with at least one movable body.
    pub contacts: Vec<Contact>,
}

/// Impulses and the resulting velocities.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Non-negative impulses, one per contact.
    pub impulses: Vec<f64>,
    pub velocities: Vec<DVec2>,
    /// Number of sweeps or iterations taken.
    pub sweeps: u32,
}

impl Program {
    fn inverse_mass(&self, contact: &Contact) -> f64 {
        self.inverse_masses[contact.a] + self.inverse_masses[contact.b]
    }

    fn push(&self, velocities: &mut [DVec2], contact: &Contact, impulse: f64) {
        velocities[contact.a] -= contact.normal * (impulse * self.inverse_masses[contact.a]);
        velocities[contact.b] += contact.normal * (impulse * self.inverse_masses[contact.b]);
    }

    fn excess(&self, velocities: &[DVec2], contact: &Contact) -> f64 {
        contact.normal.dot(velocities[contact.b] - velocities[contact.a])
            - contact.min_normal_velocity
    }

    /// Solves by Gauss-Seidel from zero until no velocity changes by more than `tolerance`, in units/s.
    pub fn gauss_seidel(&self, tolerance: f64, sweeps_max: u32) -> Solution {
        self.gauss_seidel_from(&vec![0.0; self.contacts.len()], tolerance, sweeps_max)
    }

    /// Solves by Gauss-Seidel, starting from given impulses, which may already be close to the solution.
    pub fn gauss_seidel_from(&self, start: &[f64], tolerance: f64, sweeps_max: u32) -> Solution {
        let mut velocities = self.velocities(start);
        let mut impulses = start.to_vec();
        for sweep in 1..=sweeps_max {
            let mut largest = 0f64;
            for (contact, impulse) in self.contacts.iter().zip(&mut impulses) {
                let inverse_mass = self.inverse_mass(contact);
                let wanted = *impulse - self.excess(&velocities, contact) / inverse_mass;
                let change = wanted.max(0.0) - *impulse;
                *impulse += change;
                self.push(&mut velocities, contact, change);
                largest = largest.max(change.abs() * inverse_mass);
            }
            if largest <= tolerance {
                return Solution { impulses, velocities, sweeps: sweep };
            }
        }
        Solution { impulses, velocities, sweeps: sweeps_max }
    }

    /// Solves by Nesterov's gradient method with restarts (O'Donoghue and Candes 2015), starting from zero.
    pub fn accelerated(&self, tolerance: f64, iterations_max: u32) -> Solution {
        // Twice the largest sum over a body's contacts bounds the largest eigenvalue of A.
        let mut loads = vec![0.0; self.free.len()];
        for contact in &self.contacts {
            loads[contact.a] += self.inverse_masses[contact.a];
            loads[contact.b] += self.inverse_masses[contact.b];
        }
        let bound = 2.0 * loads.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let mut impulses = vec![0.0; self.contacts.len()];
        let (mut ahead, mut theta) = (impulses.clone(), 1.0f64);
        for iteration in 1..=iterations_max {
            let velocities = self.velocities(&ahead);
            let descend = |(contact, &impulse): (&Contact, &f64)| {
                f64::max(impulse - self.excess(&velocities, contact) / bound, 0.0)
            };
            let next: Vec<f64> = self.contacts.iter().zip(&ahead).map(descend).collect();
            let uphill: f64 =
                (0..next.len()).map(|i| (ahead[i] - next[i]) * (next[i] - impulses[i])).sum();
            let wider = (1.0 + (1.0 + 4.0 * theta * theta).sqrt()) / 2.0;
            let momentum = if uphill > 0.0 { 0.0 } else { (theta - 1.0) / wider };
            theta = if uphill > 0.0 { 1.0 } else { wider };
            ahead = (0..next.len()).map(|i| next[i] + momentum * (next[i] - impulses[i])).collect();
            impulses = next;
            if iteration % 16 == 0 && self.residual(&impulses) <= tolerance {
                let velocities = self.velocities(&impulses);
                return Solution { impulses, velocities, sweeps: iteration };
            }
        }
        let velocities = self.velocities(&impulses);
        Solution { impulses, velocities, sweeps: iterations_max }
    }

    /// Returns v* plus the effect of the impulses.
    pub fn velocities(&self, impulses: &[f64]) -> Vec<DVec2> {
        let mut velocities = self.free.clone();
        for (contact, &impulse) in self.contacts.iter().zip(impulses) {
            self.push(&mut velocities, contact, impulse);
        }
        velocities
    }

    /// Residual of the natural map: the largest |l - max(0, l - w)|, scaled to units/s. It is 0 only at the optimum.
    pub fn residual(&self, impulses: &[f64]) -> f64 {
        let velocities = self.velocities(impulses);
        let one = |(contact, &impulse): (&Contact, &f64)| {
            let load = impulse * self.inverse_mass(contact);
            (load - (load - self.excess(&velocities, contact)).max(0.0)).abs()
        };
        self.contacts.iter().zip(impulses).map(one).fold(0.0, f64::max)
    }
}

/// Pool-adjacent-violators: the non-decreasing sequence closest to `values` in the norm of `weights`. Values with
/// infinite weight stay fixed. Barlow and Brunk 1972; O(n).
pub fn pava(values: &[f64], weights: &[f64]) -> Vec<f64> {
    struct Block {
        value: f64,
        weight: f64,
        count: usize,
    }
    let mut blocks: Vec<Block> = Vec::new();
    for (&value, &weight) in values.iter().zip(weights) {
        let mut last = Block { value, weight, count: 1 };
        while let Some(before) = blocks.pop_if(|before| before.value > last.value) {
            let weight = before.weight + last.weight;
            let value = match (before.weight.is_infinite(), last.weight.is_infinite()) {
                (true, _) => before.value,
                (_, true) => last.value,
                _ => (before.value * before.weight + last.value * last.weight) / weight,
            };
            last = Block { value, weight, count: before.count + last.count };
        }
        blocks.push(last);
    }
    blocks.iter().flat_map(|block| std::iter::repeat_n(block.value, block.count)).collect()
}

#[cfg(test)]
mod tests;
