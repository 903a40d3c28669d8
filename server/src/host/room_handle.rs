//! The handle of a room: everything that is known of it and sent to it from outside its thread.

use crate::fleet::lease::RoomLease;
use crate::host::Phase;
use crate::host::inbox::Inbox;
use crate::host::neighbours::Neighbours;
use crate::host::outbox::{Outbox, SendQueue};
use crate::host::token_signer::{SeatClaim, TokenSigner};
use crate::limits::Waits;
use crate::limits::uplink::Uplink;
use crate::log::{Logs, Notes, SharedLog};
use crate::ops::metrics::Metrics;
use ipnet::IpNet;
use jostle_game::{Scene, Seat};
use jostle_protocol::{Appearance, ClientMessage, PlayerState, Role};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::{oneshot, watch};
use tokio_util::sync::CancellationToken;

/// Public state of an open room.
pub struct RoomInfo {
    /// The code in its link.
    pub code: String,
    /// Number drawn at random when it opened. Unique among all rooms, past ones included.
    pub number: u64,
    /// Whether it is reached by its link only: it is in no list, and is not recorded.
    pub private: bool,
    /// Network of the creator; `None` for a standing room.
    pub creator: Option<IpAddr>,
    pub scene: Arc<Scene>,
    /// Whether a guest brought the scene, so that the room has a share of a processor only.
    pub guest: bool,
    /// Newest tick.
    pub tick: AtomicU32,
    /// When its thread last woke to play.
    pub last_tick: LastTick,
    /// Cancelled when the room is given up because its thread does not answer. Its sessions then end, and so does the
    /// thread if it ever wakes.
    pub given_up: CancellationToken,
    pub players: AtomicUsize,
    /// Of these, players who are there now.
    pub connected: AtomicUsize,
    /// Spectators, who are none of them.
    pub spectators: AtomicUsize,
    /// Bodies in its world.
    pub bodies: AtomicUsize,
}

impl RoomInfo {
    /// The info of a room that has not played yet, with a scene of the server's own.
    pub fn new(
        code: &str,
        number: u64,
        private: bool,
        creator: Option<IpAddr>,
        scene: &Arc<Scene>,
    ) -> RoomInfo {
        RoomInfo {
            code: code.to_owned(),
            number,
            private,
            creator,
            scene: Arc::clone(scene),
            guest: false,
            tick: AtomicU32::new(0),
            last_tick: LastTick::new(Instant::now()),
            given_up: CancellationToken::new(),
            players: AtomicUsize::new(0),
            connected: AtomicUsize::new(0),
            spectators: AtomicUsize::new(0),
            bodies: AtomicUsize::new(0),
        }
    }

    /// The room's own facts in the notes of its log.
    pub fn notes(&self) -> Notes {
        let RoomInfo { number, private, creator, guest, .. } = *self;
        Notes { number, private, creator, guest, ..Notes::default() }
    }
}

/// The time at which a room's thread last woke for a tick. Starts at the time the room opens. The thread writes this and
/// everyone may read it, so that a room whose thread does not answer is seen without asking it.
#[derive(Debug)]
pub struct LastTick {
    opened: Instant,
    /// Milliseconds from `opened` to that time.
    woke_ms: AtomicU64,
}

impl LastTick {
    /// That of a room that opens now.
    pub fn new(opened: Instant) -> LastTick {
        LastTick { opened, woke_ms: AtomicU64::new(0) }
    }

    /// The room's thread woke for a tick, whether or not it may play it.
    pub fn woke(&self, now: Instant) {
        let ms = now.saturating_duration_since(self.opened).as_millis() as u64;
        self.woke_ms.store(ms, Ordering::Relaxed);
    }

    pub fn age(&self, now: Instant) -> Duration {
        let woke = Duration::from_millis(self.woke_ms.load(Ordering::Relaxed));
        now.saturating_duration_since(self.opened).saturating_sub(woke)
    }
}

