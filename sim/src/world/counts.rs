//! The counts of a world's last step.

use super::World;
use crate::forces::Forces;
use crate::step_counts::StepCounts;

impl World {
    /// Counts of the last step. Where the conjugate solver began again, because it woke bodies, all its attempts count.
    pub fn step_counts(&self) -> StepCounts {
        let (moving, pairs) = (self.bodies.moving.len(), self.pairs.pairs.len());
        let of_solver = match self.settings.is_conjugate() {
            true => self.conjugate.counts(moving, pairs),
            false => StepCounts {
                moving: moving as u64,
                pairs: pairs as u64,
                visits: self.pair_solves(),
                touching: u64::from(self.relaxation.passes) * self.touches.now.len() as u64,
                ..StepCounts::default()
            },
        };
        let springs = self.forces.as_ref().map_or(0, Forces::spring_visits);
        let listed = self.pairs.listed;
        StepCounts { springs, listed, particles: self.particles.len() as u64, ..of_solver }
    }
}
