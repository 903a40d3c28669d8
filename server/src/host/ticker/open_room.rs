//! An open room: its game, its sessions, and how sessions come and go.

use crate::host::admission::{Admission, HeldSeats, KickScope};
use crate::host::clock::TickClock;
use crate::host::confusables;
use crate::host::delivery::Delivery;
use crate::host::outbox::Outbox;
use crate::host::random;
use crate::host::room_handle::{Host, Join, RoomInfo};
use crate::host::seat_rates::SeatRates;
use crate::host::sessions::{ConnectedMember, Sessions};
use crate::host::token_signer::SeatClaim;
use crate::log::SavedRoom;
use crate::ops::refusal_log::Foreign;
use ipnet::IpNet;
use jostle_game::Seat;
use jostle_protocol::{Appearance, Refusal, Role, ServerMessage, WelcomeSeat};
use jostle_room::{Room, Welcome};
use jostle_sim::TICKS_PER_SECOND;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tracing::{debug, info};

/// Time after which a room with no clients and no held seats pauses.
const RESTING_AFTER: Duration = Duration::from_secs(1);

/// How a room begins.
pub enum RoomOrigin {
    /// As a new game with this seed.
    New(u64),
    /// As a room saved by the previous process.
    Saved(Box<SavedRoom>),
}

pub struct OpenRoom {
    pub host: Arc<Host>,
    pub info: Arc<RoomInfo>,
    pub room: Room,
    pub sessions: Sessions,
    pub admission: Admission,
    pub emotes: SeatRates,
    pub looks: SeatRates,
    pub clips: SeatRates,
    /// The bots at the last check, and the revision of the members at that time.
    bots: (u64, Vec<Seat>),
    /// Whether the host or an operator closed the room.
    pub closed: bool,
    /// Whether the room's creator has left, so that the room need not stay open once it is empty.
    pub abandoned: bool,
    /// The time since when the room has had no players.
    pub empty_since: Instant,
}

impl OpenRoom {
    /// Opens a room; `None` if that uses too much of the server's resources.
    pub fn new(
        host: &Arc<Host>,
        info: &Arc<RoomInfo>,
        origin: RoomOrigin,
        clock: &impl TickClock,
    ) -> Option<OpenRoom> {
        let (room, admission) = match origin {
            RoomOrigin::New(seed) => (new_room(info, seed), Admission::default()),
            RoomOrigin::Saved(saved) => {
                let (mut room, admission) = restore(host, info, *saved, clock)?;
                // Needed even for a room that starts over under the same number, since old tokens contain that number.
                room.begin_epoch(random() as u32);
                (room, admission)
            }
        };
        Some(OpenRoom {
            sessions: Sessions::new(host.address_spectators_max),
            host: Arc::clone(host),
            info: Arc::clone(info),
            room,
            admission,
            emotes: SeatRates::of_emotes(),
            looks: SeatRates::of_looks(),
            clips: SeatRates::of_clips(),
            bots: (u64::MAX, Vec::new()),
            closed: false,
            abandoned: false,
            empty_since: clock.now(),
        })
    }

    /// Seats a player, or ends the session with a reason. `held` caches the held seats once a join has needed them.
    pub fn seat(&mut self, join: Join, held: &mut Option<HeldSeats>, now: Instant) {
        if join.role == Role::Spectator {
            return self.admit_spectator(join, now);
        }
        let own = join.claim.map(|signed| signed.claim.seat);
        let appearance = self.unmistakable(join.appearance, own);
        let join = Join { appearance, ..join };
        let (name, address) = (join.appearance.name.clone(), join.address);
        let (own, host) = (self.info.number, join.hosted == Some(self.info.number));
        match self.take_seat(&join, host, held) {
            Ok(Welcome { claim, resumed }) => {
                *held = None;
                self.host.metrics.joined(if resumed { "resumed" } else { "new" });
                let seat = claim.seat;
                // The seat has a new socket, so any older one is closed.
                self.sessions.end_seat(seat, Refusal::Replaced);
                self.admission.seated(seat, address, &name);
                info!(
                    room = %self.info.code, seat = seat.0, name = %Foreign(name.as_bytes()), %address, resumed, host,
                    "player joined"
                );
                let token = self.host.signer.seat_token(SeatClaim { room: own, claim });
                let allowance = self.host.uplink.open(address, self.info.guest, false, now);
                let permits = self.sessions.spectators.permits.clone();
                let tick = self.room.game().tick_count();
                let feed = Delivery::new(Some(seat), join.outbox, allowance, permits, tick);
                feed.welcome(self.room.welcome(Some(WelcomeSeat { seat, host, token })), now);
                self.name_neighbours(&feed.outbox);
                self.abandoned &= !host;
                let member = ConnectedMember { seat, host, inbox: join.inbox, feed };
                self.sessions.members.push(member);
            }
            Err(refusal) => join.outbox.end(refusal),
        }
    }

