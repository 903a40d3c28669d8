//! One subscription to snapshots, and its rate.

use jostle_game::Seat;

/// How often a client gets a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rate {
    /// A snapshot of every tick.
    #[default]
    Full,
    /// A snapshot of every third tick.
    Third,
    /// A snapshot of every twelfth tick.
    Twelfth,
}

impl Rate {
    /// All rates, the highest first.
    pub const ALL: [Rate; 3] = [Rate::Full, Rate::Third, Rate::Twelfth];

    /// Ticks from one message to the next.
    pub fn every(self) -> u8 {
        match self {
            Rate::Full => 1,
            Rate::Third => 3,
            Rate::Twelfth => 12,
        }
    }

    /// The next lower rate, for a client that falls behind; the lowest stays.
    pub fn lower(self) -> Rate {
        match self {
            Rate::Full => Rate::Third,
            Rate::Third | Rate::Twelfth => Rate::Twelfth,
        }
    }

    /// The next higher rate, for a client that has caught up; the highest stays.
    pub fn higher(self) -> Rate {
        match self {
            Rate::Full | Rate::Third => Rate::Full,
            Rate::Twelfth => Rate::Third,
        }
    }
}

/// A client's subscription to a snapshot channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subscriber {
    /// How often it gets a snapshot.
    pub rate: Rate,
    /// Tick of its keyframe.
    pub keyframe_tick: u32,
    /// Messages that the channel had sent before the keyframe.
    pub(super) since: u64,
    /// The player whose interest area this is; `None` for the whole world.
    pub(super) seat: Option<Seat>,
}

impl Subscriber {
    /// The subscription to the interest area of this player.
    pub(super) fn of(self, seat: Seat) -> Subscriber {
        Subscriber { seat: Some(seat), ..self }
    }
}
