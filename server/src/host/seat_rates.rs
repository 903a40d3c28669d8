//! Rate limits on player actions that come at a cost to others, per seat and for the whole room.

use jostle_game::Seat;
use jostle_sim::TICKS_PER_SECOND;
use std::collections::{BTreeMap, VecDeque};

/// Minimum number of ticks between a player's visible emotes.
pub const EMOTE_TICKS: u32 = 2 * TICKS_PER_SECOND;
/// Maximum number of emotes that a room shows per second; each one is a message to all of the room's clients.
const EMOTES_PER_SECOND_MAX: usize = 16;
/// Minimum number of ticks between a player's clips: four clips per minute.
const CLIP_APART_TICKS: u32 = 15 * TICKS_PER_SECOND;
/// Maximum number of clips per minute in a room. Each clip is a file that takes up to half a second of the writer's
/// time.
const CLIPS_PER_MINUTE_MAX: usize = 8;

/// Minimum number of ticks between changes of a player's name or colour.
pub const LOOK_TICKS: u32 = 2 * TICKS_PER_SECOND;
/// Maximum number of such changes per second in a room; each one is a line in the activity of all of the room's clients.
const LOOKS_PER_SECOND_MAX: usize = 8;

/// The recent actions of a room's players, and the limits on them.
#[derive(Debug)]
pub struct SeatRates {
    /// Minimum number of ticks between actions by one seat.
    apart: u32,
    /// Number of ticks in which all seats together may act `most` times.
    window: u32,
    most: usize,
    /// Tick of each seat's last action.
    last: BTreeMap<Seat, u32>,
    /// Ticks of all actions in the current window.
    recent: VecDeque<u32>,
}

impl SeatRates {
    pub fn of_emotes() -> SeatRates {
        SeatRates::new(EMOTE_TICKS, EMOTES_PER_SECOND_MAX, TICKS_PER_SECOND)
    }

    pub fn of_looks() -> SeatRates {
        SeatRates::new(LOOK_TICKS, LOOKS_PER_SECOND_MAX, TICKS_PER_SECOND)
    }

    pub fn of_clips() -> SeatRates {
        SeatRates::new(CLIP_APART_TICKS, CLIPS_PER_MINUTE_MAX, 60 * TICKS_PER_SECOND)
    }

    /// Creates limits with no past actions. A seat may act every `apart` ticks, and all seats together may act `most`
    /// times in `window` ticks.
    fn new(apart: u32, most: usize, window: u32) -> SeatRates {
        SeatRates { apart, window, most, last: BTreeMap::new(), recent: VecDeque::new() }
    }

    /// Returns whether this seat may act in this tick, and counts the action if so.
    pub fn admit(&mut self, seat: Seat, tick: u32) -> bool {
        while self.recent.front().is_some_and(|past| tick - past >= self.window) {
            self.recent.pop_front();
        }
        let rested = self.last.get(&seat).is_none_or(|last| tick - last >= self.apart);
        let allowed = rested && self.recent.len() < self.most;
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
    fn a_seat_has_to_wait() {
        let mut rates = SeatRates::new(120, 16, 60);
        let allowed: Vec<u32> = (0..300).filter(|&tick| rates.admit(Seat(3), tick)).collect();
        assert_eq!(allowed, [0, 120, 240]);
        assert!(rates.admit(Seat(4), 299));
    }

    #[test]
    fn all_together_have_a_limit() {
        let mut rates = SeatRates::new(120, 16, 60);
        assert_eq!((0..100).filter(|&seat| rates.admit(Seat(seat), 7)).count(), 16);
        assert!(!rates.admit(Seat(50), 66) && rates.admit(Seat(50), 67), "a window later");
    }
}
