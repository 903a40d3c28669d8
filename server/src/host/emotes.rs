//! The rates of emotes: of each seat, and of a room, since each is sent to all of its clients.

use crate::limits::{EMOTE_TICKS, EMOTES_PER_SECOND_MAX};
use jostle_game::Seat;
use jostle_sim::TICKS_PER_SECOND;
use std::collections::{BTreeMap, VecDeque};

/// The emotes that a room showed lately.
#[derive(Debug, Default)]
pub struct Emotes {
    /// Tick of the last one of each seat.
    last: BTreeMap<Seat, u32>,
    /// Ticks of those of the last second.
    recent: VecDeque<u32>,
}

impl Emotes {
    /// Returns whether an emote of this seat may be shown at this tick, and counts it if so.
    pub fn admit(&mut self, seat: Seat, tick: u32) -> bool {
        while self.recent.front().is_some_and(|shown| tick - shown >= TICKS_PER_SECOND) {
            self.recent.pop_front();
        }
        let rested = self.last.get(&seat).is_none_or(|last| tick - last >= EMOTE_TICKS);
        let allowed = rested && self.recent.len() < EMOTES_PER_SECOND_MAX;
        if allowed {
            self.last.insert(seat, tick);
            self.recent.push_back(tick);
        }
        allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seat_shows_one_emote_in_two_seconds() {
        let mut emotes = Emotes::default();
        let shown: Vec<u32> = (0..300).filter(|&tick| emotes.admit(Seat(3), tick)).collect();
        assert_eq!(shown, [0, 120, 240]);
        assert!(emotes.admit(Seat(4), 299));
    }

    #[test]
    fn a_room_shows_sixteen_in_a_second() {
        let mut emotes = Emotes::default();
        let shown = (0..100).filter(|&seat| emotes.admit(Seat(seat), 7)).count();
        assert_eq!(shown, EMOTES_PER_SECOND_MAX);
        assert!(!emotes.admit(Seat(50), 66) && emotes.admit(Seat(50), 67), "a second later");
    }
}
