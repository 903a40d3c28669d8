//! Counts of the work in a step. They measure its time in a way that is the same on every machine.

/// Counts of the latest step. Each one counts an operation that always takes about the same time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCounts {
    /// Awake bodies that may move.
    pub moving: u64,
    /// Pairs of bodies near each other.
    pub pairs: u64,
    /// Pairs written to the pair list. A build counts all pairs and sorted bodies; an extension counts the pairs
    /// found and a share of the pairs moved.
    pub listed: u64,
    /// Visits to single contacts, by passes, and by sweeps that use neither colours nor chains.
    pub visits: u64,
    /// With the relaxation solver, visits to pairs that still touch at the end of the step.
    pub touching: u64,
    /// Visits to four contacts side by side, in sweeps by colour.
    pub wide: u64,
    /// Visits to contacts in chains.
    pub links: u64,
    /// Bodies moved by forests, in sweeps.
    pub nodes: u64,
    /// Visits charged for eliminations in islands that sweeps do not solve.
    pub eliminated: u64,
    /// Predicted times of impact.
    pub predictions: u64,
    /// Contacts solved by the conjugate solver's passes over positions.
    pub corrected: u64,
    /// Spring visits made by the rounds that solve networks of springs, including those charged for
    /// factorisations.
    pub springs: u64,
    /// The solver's work in its last attempt, which consists of visits to pairs and predictions of impacts.
    pub solves: u64,
    /// Live particles.
    pub particles: u64,
}