/// A session that asks for a seat, or to watch. The answer comes through its outbox: a welcome or the end.
pub struct Join {
    /// Whether it is to play or to watch.
    pub role: Role,
    pub appearance: Appearance,
    /// The seat it held before, by a token of this server.
    pub claim: Option<SeatClaim>,
    /// Number of the room whose host it is, by a key of this server.
    pub hosted: Option<u64>,
    /// Address that it counts for.
    pub address: IpAddr,
    /// Messages from the session; `None` if the player closed the socket on purpose, so that the seat need not be held. A
    /// dropped sender is a lost socket.
    pub inbox: Inbox<Option<ClientMessage>>,
    /// Messages to the session.
    pub outbox: Arc<Outbox>,
}

/// A command of an operator or of the fleet to a room, carried out at its next tick.
#[derive(Debug)]
pub enum AdminCommand {
    Players(oneshot::Sender<Vec<PlayerState>>),
    /// Kicks a player; the answer is whether there was one in this seat.
    Kick(Seat, oneshot::Sender<bool>),
    /// Removes all players of a network.
    Evict(IpNet),
    /// Closes the room, and answers that it will.
    Close(oneshot::Sender<()>),
    /// Ends the room with a last record of its whole state, from which another node goes on with it.
    Part,
    /// Ends the room without a record, because another node plays it: at this address, if it is known.
    Leave(Option<Arc<str>>),
}

/// The host's end of an open room.
pub struct RoomHandle {
    /// The room's public state.
    pub info: Arc<RoomInfo>,
    /// Sessions that ask for a seat.
    pub joins: SyncSender<Join>,
    pub commands: SyncSender<AdminCommand>,
    /// Under which it is held, in a fleet.
    pub lease: Option<RoomLease>,
    /// Where the readers of its log find that, if it has any.
    pub shared: Option<Arc<SharedLog>>,
    pub thread: JoinHandle<()>,
}

/// Shared by the rooms of a server.
pub struct Host {
    /// How long to wait before a room or a client is given up.
    pub waits: Waits,
    /// Phase of the server's life.
    pub phase: watch::Receiver<Phase>,
    /// The writers of the rooms' logs.
    pub logs: Logs,
    /// The other nodes of the fleet, if there is one.
    pub neighbours: Neighbours,
    /// Send what rooms have put into outboxes; one for each thread that serves sockets.
    pub send_queues: Vec<Arc<SendQueue>>,
    /// Spectators of one address in a room at a time.
    pub address_spectators_max: usize,
    /// Budgets of bytes that sessions are sent.
    pub uplink: Arc<Uplink>,
    pub metrics: Arc<Metrics>,
    /// Signs and verifies tokens.
    pub signer: TokenSigner,
    /// The handles of all open rooms, by code.
    pub open: Mutex<BTreeMap<String, RoomHandle>>,
}

impl Host {
    /// Locks the handles. No holder of the lock waits for anything else.
    pub fn lock(&self) -> MutexGuard<'_, BTreeMap<String, RoomHandle>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Takes a room off the list, if it is on it: another one may have its code by now.
pub fn take_off(
    open: &mut BTreeMap<String, RoomHandle>,
    info: &Arc<RoomInfo>,
) -> Option<RoomHandle> {
    let is_listed = open.get(&info.code).is_some_and(|room| Arc::ptr_eq(&room.info, info));
    is_listed.then(|| open.remove(&info.code)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_grows_until_the_room_wakes() {
        let opened = Instant::now();
        let after = |seconds| opened + Duration::from_secs(seconds);
        let last = LastTick::new(opened);
        assert_eq!(last.age(after(3)), Duration::from_secs(3), "a room that never woke");
        last.woke(after(5));
        assert_eq!(last.age(after(5)), Duration::ZERO);
        assert_eq!(last.age(after(17)), Duration::from_secs(12));
        assert_eq!(last.age(after(4)), Duration::ZERO, "a reader whose clock was read before");
    }
}
