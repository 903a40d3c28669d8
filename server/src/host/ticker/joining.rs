//! How sessions come into a room: as players with a seat, or as spectators.

use super::Ticker;
use crate::host::admission::HeldSeats;
use crate::host::delivery::Delivery;
use crate::host::member::ConnectedMember;
use crate::host::names;
use crate::host::outbox::Outbox;
use crate::host::room_handle::Join;
use crate::host::token_signer::SeatClaim;
use crate::limits;
use crate::ops::refusal_log::Foreign;
use jostle_game::Seat;
use jostle_protocol::{Appearance, Refusal, Role, WelcomeSeat};
use jostle_room::{Room, Welcome};
use std::sync::Arc;
use std::time::Instant;
use tracing::{debug, info};

impl Ticker {
    /// Takes the sessions that ask to come in, some at a time.
    pub(super) fn admit(&mut self, room: &mut Room, now: Instant) {
        let mut held = None;
        for _ in 0..limits::JOINS_PER_WAKEUP {
            let Ok(join) = self.joins.try_recv() else { return };
            self.seat(room, join, &mut held, now);
        }
    }

    /// Seats a player, or ends the session with the reason. `held` caches the held seats once a join needed them.
    pub(super) fn seat(
        &mut self,
        room: &mut Room,
        join: Join,
        held: &mut Option<HeldSeats>,
        now: Instant,
    ) {
        if join.role == Role::Spectator {
            return self.admit_spectator(room, join, now);
        }
        let own = join.claim.map(|signed| signed.claim.seat);
        let others = room.snapshot().players.iter().filter(|player| Some(player.seat) != own);
        let others = others.map(|player| &player.appearance.name);
        let name = names::unmistakable(&join.appearance.name, others);
        let join = Join { appearance: Appearance { name, ..join.appearance }, ..join };
        let (name, address) = (join.appearance.name.clone(), join.address);
        let (own, host) = (self.info.number, join.hosted == Some(self.info.number));
        match self.take_seat(room, &join, host, held) {
            Ok(Welcome { claim, resumed }) => {
                *held = None;
                self.host.metrics.joined(if resumed { "resumed" } else { "new" });
                let seat = claim.seat;
                // The seat has a new socket; an older one is dropped.
                self.end_sessions(seat, Refusal::Replaced);
                self.admission.seated(seat, address, &name);
                info!(
                    room = %self.info.code, seat = seat.0, name = %Foreign(name.as_bytes()), %address, resumed, host,
                    "player joined"
                );
                let token = self.host.signer.seat_token(SeatClaim { room: own, claim });
                let allowance = self.host.uplink.open(address, self.info.guest, false, now);
                let (permits, tick) = (self.spectators.permits.clone(), room.game().tick_count());
                let feed = Delivery::new(Some(seat), join.outbox, allowance, permits, tick);
                feed.welcome(room.welcome(Some(WelcomeSeat { seat, host, token })), now);
                self.name_neighbours(&feed.outbox);
                self.abandoned &= !host;
                self.members.push(ConnectedMember { seat, host, inbox: join.inbox, feed });
            }
            Err(refusal) => join.outbox.end(refusal),
        }
    }

    /// Lets a session watch, or ends it with the reason.
    fn admit_spectator(&mut self, room: &Room, join: Join, now: Instant) {
        let address = join.address;
        if self.admission.is_shut(address, &join.appearance.name, room.game().tick_count()) {
            return join.outbox.end(Refusal::Kicked);
        }
        let outbox = Arc::clone(&join.outbox);
        let (uplink, guest) = (&self.host.uplink, self.info.guest);
        let allowance = |address| uplink.open(address, guest, true, now);
        match self.spectators.admit(room, join, allowance, now) {
            Ok(()) => {
                self.name_neighbours(&outbox);
                self.host.metrics.joined("spectator");
                debug!(room = %self.info.code, %address, "spectator joined");
            }
            Err((refusal, outbox)) => outbox.end(refusal),
        }
    }

    /// Tells a new session where to ask for the room when this node falls silent, in a fleet.
    fn name_neighbours(&self, outbox: &Outbox) {
        if self.host.neighbours.revision() > 0 {
            outbox.control(self.host.neighbours.message());
        }
    }

    /// Takes the claimed seat, a free one, or in a full room one whose player has to give way.
    fn take_seat(
        &mut self,
        room: &mut Room,
        join: &Join,
        host: bool,
        held: &mut Option<HeldSeats>,
    ) -> Result<Welcome, Refusal> {
        let seat = |room: &mut Room| {
            let claim = join.claim.map(|signed| signed.claim);
            room.join(join.appearance.clone(), claim)
        };
        match join.claim {
            Some(claim) if claim.room != self.info.number => return Err(Refusal::BadToken),
            Some(_) => return seat(room),
            None => {}
        }
        let (name, tick) = (&join.appearance.name, room.game().tick_count());
        if !host && self.admission.is_shut(join.address, name, tick) {
            return Err(Refusal::Kicked);
        }
        match seat(room) {
            Err(Refusal::RoomFull) => {
                let held = held.get_or_insert_with(|| self.admission.held(room));
                let displaced = held.displaced(join.address).or_else(|| {
                    // A host stays: the room is theirs.
                    let guests = self.members.iter().filter(|member| !member.host);
                    self.admission.displaced(room, guests.map(|member| member.seat), join.address)
                });
                let displaced = displaced.ok_or(Refusal::RoomFull)?;
                self.host.metrics.left("displaced");
                self.end_sessions(displaced, Refusal::GaveWay);
                room.leave(displaced);
                seat(room)
            }
            joined => joined,
        }
    }

    pub(super) fn end_sessions(&mut self, seat: Seat, refusal: Refusal) {
        self.members.retain(|member| {
            if member.seat == seat {
                member.feed.outbox.end(refusal);
            }
            member.seat != seat
        });
    }
}
