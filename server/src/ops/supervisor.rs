//! The service manager that started the process, such as systemd, or another program that expects status notifications:
//! it is told when the server is ready, that it is alive, and when it ends. The embedding program decides how these are
//! sent.

use crate::host::room_handle::Host;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::interval;

/// A status notification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// The server is listening, and has opened the rooms of the previous process.
    Ready,
    /// The server is alive: some room has played since the last notification, or none is open.
    Alive,
    /// The server is draining, and will end.
    Stopping,
}

/// Passes on a notification, without waiting.
pub type Tell = Arc<dyn Fn(Sign) + Send + Sync>;

/// The recipient of status notifications.
#[derive(Clone)]
pub struct Supervisor {
    pub tell: Tell,
    /// Time between two alive notifications, more than zero; `None` if none are expected.
    pub alive_every: Option<Duration>,
}

impl fmt::Debug for Supervisor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Supervisor").field("alive_every", &self.alive_every).finish_non_exhaustive()
    }
}

impl Default for Supervisor {
    /// Discards all notifications.
    fn default() -> Supervisor {
        Supervisor { tell: Arc::new(|_| {}), alive_every: None }
    }
}

/// Sends an alive notification in each interval while the server is alive. The fact that this task runs shows that the
/// runtime works, on which sockets depend; [`Pulse`] checks the rest.
pub async fn watch(tell: Tell, every: Duration, host: Arc<Host>) {
    let (mut looks, mut pulse) = (interval(every), Pulse::default());
    loop {
        looks.tick().await;
        if pulse.beats(&host) {
            tell(Sign::Alive);
        }
    }
}

/// Detects whether rooms are playing. If one room is blocked while others play, an operator should close it; ending the
/// process would end the others too.
#[derive(Default)]
pub struct Pulse {
    /// Ticks of all rooms at the last check.
    played: u64,
}

impl Pulse {
    /// Returns whether no room is open, or ticks were played since the last check.
    pub fn beats(&mut self, host: &Host) -> bool {
        // If the list of rooms stays locked, this thread blocks here, and the server counts as dead too.
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
