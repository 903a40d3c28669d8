//! The solvers of a world, one of which is used, and their part of the counts of a step.

use crate::growth::ScratchUse;
use crate::solver::conjugate::ConjugateSolver;
use crate::solver::relaxation::RelaxationSolver;
use crate::step_counts::StepCounts;

/// Scratch of the two solvers. That of the one that is not used is empty, and counts nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solvers {
    pub relaxation: RelaxationSolver,
    pub conjugate: Box<ConjugateSolver>,
    scratch_use: ScratchUse,
}

impl Solvers {
    /// Releases the scratch where it is far larger than the last steps needed: a heap that came apart or to rest once had
    /// many constraints. Returns whether it was.
    pub fn release(&mut self) -> bool {
        let (relaxed, solved) =
            (&self.relaxation.constraints, &self.conjugate.contacts.constraints);
        let capacity = relaxed.capacity() + solved.capacity();
        let is_too_large = self.scratch_use.is_small(relaxed.len() + solved.len(), capacity);
        if is_too_large {
            self.relaxation.release();
            self.conjugate.release();
        }
        is_too_large
    }

    /// Number of passes or sweeps over the contacts in the last step.
    #[cfg(test)]
    pub fn passes(&self) -> u32 {
        self.relaxation.passes + self.conjugate.work.sweeps
    }

    /// Pairs that take part in the step, by slots.
    pub fn pairs(&self) -> impl Iterator<Item = (u32, u32)> {
        let relaxed = self.relaxation.constraints.iter().map(|pair| (pair.a, pair.b));
        relaxed.chain(self.conjugate.contacts.constraints.iter().map(|pair| (pair.a, pair.b)))
    }

    /// Counts of the last step, among these moving bodies and pairs, of which some touch. Where the conjugate solver began
    /// again, because it woke bodies, all its attempts count.
    pub fn counts(&self, moving: usize, pairs: usize, touching: usize) -> StepCounts {
        let RelaxationSolver { passes, constraints, .. } = &self.relaxation;
        let visits = u64::from(*passes) * constraints.len() as u64;
        let solved = self.conjugate.counts(moving, pairs);
        StepCounts {
            visits: solved.visits + visits,
            touching: u64::from(*passes) * touching as u64,
            solves: self.conjugate.work.done + visits,
            ..solved
        }
    }
}