    /// The appearance under a name that resembles no name of a player outside the seat `own`, unless it is the same.
    pub fn unmistakable(&self, wanted: Appearance, own: Option<Seat>) -> Appearance {
        let others = self.room.snapshot().players.iter().filter(|player| Some(player.seat) != own);
        let others = others.map(|player| &player.appearance.name);
        Appearance { name: confusables::unmistakable(&wanted.name, others), ..wanted }
    }

    /// Admits a session as a spectator, or ends it with a reason.
    fn admit_spectator(&mut self, join: Join, now: Instant) {
        let (address, tick) = (join.address, self.room.game().tick_count());
        if self.admission.is_shut(address, &join.appearance.name, None, tick) {
            return join.outbox.end(Refusal::Kicked);
        }
        let outbox = Arc::clone(&join.outbox);
        let (uplink, guest) = (&self.host.uplink, self.info.guest);
        let allowance = |address| uplink.open(address, guest, true, now);
        match self.sessions.spectators.admit(&self.room, join, allowance, now) {
            Ok(()) => {
                self.name_neighbours(&outbox);
                self.host.metrics.joined("spectator");
                debug!(room = %self.info.code, %address, "spectator joined");
            }
            Err((refusal, outbox)) => outbox.end(refusal),
        }
    }

    /// Tells a new session which nodes to ask about the room if this node falls silent. Does nothing outside a fleet.
    fn name_neighbours(&self, outbox: &Outbox) {
        if self.host.neighbours.revision() > 0 {
            outbox.control(self.host.neighbours.message());
        }
    }

    /// Takes the claimed seat, a free seat or, in a full room, the seat of a player who can be displaced.
    fn take_seat(
        &mut self,
        join: &Join,
        host: bool,
        held: &mut Option<HeldSeats>,
    ) -> Result<Welcome, Refusal> {
        let seat = |room: &mut Room| {
            let claim = join.claim.map(|signed| signed.claim);
            room.join(join.appearance.clone(), claim)
        };
        if join.claim.is_some_and(|claim| claim.room != self.info.number) {
            return Err(Refusal::BadToken);
        }
        let (name, tick) = (&join.appearance.name, self.room.game().tick_count());
        let claim = join.claim.map(|signed| signed.claim);
        let taken = claim.map(|_| seat(&mut self.room));
        match taken {
            Some(Ok(welcome)) => return Ok(welcome),
            _ if !host && self.admission.is_shut(join.address, name, claim, tick) => {
                return Err(Refusal::Kicked);
            }
            Some(refused) => return refused,
            None => {}
        }
        match seat(&mut self.room) {
            Err(Refusal::RoomFull) => {
                let held = held.get_or_insert_with(|| self.admission.held(&self.room));
                let displaced = held.displaced(join.address).or_else(|| {
                    // A host keeps their seat, because the room is theirs.
                    let guests = self.sessions.members.iter().filter(|member| !member.host);
                    let seats = guests.map(|member| member.seat);
                    self.admission.displaced(&self.room, seats, join.address)
                });
                let displaced = displaced.ok_or(Refusal::RoomFull)?;
                self.host.metrics.left("displaced");
                self.sessions.end_seat(displaced, Refusal::GaveWay);
                self.room.leave(displaced);
                seat(&mut self.room)
            }
            joined => joined,
        }
    }

    /// Kicks a player, whether or not they are connected. Returns whether this seat had one.
    pub fn kick(&mut self, seat: Seat, scope: KickScope) -> bool {
        if self.room.dismiss_bot(seat) {
            return true;
        }
        let players = self.room.players();
        let claims = self.room.claims(seat);
        self.room.leave(seat);
        if self.room.players() == players {
            return false;
        }
        info!(room = %self.info.code, seat = seat.0, "player kicked");
        self.host.metrics.left("kicked");
        self.admission.kicked(seat, claims, scope, self.room.game().tick_count());
        self.sessions.end_seat(seat, Refusal::Kicked);
        true
    }

