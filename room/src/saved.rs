//! The members of a room as they are kept beside its recording, to outlive its process.

use serde::{Deserialize, Serialize};

/// Who has which seat, and by which claims.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedMembers {
    /// Seats that bots fill; less than the scene says once some were dismissed.
    pub bots: usize,
    /// The seats that are taken, in order.
    pub seats: Vec<SavedSeat>,
}

/// A seat that is taken.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedSeat {
    /// Number of the seat.
    pub seat: u16,
    /// Serial of the claim that gives it back.
    pub serial: u64,
    /// Serial of the claim before, while that is good too.
    pub serial_before: Option<u64>,
    /// Tick after which its player took it; 0 in files of an older version.
    #[serde(default)]
    pub joined_tick: u32,
    /// Tick at which its player's socket was lost.
    pub lost_tick: Option<u32>,
    /// Whether a bot has it.
    pub is_bot: bool,
}
