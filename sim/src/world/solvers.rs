//! A world's solvers, of which one is used, and their part of a step's counts.

use crate::growth::ScratchUse;
use crate::solver::conjugate::ConjugateSolver;
use crate::solver::relaxation::RelaxationSolver;
use crate::step_counts::StepCounts;

/// Scratch for the two solvers. That of the unused one is empty, and counts nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solvers {
    pub relaxation: RelaxationSolver,
    pub conjugate: Box<ConjugateSolver>,
    scratch_use: ScratchUse,
}

impl Solvers {
    /// Releases the scratch if it is far larger than recent steps needed, since a heap that has come apart or to rest
    /// once had many constraints. Returns whether it was.
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

    /// Number of passes or sweeps over the contacts in the latest step.
    #[cfg(test)]
    pub fn passes(&self) -> u32 {
        self.relaxation.passes + self.conjugate.work.sweeps
    }

    /// Pairs that take part in the step, by slots.
    pub fn pairs(&self) -> impl Iterator<Item = (u32, u32)> {
        let relaxed = self.relaxation.constraints.iter().map(|pair| (pair.a, pair.b));
        relaxed.chain(self.conjugate.contacts.constraints.iter().map(|pair| (pair.a, pair.b)))
    }

    /// Counts of the latest step, given its numbers of moving bodies, pairs and touching pairs. If the conjugate solver
    /// started over because it woke bodies, all its attempts count.
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
