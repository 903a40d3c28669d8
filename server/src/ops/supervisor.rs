//! The service manager that started the process, such as systemd, or whatever else waits for its signs of life: it is
//! told when the server serves, that it lives, and when it ends. How, is up to the program that embeds the server.

use crate::host::room_handle::Host;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::interval;

/// A sign of life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// The server listens, and has opened the rooms of the process before.
    Ready,
    /// The server lives: some room has played since the last sign, or none is open.
    Alive,
    /// The server drains, and will end.
    Stopping,
}

/// Passes a sign of life on, without waiting.
pub type Tell = Arc<dyn Fn(Sign) + Send + Sync>;

/// How signs of life are passed on.
#[derive(Clone)]
pub struct Supervisor {
    pub tell: Tell,
    /// Time between two signs that the server lives, more than zero; `None` if none are awaited.
    pub alive_every: Option<Duration>,
}

impl fmt::Debug for Supervisor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Supervisor").field("alive_every", &self.alive_every).finish_non_exhaustive()
    }
}

impl Default for Supervisor {
    /// Nothing is passed on.
    fn default() -> Supervisor {
        Supervisor { tell: Arc::new(|_| {}), alive_every: None }
    }
}

/// Gives a sign of life in each interval for as long as there is life. That this runs shows that the runtime does, which
/// sockets depend on; the rest is seen by [`Pulse`].
pub async fn watch(tell: Tell, every: Duration, host: Arc<Host>) {
    let (mut looks, mut pulse) = (interval(every), Pulse::default());
    loop {
        looks.tick().await;
        if pulse.beats(&host) {
            tell(Sign::Alive);
        }
    }
}

/// Whether rooms play. One that stands still among others that play is for an operator to close: the end of the
/// process would be the end of those too.
#[derive(Default)]
pub struct Pulse {
    /// Ticks of all rooms at the last look.
    played: u64,
}

impl Pulse {
    /// Returns whether no room is open, or ticks were played since the last look.
    pub fn beats(&mut self, host: &Host) -> bool {
        // A list of rooms that stays locked is death too: this thread then stands still.
        let rooms = host.lock().len();
        self.beats_with(rooms, host.metrics.ticks.signs_of_life())
    }

    fn beats_with(&mut self, rooms: usize, played: u64) -> bool {
        let before = std::mem::replace(&mut self.played, played);
        rooms == 0 || played > before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_is_alive_while_rooms_play_and_dead_when_all_of_them_stand_still() {
        let mut pulse = Pulse::default();
        assert!(pulse.beats_with(0, 0), "nothing is to be played");
        assert!(pulse.beats_with(2, 60));
        assert!(pulse.beats_with(2, 61), "one of them plays");
        assert!(!pulse.beats_with(2, 61));
        assert!(!pulse.beats_with(1, 61));
        assert!(pulse.beats_with(1, 62));
        assert!(pulse.beats_with(0, 62), "the last one was closed");
    }
}
