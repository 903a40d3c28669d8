//! A room's handle: its public state, and the channels that lead to it from outside its thread.

use crate::fleet::lease::RoomLease;
use crate::host::Phase;
use crate::host::inbox::Inbox;
use crate::host::outbox::{Outbox, SendQueue};
use crate::host::peer_nodes::PeerNodes;
use crate::host::successors::Successors;
use crate::host::token_signer::{SeatClaim, TokenSigner};
use crate::limits::Timeouts;
use crate::limits::uplink::Uplink;
use crate::log::{HostNotes, Logs, SharedLog};
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

/// The public state of an open room.
pub struct RoomInfo {
    /// The code in the room's link.
    pub code: String,
    /// Random number chosen when the room opened. Unique among all rooms, past and present.
    pub number: u64,
    /// Whether the room can be reached only by its link. Private rooms are unlisted and not recorded.
    pub private: bool,
    /// The creator's network; `None` for a standing room.
    pub creator: Option<IpAddr>,
    pub scene: Arc<Scene>,
    /// Whether a guest provided the scene, in which case the room has only a share of a processor.
    pub guest: bool,
    pub tick: AtomicU32,
    /// Time when the room's thread last woke to play.
    pub last_tick: LastTick,
    /// Cancelled when the room is given up because its thread does not respond. Its sessions then end, and so does the
    /// thread if it ever wakes.
    pub given_up: CancellationToken,
    pub players: AtomicUsize,
    /// Number of connected players.
    pub connected: AtomicUsize,
    /// Number of spectators, who do not count as players.
    pub spectators: AtomicUsize,
    /// Number of bodies in the room's world.
    pub bodies: AtomicUsize,
}

impl RoomInfo {
    /// The public state of a room that has not played yet, using one of the server's scenes.
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

    /// The room's facts for the notes in its log.
    pub fn notes(&self) -> HostNotes {
        let RoomInfo { number, private, creator, guest, .. } = *self;
        HostNotes { number, private, creator, guest, ..HostNotes::default() }
    }
}

/// The time at which a room's thread last woke for a tick, initially the time when the room opened. The thread writes
/// this and everyone may read it, so an unresponsive room can be detected without asking its thread.
#[derive(Debug)]
pub struct LastTick {
    opened: Instant,
    /// Milliseconds from `opened` to the most recent wakeup.
    woke_ms: AtomicU64,
}

impl LastTick {
    /// Creates the value for a room that is opening now.
    pub fn new(opened: Instant) -> LastTick {
        LastTick { opened, woke_ms: AtomicU64::new(0) }
    }

    /// Notes that the room's thread woke for a tick, whether or not it is allowed to play it.
    pub fn woke(&self, now: Instant) {
        let ms = now.saturating_duration_since(self.opened).as_millis() as u64;
        self.woke_ms.store(ms, Ordering::Relaxed);
    }

    pub fn age(&self, now: Instant) -> Duration {
        let woke = Duration::from_millis(self.woke_ms.load(Ordering::Relaxed));
        now.saturating_duration_since(self.opened).saturating_sub(woke)
    }
}

/// A session that asks for a seat, or to watch. The outbox delivers the answer: a welcome, or the end of the session.
pub struct Join {
    /// Whether the session wants to play or watch.
    pub role: Role,
    pub appearance: Appearance,
    /// The seat that the player held before, proved by one of this server's tokens.
    pub claim: Option<SeatClaim>,
    /// Number of the room that the player hosts, proved by one of this server's keys.
    pub hosted: Option<u64>,
    /// Address to which the session counts.
    pub address: IpAddr,
    /// Messages from the session. `None` means that the player closed the socket on purpose, so the seat need not be
    /// held. A dropped sender means that the socket was lost.
    pub inbox: Inbox<Option<ClientMessage>>,
    /// Messages to the session.
    pub outbox: Arc<Outbox>,
}

/// A command to a room from an operator or the fleet, carried out at the room's next tick.
#[derive(Debug)]
pub enum AdminCommand {
    Players(oneshot::Sender<Vec<PlayerState>>),
    /// Kicks a player. The answer says whether this seat had one.
    Kick(Seat, oneshot::Sender<bool>),
    /// Removes all players on a network.
    Evict(IpNet),
    /// Closes the room. The answer confirms this in advance.
    Close(oneshot::Sender<()>),
    /// Ends the room with a final record of its whole state, from which another node continues the room.
    Part,
    /// Ends the room without a record, because another node plays it. Holds that node's address, if known.
    Leave(Option<Arc<str>>),
}

/// The host's end of the connection to an open room.
pub struct RoomHandle {
    /// The room's public state.
    pub info: Arc<RoomInfo>,
    /// Channel for sessions that ask for a seat.
    pub joins: SyncSender<Join>,
    pub commands: SyncSender<AdminCommand>,
    /// The room's lease, if the server is in a fleet.
    pub lease: Option<RoomLease>,
    /// Where readers find the room's log, if it has one.
    pub shared: Option<Arc<SharedLog>>,
    pub thread: JoinHandle<()>,
}

/// State shared by a server's rooms.
pub struct Host {
    /// Timeouts after which rooms and clients are given up.
    pub waits: Timeouts,
    /// The server's current phase.
    pub phase: watch::Receiver<Phase>,
    /// The writers of rooms' logs.
    pub logs: Logs,
    /// The other nodes of the fleet, if there is one.
    pub neighbours: PeerNodes,
    /// Queues that send the messages in outboxes; one per thread that serves sockets.
    pub send_queues: Vec<Arc<SendQueue>>,
    /// Maximum number of spectators per address in a room.
    pub address_spectators_max: usize,
    /// Budgets for the bytes sent to sessions.
    pub uplink: Arc<Uplink>,
    pub metrics: Arc<Metrics>,
    /// Where the players of closed rooms are led.
    pub successors: Successors,
    /// Signs and verifies tokens.
    pub signer: TokenSigner,
    /// The handles of all open rooms, by code.
    pub open: Mutex<BTreeMap<String, RoomHandle>>,
}

impl Host {
    /// Locks the handles. Holders of the lock must not wait for anything else.
    pub fn lock(&self) -> MutexGuard<'_, BTreeMap<String, RoomHandle>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Takes a room off the list if it is still there; by now, another room may have its code.
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