    /// Removes all of a network's players, connected or not, and its spectators.
    pub fn evict(&mut self, network: IpNet) {
        self.sessions.spectators.evict(network);
        let seats = self.room.snapshot().players.iter().map(|player| player.seat);
        let of_network = |seat: &Seat| {
            self.admission.address(*seat).is_some_and(|address| network.contains(&address))
        };
        let seats: Vec<Seat> = seats.filter(of_network).collect();
        for seat in seats {
            self.kick(seat, KickScope::Player);
        }
    }

    /// Ends all sessions, and holds the players' seats.
    pub fn disconnect_all(&mut self, refusal: Refusal) {
        self.sessions.end(refusal);
        for member in self.sessions.members.drain(..) {
            self.room.disconnect(member.seat);
        }
    }

    /// Sends the list of bots to the sessions that asked for it, if it has changed.
    fn tell_bots(&mut self) {
        let revision = self.room.members_revision();
        if std::mem::replace(&mut self.bots.0, revision) == revision {
            return;
        }
        let seats = self.room.bot_seats();
        if seats != self.bots.1 {
            self.sessions.tell_bots(&ServerMessage::Bots { seats: seats.clone() }.encode().into());
            self.bots.1 = seats;
        }
    }

    /// Queues the newest tick's snapshot for all sessions.
    pub fn feed(&mut self, now: Instant) {
        self.tell_bots();
        // This is updated first, because no pong may name an earlier tick than its client has already seen.
        self.info.tick.store(self.room.game().tick_count(), Ordering::Relaxed);
        let Host { waits, metrics, send_queues, .. } = &*self.host;
        let silent_ticks_max = (waits.hearing.as_secs_f64() * f64::from(TICKS_PER_SECOND)) as u32;
        self.sessions.feed(&mut self.room, silent_ticks_max, now, metrics);
        send_queues.iter().for_each(|queue| queue.request());
    }

    /// Updates the room's public state.
    pub fn publish(&mut self, now: Instant) {
        let Sessions { members, spectators } = &self.sessions;
        self.info.players.store(self.room.players(), Ordering::Relaxed);
        self.info.connected.store(members.len(), Ordering::Relaxed);
        self.info.spectators.store(spectators.len(), Ordering::Relaxed);
        self.info.bodies.store(self.room.snapshot().bodies.len(), Ordering::Relaxed);
        if !members.is_empty() {
            self.empty_since = now;
        }
    }

    /// Whether no client is connected and no seat is held. The game is then paused until someone joins, and the thread
    /// only checks for joins.
    pub fn rests(&self, now: Instant) -> bool {
        let is_left = self.sessions.is_empty() && self.room.players() == 0;
        is_left && now - self.empty_since >= RESTING_AFTER
    }

    /// Whether nobody is in the room and nobody is expected back.
    pub fn is_over(&self, now: Instant) -> bool {
        let players = self.room.players();
        let is_awaited = !self.abandoned || players > 0;
        let most = self.host.waits.empty(self.info.guest, players);
        self.sessions.is_empty() && (!is_awaited || now - self.empty_since >= most)
    }
}

fn new_room(info: &RoomInfo, seed: u64) -> Room {
    info!(room = %info.code, scene = %info.scene.name, seed, "room opened");
    Room::new(&info.code, Arc::clone(&info.scene), seed)
}

/// Restores a room from the previous process. A room that cannot be restored starts over under the same link; a room
/// whose guest's scene uses too many resources is over.
fn restore(
    host: &Host,
    info: &RoomInfo,
    saved: SavedRoom,
    clock: &impl TickClock,
) -> Option<(Room, Admission)> {
    let began = clock.worked();
    let most = info.guest.then_some(host.waits.guest_excess);
    match saved.restore(|| most.is_none_or(|most| clock.worked() - began <= most)) {
        Ok(room) => Some((room?, saved.notes.admission)),
        Err(reason) => {
            if !info.given_up.is_cancelled() {
                host.logs.set_aside(&info.code, &reason);
            }
            Some((new_room(info, random()), Admission::default()))
        }
    }
}
