//! Which method solves the contacts of a world.

use crate::conjugate::Conjugate;
use crate::relaxation::Relaxation;

/// A method and its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// The chapter's: projection and impulse, a fixed number of passes.
    Relaxation(Relaxation),
    /// Velocities that satisfy all contacts at once, by sweeps until they have converged.
    Conjugate(Conjugate),
}

impl Default for Solver {
    fn default() -> Solver {
        Solver::Relaxation(Relaxation::default())
    }
}

impl Solver {
    /// Panics unless every setting is in its documented range (C22c: nothing is mended silently).
    pub(crate) fn check(&self) {
        match self {
            Solver::Relaxation(settings) => settings.check(),
            Solver::Conjugate(settings) => settings.check(),
        }
    }
}
