//! The service manager that started the process, such as systemd, or another program that expects status notifications.
//! It is told when the server is ready, that the server is alive, and when it ends. The embedding program decides how
//! these notifications are sent.

use crate::host::room_handle::Host;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::interval;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// The server is listening, and has opened the previous process's rooms.
    Ready,
    /// The server is alive: some room has played since the last notification, or no room is open.
    Alive,
    /// The server is draining and will end.
    Stopping,
}

/// Passes on a notification without waiting.
pub type Tell = Arc<dyn Fn(Sign) + Send + Sync>;

/// The recipient of status notifications.
#[derive(Clone)]
pub struct Supervisor {
    pub tell: Tell,
    /// Interval between alive notifications, which is more than zero; `None` if none are expected.
    pub alive_every: Option<Duration>,
}

impl fmt::Debug for Supervisor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Supervisor").field("alive_every", &self.alive_every).finish_non_exhaustive()
    }
}

impl Default for Supervisor {
    fn default() -> Supervisor {
        Supervisor { tell: Arc::new(|_| {}), alive_every: None }
    }
}

/// Sends an alive notification in each interval while the server is alive. If this task runs, the runtime on which
/// sockets depend is working; [`Pulse`] checks the rest.
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
/// process would end the other rooms too.
#[derive(Default)]
pub struct Pulse {
    /// The total number of ticks at the previous check.
    played: u64,
}

impl Pulse {
    /// Returns whether no room is open or ticks have been played since the previous check.
    pub fn beats(&mut self, host: &Host) -> bool {
        // If the list of rooms stays locked, this thread blocks here, and the server counts as dead as well.
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
