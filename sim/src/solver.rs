//! The contact solvers that a world can use.

mod agitation;
pub(crate) mod as_listed;
pub(crate) mod chains;
pub(crate) mod conjugate;
pub(crate) mod contact_constraint;
mod direct;
mod energy_guard;
mod gauss_seidel;
mod graph_coloring;
pub(crate) mod islands;
mod pava;
mod position_correction;
pub(crate) mod relaxation;
pub(crate) mod settings;
mod spanning_forest;
pub(crate) mod step_context;
mod sweep;
pub(crate) mod tolerances;
mod warm_start;

use settings::{Conjugate, Relaxation};

/// A solver and its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// The chapter's method (A0.13), which uses projection and impulses in a limited number of passes.
    Relaxation(Relaxation),
    /// Finds velocities that satisfy all contacts at once, by sweeping until they converge.
    Conjugate(Conjugate),
}

impl Default for Solver {
    fn default() -> Solver {
        Solver::Relaxation(Relaxation::default())
    }
}

impl Solver {
    /// Panics unless every setting is in its documented range (C22c).
    pub(crate) fn check(&self) {
        match self {
            Solver::Relaxation(settings) => settings.check(),
            Solver::Conjugate(settings) => settings.check(),
        }
    }
}
