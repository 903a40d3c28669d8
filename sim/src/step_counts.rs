//! Counts of the work of a step: a measure of its time that is the same on every machine.

/// Counts of the last step, each of something that takes about the same time whenever it is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCounts {
    /// Bodies that are awake and may move.
    pub moving: u64,
    /// Pairs of bodies near each other.
    pub pairs: u64,
    /// Pairs written to the list of pairs: all of them, and the bodies sorted, each time it is built; those found, and a share of
    /// those moved, when it is extended.
    pub listed: u64,
    /// Visits of contacts one after another: by passes, and by sweeps that visit them neither by colour nor in chains.
    pub visits: u64,
    /// With the relaxation, those of pairs that still touch at the end of the step.
    pub touching: u64,
    /// Visits of four contacts side by side, by sweeps by colour.
    pub wide: u64,
    /// Visits of contacts in chains.
    pub links: u64,
    /// Bodies that forests move, by sweeps.
    pub nodes: u64,
    /// Visits that stand for the elimination of islands that sweeps do not solve.
    pub eliminated: u64,
    /// Predictions of times of impact.
    pub predictions: u64,
    /// Contacts that the passes of the conjugate solver over positions solve.
    pub corrected: u64,
    /// Visits of springs by the rounds in which networks of springs are solved, with what their factorisations stand for.
    pub springs: u64,
    /// The solver's work in its last attempt: visits of pairs, and predictions of impacts.
    pub solves: u64,
    /// Particles that are alive.
    pub particles: u64,
}
