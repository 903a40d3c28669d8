//! Levels, and conditions on them.

/// The levels that are on: one bit for each zone, signal and built-in level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    /// Zones, by their index in the file.
    pub zones: u64,
    /// Signals, by their index in the file.
    pub signals: u64,
    /// Teams that are in, by their index in the file.
    pub teams: u8,
    /// Levels of the sling.
    pub sling: u8,
}

impl Levels {
    /// The level of one zone.
    pub fn zone(index: usize) -> Levels {
        Levels { zones: 1 << index, ..Levels::default() }
    }

    /// The level of one signal.
    pub fn signal(index: usize) -> Levels {
        Levels { signals: 1 << index, ..Levels::default() }
    }

    /// The level of one team.
    pub fn team(index: usize) -> Levels {
        Levels { teams: 1 << index, ..Levels::default() }
    }

    /// Only the level that is on once the sling's last shot is over.
    pub const SPENT: Levels = Levels { zones: 0, signals: 0, teams: 0, sling: 1 };
    /// Only the level that is on while the sling's ball is flying.
    pub const FLYING: Levels = Levels { sling: 2, ..Levels::SPENT };

    /// Levels that are on in either of the two.
    pub fn or(self, other: Levels) -> Levels {
        Levels {
            zones: self.zones | other.zones,
            signals: self.signals | other.signals,
            teams: self.teams | other.teams,
            sling: self.sling | other.sling,
        }
    }

    fn and(self, other: Levels) -> Levels {
        Levels {
            zones: self.zones & other.zones,
            signals: self.signals & other.signals,
            teams: self.teams & other.teams,
            sling: self.sling & other.sling,
        }
    }

    /// Returns whether nothing is on.
    pub fn is_none(self) -> bool {
        self == Levels::default()
    }
}

/// Levels that must be on, and others that must be off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Condition {
    /// Levels that must be on.
    pub on: Levels,
    /// Levels that must be off.
    pub off: Levels,
}

impl Condition {
    /// Returns whether the condition requires nothing.
    pub fn is_none(&self) -> bool {
        self.on.is_none() && self.off.is_none()
    }

    /// Returns whether the whole condition holds.
    pub fn all(&self, levels: Levels) -> bool {
        self.on.and(levels) == self.on && self.off.and(levels).is_none()
    }

    /// Returns whether any part of the condition holds.
    pub fn any(&self, levels: Levels) -> bool {
        !self.on.and(levels).is_none() || self.off.and(levels) != self.off
    }
}
