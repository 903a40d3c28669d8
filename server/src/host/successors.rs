//! The rooms that hosts open after they have closed one. Players of a closed room are led to the next one for a while, so
//! that a party stays together.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time for which a closed room is remembered.
const REMEMBERED: Duration = Duration::from_secs(300);
/// Maximum number of closed rooms that are remembered; further ones replace the oldest.
const CLOSED_MAX: usize = 64;

/// The rooms that were closed lately.
#[derive(Debug, Default)]
pub struct Successors {
    /// The oldest first.
    closed: Mutex<VecDeque<ClosedRoom>>,
}

#[derive(Debug)]
struct ClosedRoom {
    /// [`crate::host::room_handle::RoomInfo::number`].
    number: u64,
    /// Serial numbers of the claims of those who were in the room to the end.
    claims: Vec<u64>,
    at: Instant,
    /// Code of the room that the host opened since.
    next: Option<String>,
}

impl Successors {
    /// Remembers a room that was closed, and the serial numbers of its players' claims.
    pub fn note_closed(&self, number: u64, claims: Vec<u64>, now: Instant) {
        let mut closed = self.lock(now);
        if closed.len() == CLOSED_MAX {
            closed.pop_front();
        }
        closed.push_back(ClosedRoom { number, claims, at: now, next: None });
    }

    /// Notes that the host of a closed room has opened the room with this code.
    pub fn lead(&self, number: u64, code: &str, now: Instant) {
        let mut closed = self.lock(now);
        closed
            .iter_mut()
            .filter(|room| room.number == number)
            .for_each(|room| room.next = Some(code.to_owned()));
    }

    /// The code of the next room, for a player who was in the closed room with this claim.
    pub fn next(&self, number: u64, claim: u64, now: Instant) -> Option<String> {
        let closed = self.lock(now);
        let room = closed.iter().find(|room| room.number == number)?;
        room.next.clone().filter(|_| room.claims.contains(&claim))
    }

    /// The rooms that are still remembered.
    fn lock(&self, now: Instant) -> MutexGuard<'_, VecDeque<ClosedRoom>> {
        let mut closed = self.closed.lock().unwrap_or_else(PoisonError::into_inner);
        closed.retain(|room| now.saturating_duration_since(room.at) < REMEMBERED);
        closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn players_of_a_closed_room_are_led_to_the_next_for_a_while() {
        let (rooms, now) = (Successors::default(), Instant::now());
        rooms.lead(7, "early", now);
        rooms.note_closed(7, vec![3, 4], now);
        assert_eq!(rooms.next(7, 3, now), None, "not opened yet");
        rooms.lead(7, "oak", now);
        rooms.lead(8, "elm", now);
        assert_eq!(rooms.next(7, 4, now).as_deref(), Some("oak"));
        assert_eq!(rooms.next(7, 5, now), None, "was not there at the end");
        assert_eq!(rooms.next(8, 4, now), None);
        assert_eq!(rooms.next(7, 4, now + REMEMBERED), None);
        (0..CLOSED_MAX as u64 + 1).for_each(|number| rooms.note_closed(number, vec![1], now));
        rooms.lead(0, "ash", now);
        rooms.lead(1, "fir", now);
        assert_eq!([0, 1].map(|number| rooms.next(number, 1, now).is_some()), [false, true]);
    }
}
