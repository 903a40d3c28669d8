//! The clock of a round.

/// What a round is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum RoundPhase {
    /// Players are missing; nothing counts.
    #[default]
    Waiting,
    /// Everything is in place, and heroes stand.
    Countdown,
    /// It is played. A scene without rounds is always here.
    Running,
    /// Its result stands until the next round begins.
    Over,
}

impl RoundPhase {
    /// Every phase, in wire order.
    pub const ALL: [RoundPhase; 4] =
        [RoundPhase::Waiting, RoundPhase::Countdown, RoundPhase::Running, RoundPhase::Over];
}

/// The clock of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Round {
    pub phase: RoundPhase,
    /// Ticks of this phase, the one being played included.
    pub ticks: u32,
    /// Ticks since the bodies were placed, the one being played included.
    pub clock: u32,
}

impl Round {
    /// Before the first tick.
    pub fn new(has_rounds: bool) -> Round {
        let phase = if has_rounds { RoundPhase::Waiting } else { RoundPhase::Running };
        Round { phase, ticks: 0, clock: 0 }
    }

    pub fn is_running(&self) -> bool {
        self.phase == RoundPhase::Running
    }

    /// Changes over to a phase of which so many ticks are played, the current one included.
    pub fn enter(&mut self, phase: RoundPhase, ticks: u32) {
        *self = Round { phase, ticks, ..*self };
    }
}
