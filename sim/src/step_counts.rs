//! Counts of the work in a step, a measure of its time that is the same on every machine.

/// Counts of the last step. Each counts an operation that always takes about the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCounts {
    /// Awake bodies that may move.
    pub moving: u64,
    /// Pairs of bodies near each other.
    pub pairs: u64,
    /// Pairs written to the pair list. A build counts all pairs and sorted bodies; an extension counts the pairs
    /// found and a share of the pairs moved.
    pub listed: u64,
    /// Visits of single contacts: by passes, and by sweeps that use neither colours nor chains.
    pub visits: u64,
    /// With the relaxation solver, the visits of pairs that still touch at the end of the step.
    pub touching: u64,
    /// Visits of four contacts side by side, in sweeps by colour.
    pub wide: u64,
    /// Visits of contacts in chains.
    pub links: u64,
    /// Bodies moved by forests, in sweeps.
    pub nodes: u64,
    /// Visits charged for the elimination of islands that sweeps do not solve.
    pub eliminated: u64,
    /// Predictions of times of impact.
    pub predictions: u64,
    /// Contacts solved by the conjugate solver's passes over positions.
    pub corrected: u64,
    /// Spring visits by the rounds in which networks of springs are solved, including those charged for
    /// factorisations.
    pub springs: u64,
    /// The solver's work in its last attempt: visits of pairs, and predictions of impacts.
    pub solves: u64,
    /// Live particles.
    pub particles: u64,
}
