//! The clock of a round.

/// The phase of a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum RoundPhase {
    /// Players are still missing, and nothing counts.
    #[default]
    Waiting,
    /// Everything is in place, and heroes cannot move.
    Countdown,
    /// The round is being played. A scene without rounds is always in this phase.
    Running,
    /// The result is shown until the next round begins.
    Over,
}

impl RoundPhase {
    /// All phases, in wire order.
    pub const ALL: [RoundPhase; 4] =
        [RoundPhase::Waiting, RoundPhase::Countdown, RoundPhase::Running, RoundPhase::Over];
}

/// The clock of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Round {
    pub phase: RoundPhase,
    /// Ticks in this phase, including the current one.
    pub ticks: u32,
    /// Ticks since the bodies were placed, including the current one.
    pub clock: u32,
}

impl Round {
    /// Creates the clock before the first tick.
    pub fn new(has_rounds: bool) -> Round {
        let phase = if has_rounds { RoundPhase::Waiting } else { RoundPhase::Running };
        Round { phase, ticks: 0, clock: 0 }
    }

    pub fn is_running(&self) -> bool {
        self.phase == RoundPhase::Running
    }

    /// Switches to a phase in which this many ticks have been played, including the current one.
    pub fn enter(&mut self, phase: RoundPhase, ticks: u32) {
        *self = Round { phase, ticks, ..*self };
    }
}
