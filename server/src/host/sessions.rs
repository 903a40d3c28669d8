//! The sessions in a room: players with a socket, and spectators. Spectators hold no seat, and the room does not know
//! about them: they receive what the room sends to everyone who sees the whole world, and nothing that they send
//! reaches it.

use crate::host::delivery::{Delivery, ParticlePermits, in_turn};
use crate::host::inbox::Inbox;
use crate::host::outbox::Outbox;
use crate::host::room_handle::Join;
use crate::limits;
use crate::limits::connection_limits::{ConnectionLimits, Permit};
use crate::limits::uplink::Allowance;
use crate::ops::metrics::Metrics;
use bytes::Bytes;
use ipnet::IpNet;
use jostle_game::{Input, Seat};
use jostle_protocol::{ClientMessage, Refusal};
use jostle_room::Room;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::mpsc::TryRecvError;
use std::time::Instant;

/// The sessions in a room.
pub struct Sessions {
    pub(super) members: Vec<ConnectedMember>,
    pub(super) spectators: Spectators,
}

/// A player with a socket.
pub struct ConnectedMember {
    pub(super) seat: Seat,
    /// Whether the player may kick others and close the room.
    pub(super) host: bool,
    pub(super) inbox: Inbox<Option<ClientMessage>>,
    pub(super) feed: Delivery,
}

impl Sessions {
    /// No sessions; at most `address_spectators_max` of the room's spectators may come from one address.
    pub fn new(address_spectators_max: usize) -> Sessions {
        Sessions { members: Vec::new(), spectators: Spectators::new(address_spectators_max) }
    }

    pub fn is_empty(&self) -> bool {
        self.members.is_empty() && self.spectators.is_empty()
    }

    pub fn outboxes(&self) -> impl Iterator<Item = &Arc<Outbox>> {
        let members = self.members.iter().map(|member| &member.feed.outbox);
        members.chain(self.spectators.outboxes())
    }

    /// Queues the newest tick's snapshot for all spectators. See [`Delivery::feed`].
    pub fn feed(
        &mut self,
        room: &mut Room,
        silent_ticks_max: u32,
        now: Instant,
        metrics: &Metrics,
    ) {
        for member in in_turn(&mut self.members, room.game().tick_count()) {
            if member.feed.feed(room, silent_ticks_max, now, metrics) {
                member.feed.outbox.send_soon();
            }
        }
        self.spectators.feed(room, silent_ticks_max, now, metrics);
    }

    /// Sends the list of bots, which has changed, to the sessions that asked for it.
    pub fn tell_bots(&self, message: &Bytes) {
        let spectators = self.spectators.present.iter().map(|spectator| &spectator.feed);
        let feeds = self.members.iter().map(|member| &member.feed).chain(spectators);
        feeds.for_each(|feed| feed.tell_bots(message));
    }

    /// Ends a seat's sessions.
    pub fn end_seat(&mut self, seat: Seat, refusal: Refusal) {
        self.members.retain(|member| {
            if member.seat == seat {
                member.feed.outbox.end(refusal);
            }
            member.seat != seat
        });
    }

    pub fn end(&mut self, refusal: Refusal) {
        self.members.iter().for_each(|member| member.feed.outbox.end(refusal));
        self.spectators.end(refusal);
    }

    /// Discards what the sessions have sent while nothing is played, because full inboxes would end them.
    pub fn discard(&mut self) {
        let spectators = self.spectators.present.iter_mut().map(|spectator| &mut spectator.inbox);
        let inboxes = self.members.iter_mut().map(|member| &mut member.inbox);
        inboxes.chain(spectators).for_each(|inbox| while inbox.try_recv().is_ok() {});
    }
}

/// A spectator: a socket without a seat.
struct Spectator {
    address: IpAddr,
    inbox: Inbox<Option<ClientMessage>>,
    feed: Delivery,
    /// Counts the spectator towards the room's limits.
    _permit: Permit,
}

pub struct Spectators {
    present: Vec<Spectator>,
    limits: Arc<ConnectionLimits>,
    /// Shared with the room's players.
    pub(super) permits: ParticlePermits,
}

impl Spectators {
    /// Creates an empty list; at most `address_max` of a room's spectators may come from one address.
    pub fn new(address_max: usize) -> Spectators {
        let limits = ConnectionLimits::new(limits::SPECTATORS_MAX, address_max);
        Spectators { present: Vec::new(), limits, permits: ParticlePermits::default() }
    }

    pub fn len(&self) -> usize {
        self.present.len()
    }

    /// Returns whether there are no spectators.
    pub fn is_empty(&self) -> bool {
        self.present.is_empty()
    }

    /// Welcomes a session as a spectator, or refuses it with a reason.
    pub fn admit(
        &mut self,
        room: &Room,
        join: Join,
        allowance: impl FnOnce(IpAddr) -> Allowance,
        now: Instant,
    ) -> Result<(), (Refusal, Arc<Outbox>)> {
        let Join { address, inbox, outbox, .. } = join;
        let Some(permit) = self.limits.admit(address) else {
            return Err((Refusal::TooManySpectators, outbox));
        };
        let (permits, tick) = (self.permits.clone(), room.game().tick_count());
        let feed = Delivery::new(None, outbox, allowance(address), permits, tick);
        feed.welcome(room.welcome(None), now);
        self.present.push(Spectator { address, inbox, feed, _permit: permit });
        Ok(())
    }

    /// Handles spectators' messages. Inputs only acknowledge snapshots, and views are ignored because spectators get
    /// the whole world. They may follow the list of bots. Everything else is dropped and counted.
    pub fn empty_inboxes(&mut self, room: &Room, metrics: &Metrics) {
        let tick = room.game().tick_count();
        self.present.retain_mut(|spectator| {
            loop {
                match spectator.inbox.try_recv() {
                    Ok(Some(ClientMessage::Input { ack_tick, input, .. })) => {
                        spectator.feed.lag.acked(ack_tick, tick);
                        if input != Input::default() {
                            metrics.ignored("spectator");
                        }
                    }
                    Ok(Some(ClientMessage::View { .. })) => {}
                    Ok(Some(ClientMessage::FollowBots)) => spectator.feed.follow_bots(room),
                    Ok(None) | Err(TryRecvError::Disconnected) => {
                        metrics.left("spectator");
                        return false;
                    }
                    Ok(_) => metrics.ignored("spectator"),
                    Err(TryRecvError::Empty) => return true,
                }
            }
        });
    }

    fn feed(&mut self, room: &mut Room, silent_ticks_max: u32, now: Instant, metrics: &Metrics) {
        for Spectator { feed, .. } in in_turn(&mut self.present, room.game().tick_count()) {
            if feed.feed(room, silent_ticks_max, now, metrics) {
                feed.outbox.send_soon();
            }
        }
    }

    /// Sends a control message to all spectators.
    pub fn tell(&self, message: &Bytes) {
        for outbox in self.outboxes() {
            outbox.aside(message.clone());
        }
    }

    /// Ends a network's sessions.
    pub fn evict(&mut self, network: IpNet) {
        self.present.retain(|spectator| {
            let stays = !network.contains(&spectator.address);
            if !stays {
                spectator.feed.outbox.end(Refusal::Kicked);
            }
            stays
        });
    }

    pub fn end(&mut self, refusal: Refusal) {
        self.present.drain(..).for_each(|spectator| spectator.feed.outbox.end(refusal));
    }

    fn outboxes(&self) -> impl Iterator<Item = &Arc<Outbox>> {
        self.present.iter().map(|spectator| &spectator.feed.outbox)
    }
}
