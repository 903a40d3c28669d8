//! Limits on how often the players of a room may do something that costs others: of each seat, and of all.

use jostle_game::Seat;
use jostle_sim::TICKS_PER_SECOND;
use std::collections::{BTreeMap, VecDeque};

/// Ticks from one emote of a player to the next that is shown.
pub const EMOTE_TICKS: u32 = 2 * TICKS_PER_SECOND;
/// Emotes that a room shows in a second; each is a message to all of its clients.
const EMOTES_PER_SECOND_MAX: usize = 16;
/// Ticks from one clip of a player to the next: four a minute.
const CLIP_APART_TICKS: u32 = 15 * TICKS_PER_SECOND;
/// Clips of a room in a minute. Each is a file, and up to half a second of the writer.
const CLIPS_PER_MINUTE_MAX: usize = 8;

/// What the players of a room did lately, and how often they may.
#[derive(Debug)]
pub struct SeatRates {
    /// Ticks from one time to the next of a seat.
    apart: u32,
    /// In so many ticks all together may do it `most` times.
    window: u32,
    most: usize,
    /// Tick of the last time of each seat.
    last: BTreeMap<Seat, u32>,
    /// Ticks of all times in the last window.
    recent: VecDeque<u32>,
}

impl SeatRates {
    pub fn of_emotes() -> SeatRates {
        SeatRates::new(EMOTE_TICKS, EMOTES_PER_SECOND_MAX, TICKS_PER_SECOND)
    }

    pub fn of_clips() -> SeatRates {
        SeatRates::new(CLIP_APART_TICKS, CLIPS_PER_MINUTE_MAX, 60 * TICKS_PER_SECOND)
    }

    /// Nothing was done yet: a seat may do it every `apart` ticks, all together `most` times in `window` ticks.
    fn new(apart: u32, most: usize, window: u32) -> SeatRates {
        SeatRates { apart, window, most, last: BTreeMap::new(), recent: VecDeque::new() }
    }

    /// Returns whether this seat may do it at this tick, and counts it if so.
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
