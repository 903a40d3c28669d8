//! The phases of a tick. Two runs can be compared after each of them.

use jostle_sim::StepPhase;

/// The phases of a tick, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Players join and leave; rules and tools set velocities.
    Inputs,
    /// Velocities are integrated, then positions.
    Integrate,
    /// The pairs that take part in the step are found.
    Pairs,
    /// Contacts are solved and overlaps removed.
    Relax,
    /// Events are reported and rules act on them; tools make new bodies.
    Events,
    /// Particles move, and emitters make more of them.
    Particles,
}

impl Phase {
    /// All phases, in order.
    pub const ALL: [Phase; 6] = [
        Phase::Inputs,
        Phase::Integrate,
        Phase::Pairs,
        Phase::Relax,
        Phase::Events,
        Phase::Particles,
    ];

    /// Lower-case name, for metrics and reports.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Inputs => "inputs",
            Phase::Integrate => "integrate",
            Phase::Pairs => "pairs",
            Phase::Relax => "relax",
            Phase::Events => "events",
            Phase::Particles => "particles",
        }
    }
}

impl From<StepPhase> for Phase {
    fn from(phase: StepPhase) -> Phase {
        match phase {
            StepPhase::Integrate => Phase::Integrate,
            StepPhase::Pairs => Phase::Pairs,
            StepPhase::Relax => Phase::Relax,
        }
    }
}
