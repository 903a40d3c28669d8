//! The handle of a room: its public state, and the channels to it from outside its thread.

use crate::fleet::lease::RoomLease;
use crate::host::Phase;
use crate::host::inbox::Inbox;
use crate::host::outbox::{Outbox, SendQueue};
use crate::host::peer_nodes::PeerNodes;
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

/// Public state of an open room.
pub struct RoomInfo {
    /// The code in the room's link.
    pub code: String,
    /// Number drawn at random when the room opened. Unique among all rooms, including past ones.
    pub number: u64,
    /// Whether the room can only be reached by its link. Private rooms are unlisted and not recorded.
    pub private: bool,
    /// Network of the creator; `None` for a standing room.
    pub creator: Option<IpAddr>,
    pub scene: Arc<Scene>,
    /// Whether a guest provided the scene, so that the room has only a share of a processor.
    pub guest: bool,
    /// Newest tick.
    pub tick: AtomicU32,
    /// Time when the room's thread last woke to play.
    pub last_tick: LastTick,
    /// Cancelled when the room is given up because its thread does not respond. Its sessions then end, as does the
    /// thread if it ever wakes.
    pub given_up: CancellationToken,
    pub players: AtomicUsize,
    /// Number of players who are connected.
    pub connected: AtomicUsize,
    /// Number of spectators, who are not players.
    pub spectators: AtomicUsize,
    /// Number of bodies in the room's world.
    pub bodies: AtomicUsize,
}

impl RoomInfo {
    /// The public state of a room that has not played yet, with one of the server's scenes.
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

/// The time at which a room's thread last woke for a tick. It starts at the time when the room opened. The thread writes this and
/// everyone may read it, so that a room whose thread does not answer is seen without asking it.
#[derive(Debug)]
pub struct LastTick {
    opened: Instant,
    /// Milliseconds from `opened` to the last wakeup.
    woke_ms: AtomicU64,
}

impl LastTick {
    /// Creates the value for a room that opens now.
    pub fn new(opened: Instant) -> LastTick {
        LastTick { opened, woke_ms: AtomicU64::new(0) }
    }

    /// Notes that the room's thread woke for a tick, whether or not it may play it.
    pub fn woke(&self, now: Instant) {
        let ms = now.saturating_duration_since(self.opened).as_millis() as u64;
        self.woke_ms.store(ms, Ordering::Relaxed);
    }

    pub fn age(&self, now: Instant) -> Duration {
        let woke = Duration::from_millis(self.woke_ms.load(Ordering::Relaxed));
        now.saturating_duration_since(self.opened).saturating_sub(woke)
    }
}

/// A session that asks for a seat, or to watch. The answer comes through its outbox: a welcome, or the end.
pub struct Join {
    /// Whether the session wants to play or watch.
    pub role: Role,
    pub appearance: Appearance,
    /// The seat that the player held before, proved by a token of this server.
    pub claim: Option<SeatClaim>,
    /// Number of the room that the player hosts, proved by a key of this server.
    pub hosted: Option<u64>,
    /// Address to which the session is attributed.
    pub address: IpAddr,
    /// Messages from the session. `None` means that the player closed the socket on purpose, so that the seat need not
    /// be held. A dropped sender means a lost socket.
    pub inbox: Inbox<Option<ClientMessage>>,
    /// Messages to the session.
    pub outbox: Arc<Outbox>,
}

/// A command of an operator or of the fleet to a room, carried out at its next tick.
#[derive(Debug)]
pub enum AdminCommand {
    Players(oneshot::Sender<Vec<PlayerState>>),
    /// Kicks a player. The answer is whether this seat had one.
    Kick(Seat, oneshot::Sender<bool>),
    /// Removes all players of a network.
    Evict(IpNet),
    /// Closes the room. The answer confirms it in advance.
    Close(oneshot::Sender<()>),
    /// Ends the room with a last record of its whole state, from which another node continues it.
    Part,
    /// Ends the room without a record, because another node plays it; holds that node's address, if known.
    Leave(Option<Arc<str>>),
}

/// The host's end of an open room.
pub struct RoomHandle {
    /// The room's public state.
    pub info: Arc<RoomInfo>,
    /// Channel for sessions that ask for a seat.
    pub joins: SyncSender<Join>,
    pub commands: SyncSender<AdminCommand>,
    /// The lease of the room, in a fleet.
    pub lease: Option<RoomLease>,
    /// The place where readers find the room's log, if it has one.
    pub shared: Option<Arc<SharedLog>>,
    pub thread: JoinHandle<()>,
}

/// Shared by the rooms of a server.
pub struct Host {
    /// Timeouts after which rooms and clients are given up.
    pub waits: Timeouts,
    /// Current phase of the server.
    pub phase: watch::Receiver<Phase>,
    /// The writers of the rooms' logs.
    pub logs: Logs,
    /// The other nodes of the fleet, if the server is in one.
    pub neighbours: PeerNodes,
    /// Queues that send the messages in outboxes, one for each thread that serves sockets.
    pub send_queues: Vec<Arc<SendQueue>>,
    /// Maximum number of spectators from one address in a room.
    pub address_spectators_max: usize,
    /// Budgets of the bytes sent to sessions.
    pub uplink: Arc<Uplink>,
    pub metrics: Arc<Metrics>,
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

/// Takes a room off the list if it is still there. Another room may have its code by now.
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
