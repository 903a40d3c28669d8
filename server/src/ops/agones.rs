//! Support for Agones, if it started the server. The server tells the sidecar when it accepts players, that it is
//! healthy, how many rooms it can take, and when it ends. The game does not depend on any of this. A call that the
//! sidecar does not answer in time is counted, logged once and retried.

mod sidecar;
mod watch;

use crate::host::Phase;
use crate::host::room_handle::Host;
use crate::ops::supervisor::Pulse;
use sidecar::{CallError, Sidecar};
use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::select;
use tokio::time::{MissedTickBehavior, interval, sleep};
use tracing::{info, warn};
use watch::{Counter, RoomWatch};

/// Interval between health reports.
const AGONES_HEALTH_EVERY: Duration = Duration::from_secs(2);
/// Interval at which to check for rooms that have closed.
const AGONES_LOOK_EVERY: Duration = Duration::from_secs(1);
/// Timeout for the sidecar, which runs on this machine and answers from memory.
const AGONES_ANSWER: Duration = Duration::from_secs(1);
/// Delay before a failed call is retried.
const AGONES_RETRY: Duration = Duration::from_secs(1);
/// Number of attempts to report the server's end, all of which must fit into a drain.
const AGONES_SHUTDOWN_TRIES: u32 = 3;

/// The sidecar's address, and the timing of calls to it.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Address of the sidecar's REST API.
    pub sidecar: SocketAddr,
    /// Maximum number of rooms that the server should have at once.
    pub rooms_max: usize,
    /// Interval between health reports; more than zero.
    pub health_every: Duration,
    /// Interval between checks of the open rooms; more than zero.
    pub look_every: Duration,
    /// Timeout for a call to the sidecar.
    pub answer: Duration,
    /// Delay before a failed call is retried.
    pub retry: Duration,
}

impl Settings {
    /// The default timing, with this many rooms.
    pub fn new(sidecar: SocketAddr, rooms_max: usize) -> Settings {
        Settings {
            sidecar,
            rooms_max,
            health_every: AGONES_HEALTH_EVERY,
            look_every: AGONES_LOOK_EVERY,
            answer: AGONES_ANSWER,
            retry: AGONES_RETRY,
        }
    }
}

/// Accompanies a server from when it begins to serve sockets until its end. Returns soon after the drain has begun.
pub async fn accompany(settings: Settings, host: Arc<Host>) {
    let sidecar = Sidecar::new(settings.sidecar, settings.answer, Arc::clone(&host.metrics));
    let mut phase = host.phase.clone();
    select! {
        () = give_signs_of_life(&sidecar, settings.health_every, &host) => {}
        () = follow_rooms(&sidecar, settings, &host) => {}
        _ = phase.wait_for(|phase| *phase != Phase::Running) => {}
    }
    end(&sidecar, settings.retry).await;
}

/// Reports health regularly. Agones replaces a server that stays silent for longer than the fleet's spec allows.
async fn give_signs_of_life(sidecar: &Sidecar, every: Duration, host: &Host) {
    let (mut looks, mut pulse) = (interval(every), Pulse::default());
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        looks.tick().await;
        if pulse.beats(host) {
            // If a report fails, the next one follows anyway.
            let _ = sidecar.health().await;
        }
    }
}

/// Reports that the server accepts players, and subtracts closed rooms from the counter.
async fn follow_rooms(sidecar: &Sidecar, settings: Settings, host: &Host) {
    let open = open_rooms(host);
    let counts = count_rooms(sidecar, settings, open.len()).await;
    let counter = counts.then(|| Counter::new(open.len(), host.waits.room_empty));
    while sidecar.ready().await.is_err() {
        sleep(settings.retry).await;
    }
    info!(sidecar = %settings.sidecar, "Agones knows that the server takes players");
    let mut watch = RoomWatch::new(sidecar, open, counter);
    loop {
        sleep(settings.look_every).await;
        if watch.look(open_rooms(host)).await.is_err() {
            sleep(settings.retry).await;
        }
    }
}

/// Sets the room counter. Returns false if the game server has none. The allocator does not change the counter before
/// the server is ready.
async fn count_rooms(sidecar: &Sidecar, settings: Settings, open: usize) -> bool {
    loop {
        match sidecar.set_counter(open, settings.rooms_max.max(open)).await {
            Ok(()) => return true,
            Err(CallError::Status(status, text)) => {
                warn!(
                    %status, text,
                    "Agones counts no rooms: the fleet's spec must have the counter `rooms` \
                     (spec.template.spec.counters); the server goes on without"
                );
                return false;
            }
            Err(_) => sleep(settings.retry).await,
        }
    }
}

/// The open rooms' numbers.
fn open_rooms(host: &Host) -> BTreeSet<u64> {
    host.lock().values().map(|room| room.info.number).collect()
}

/// Asks Agones to end the game server and start a replacement.
async fn end(sidecar: &Sidecar, retry: Duration) {
    for attempt in 1..=AGONES_SHUTDOWN_TRIES {
        if sidecar.shutdown().await.is_ok() || attempt == AGONES_SHUTDOWN_TRIES {
            return;
        }
        sleep(retry).await;
    }
}
