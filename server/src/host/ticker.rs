//! The thread of one room: it owns the [`Room`], plays its ticks on schedule and hands snapshots to
//! the sessions' outboxes. It waits for nothing but the time of the next tick.

mod joining;
mod opening;
mod timing;

use crate::fleet::lease::RoomLease;
use crate::guests::Share;
use crate::host::admission::Admission;
use crate::host::clock::TickClock;
use crate::host::delivery::in_turn;
use crate::host::member::ConnectedMember;
use crate::host::outbox::Outbox;
use crate::host::phase::Phase;
use crate::host::random::random;
use crate::host::room_handle::{AdminCommand, Host, Join, RoomInfo, take_off};
use crate::host::schedule::Schedule;
use crate::host::seat_rates::SeatRates;
use crate::host::spectators::Spectators;
use crate::limits;
use crate::log::{RoomLog, SavedRoom, Seal, SharedLog};
use crate::ops::metrics::Late;
use bytes::Bytes;
use ipnet::IpNet;
use jostle_game::Seat;
use jostle_protocol::{ClientMessage, ClipRefusal, Refusal, ServerMessage};
use jostle_room::Room;
use jostle_sim::TICKS_PER_SECOND;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::{Duration, Instant};
use timing::{Missed, Stopwatch};
use tracing::{error, info, warn};

/// The ends of the channels to a room's thread, with the state that it shares.
pub struct Ends {
    /// Shared by all rooms.
    pub host: Arc<Host>,
    /// The room's public state.
    pub info: Arc<RoomInfo>,
    /// Sessions that ask for a seat.
    pub joins: Receiver<Join>,
    pub commands: Receiver<AdminCommand>,
    /// Under which the room is held, in a fleet.
    pub lease: Option<RoomLease>,
    /// Where the readers of its log find that, if it has any.
    pub shared: Option<Arc<SharedLog>>,
}

/// State of a room's thread.
pub struct Ticker {
    host: Arc<Host>,
    info: Arc<RoomInfo>,
    joins: Receiver<Join>,
    commands: Receiver<AdminCommand>,
    /// Seed of the game.
    seed: u64,
    /// The room of the process before, until it is restored.
    saved: Option<SavedRoom>,
    /// Players with a socket.
    members: Vec<ConnectedMember>,
    spectators: Spectators,
    admission: Admission,
    emotes: SeatRates,
    clips: SeatRates,
    /// Whether the host or an operator closed the room.
    closed: bool,
    /// Whether who made the room left it, so that nobody is awaited once it is empty.
    abandoned: bool,
    /// Under which the room is held, in a fleet.
    lease: Option<RoomLease>,
    /// Where the readers of its log find that, if it has any.
    shared: Option<Arc<SharedLog>>,
    /// Since when the lease is over, and the room stands still.
    still_since: Option<Instant>,
    /// Why it is to end, if another node goes on with it.
    leaving: Option<RoomEnd>,
    moved_to: Option<Arc<str>>,
    /// The revision of the neighbours that the clients were told.
    told_neighbours: u64,
}

/// The reason why a room's thread ended.
#[derive(Debug, PartialEq, Eq)]
enum RoomEnd {
    Empty,
    Closed,
    /// The scene of a guest takes too much of the server.
    TooCostly,
    Closing,
    /// It is handed over to another node.
    Parted,
    /// Another node plays it.
    Elsewhere,
    /// The thread did not answer, and the room was closed without it.
    GivenUp,
}

impl Ticker {
    /// A room without players, which has not played yet.
    pub fn new(ends: Ends, seed: u64) -> Ticker {
        let Ends { host, info, joins, commands, lease, shared } = ends;
        let (members, admission) = (Vec::new(), Admission::default());
        let spectators = Spectators::new(host.address_spectators_max);
        Ticker {
            host,
            info,
            joins,
            commands,
            seed,
            saved: None,
            members,
            spectators,
            admission,
            emotes: SeatRates::new(
                limits::EMOTE_TICKS,
                limits::EMOTES_PER_SECOND_MAX,
                TICKS_PER_SECOND,
            ),
            clips: SeatRates::new(
                limits::CLIP_APART_TICKS,
                limits::CLIPS_PER_MINUTE_MAX,
                60 * TICKS_PER_SECOND,
            ),
            closed: false,
            abandoned: false,
            lease,
            shared,
            still_since: None,
            leaving: None,
            moved_to: None,
            told_neighbours: 0,
        }
    }

    /// The room of the process before.
    pub fn restored(ends: Ends, saved: SavedRoom) -> Ticker {
        Ticker { saved: Some(saved), ..Ticker::new(ends, random()) }
    }

    /// Plays until the room is empty or closed, or the server closes. A panic ends this room alone.
    pub fn run(mut self, clock: &mut impl TickClock) {
        let code = self.info.code.clone();
        // Kept out here, it survives a panic, and the last ticks before it can still be recorded.
        let mut opened = None;
        let played = catch_unwind(AssertUnwindSafe(|| match self.open(clock) {
            Some(open) => self.play(opened.insert(open), clock),
            None => RoomEnd::TooCostly,
        }));
        let refusal = match &played {
            Ok(end) => {
                info!(room = %code, reason = ?end, "room closed");
                match end {
                    RoomEnd::Closed => Some(Refusal::RoomClosed),
                    RoomEnd::TooCostly => Some(Refusal::TooCostly),
                    RoomEnd::GivenUp => Some(Refusal::RoomFailed),
                    _ => None,
                }
            }
            Err(_) => {
                error!(room = %code, players = self.members.len(), "room failed and was closed");
                self.host.metrics.rooms_failed.inc();
                Some(Refusal::RoomFailed)
            }
        };
        refusal.into_iter().for_each(|refusal| self.end_all_sessions(refusal));
        match (opened, &self.shared) {
            (Some(opened), _) => self.end(opened, played.as_ref().ok()),
            (None, Some(shared)) if !self.info.given_up.is_cancelled() => {
                let reason = match &played {
                    Ok(_) => "its scene takes too much of the server",
                    Err(_) => "the room failed as it was restored",
                };
                shared.seal(self.host.logs.give_up(&code, reason));
            }
            (None, _) => {}
        }
        match played {
            Ok(RoomEnd::Parted) => {
                self.await_leave();
                self.move_all_sessions();
            }
            Ok(RoomEnd::Elsewhere) => self.move_all_sessions(),
            _ => {}
        }
    }

    /// Ends the files of a room, which failed if `end` is `None`. The records of one that was given up are removed, and those
    /// under its name may be another room's.
    fn end(&self, opened: Opened, end: Option<&RoomEnd>) {
        let Opened { mut room, log } = opened;
        let seal = match end {
            Some(RoomEnd::Closing | RoomEnd::Parted) => Seal::Keep,
            Some(RoomEnd::Elsewhere | RoomEnd::GivenUp) => Seal::Leave,
            Some(RoomEnd::Empty | RoomEnd::Closed | RoomEnd::TooCostly) | None => Seal::Remove,
        };
        let whole = !matches!(end, Some(RoomEnd::TooCostly) | None);
        log.end(&mut room, &self.admission, whole, seal);
    }

    fn play(&mut self, opened: &mut Opened, clock: &mut impl TickClock) -> RoomEnd {
        let Opened { room, log } = opened;
        let mut empty_since = clock.now();
        let mut schedule = Schedule::new(empty_since);
        let mut missed = Missed::default();
        let waits = &self.host.waits;
        let mut share = self.info.guest.then(|| Share::new(waits.guest_excess, waits.guest_tick));
        // Only a room with a share asks for its processor time, which is a call of the system.
        let mut spend = |now, clock: &_| {
            share.as_mut().is_none_or(|share| share.spend(now, TickClock::worked(clock)))
        };
        loop {
            let rests = self.rests(room, clock.now() - empty_since);
            let awaited =
                if rests { clock.now() + limits::RESTING_LOOK } else { schedule.next_at() };
            let missed_before = schedule.missed();
            let queued = clock.sleep_until(awaited);
            let now = clock.now();
            // Its records were removed, and its name may be another room's.
            if self.info.given_up.is_cancelled() {
                return RoomEnd::GivenUp;
            }
            let due = if rests { schedule.pass(now) } else { schedule.due(now) };
            missed.report(&self.info.code, schedule.missed(), now);
            if self.is_closing() {
                return RoomEnd::Closing;
            }
            if due == 0 && !rests {
                continue;
            }
            self.info.last_tick.woke(now);
            self.run_commands(room);
            if let Some(end) = self.leaving.take() {
                return end;
            }
            if !self.may_play(now) {
                self.stand_still(room, now);
                // Its players are kept away meanwhile, and have their time to come back once it goes on.
                empty_since = now;
                continue;
            }
            self.admit(room, now);
            let late = Late { raw: now.saturating_duration_since(awaited), queued };
            let mut watch = Stopwatch::start(clock.now());
            if !spend(now, clock) {
                return RoomEnd::TooCostly;
            }
            for _ in 0..due {
                self.empty_inboxes(room);
                watch.lap(0, clock.now());
                room.tick();
                watch.lap(1, clock.now());
                // A tick over its budget is not sent.
                if room.game().is_over_budget() {
                    return RoomEnd::TooCostly;
                }
                self.feed(room, clock.now());
                watch.lap(2, clock.now());
                if !spend(now, clock) {
                    return RoomEnd::TooCostly;
                }
            }
            let skipped = schedule.missed() - missed_before;
            self.host.metrics.ticks.woke(due, skipped, late, watch.laps);
            // It may have stood still in a tick.
            if self.info.given_up.is_cancelled() {
                return RoomEnd::GivenUp;
            }
            self.publish(room);
            if !self.members.is_empty() {
                empty_since = now;
            }
            let empty = now - empty_since;
            let unwatched = empty >= self.host.waits.record_empty;
            log.after_ticks(room, &self.admission, unwatched);
            if self.closed {
                return RoomEnd::Closed;
            }
            let is_awaited = !self.abandoned || room.players() > 0;
            let most = self.host.waits.empty(self.info.guest, room.players());
            let is_over = !is_awaited || empty >= most;
            if self.is_left() && is_over && self.retire(room, now) {
                return RoomEnd::Empty;
            }
        }
    }

    /// Whether the room has neither players with a socket nor spectators.
    fn is_left(&self) -> bool {
        self.members.is_empty() && self.spectators.is_empty()
    }

    /// Whether nobody is there to see a tick, and nobody's seat is held: the game stands still until someone comes, and the
    /// thread only looks for that.
    fn rests(&self, room: &Room, empty: Duration) -> bool {
        self.is_left() && room.players() == 0 && empty >= limits::RESTING_AFTER
    }

    /// A server that was dropped instead of being shut down is gone as well, and its phase with it.
    fn is_closing(&self) -> bool {
        let phase = &self.host.phase;
        *phase.borrow() == Phase::Closing || phase.has_changed().is_err()
    }

    /// Returns whether this node may play the room now. Asked before each tick, so that no other can play it too.
    fn may_play(&mut self, now: Instant) -> bool {
        let allowed = self.lease.as_ref().is_none_or(|lease| lease.allows(now));
        if self.still_since.is_some() == allowed {
            self.still_since = (!allowed).then_some(now);
            let code = &self.info.code;
            match allowed {
                true => info!(room = %code, "the room goes on"),
                false => {
                    warn!(room = %code, "the lease of this node is over; the room stands still")
                }
            }
        }
        allowed
    }

    /// Lets a tick pass. Another node will go on with the room, or this one: after a while the players are to look for it.
    fn stand_still(&mut self, room: &mut Room, now: Instant) {
        self.host.metrics.ticks.stood_still();
        self.empty_inboxes(room);
        if self.still_since.is_some_and(|since| now - since >= limits::FLEET_STILL) {
            for member in self.members.drain(..) {
                member.feed.outbox.end(Refusal::Moving);
                room.disconnect(member.seat);
            }
            self.spectators.end(Refusal::Moving);
        }
    }

    /// Moves the sessions' messages into the room. The inboxes are bounded, so this ends.
    fn empty_inboxes(&mut self, room: &mut Room) {
        let (code, metrics) = (&self.info.code, &self.host.metrics);
        let (mut kicks, mut closes, mut abandons) = (Vec::new(), false, false);
        let (mut emotes, mut clips) = (Vec::new(), Vec::new());
        self.members.retain_mut(|member| {
            let seat = member.seat.0;
            loop {
                match member.inbox.try_recv() {
                    Ok(Some(ClientMessage::Input { seq, ack_tick, input })) => {
                        member.feed.lag.acked(ack_tick, room.game().tick_count());
                        if !room.input(member.seat, seq, input) {
                            metrics.inputs_ignored.inc();
                        }
                    }
                    Ok(Some(ClientMessage::View { size })) => room.view(member.seat, size),
                    Ok(Some(ClientMessage::Kick { seat })) if member.host => {
                        kicks.push((seat, Arc::clone(&member.feed.outbox)));
                    }
                    Ok(Some(ClientMessage::CloseRoom)) if member.host => closes = true,
                    Ok(Some(ClientMessage::Kick { .. } | ClientMessage::CloseRoom)) => {
                        member.feed.outbox.control(ServerMessage::Denied.encode());
                    }
                    Ok(Some(ClientMessage::Emote { emote })) => emotes.push((member.seat, emote)),
                    // A session answers pings itself, and refuses a second hello.
                    Ok(Some(ClientMessage::Ping { .. } | ClientMessage::Hello { .. })) => {}
                    Ok(Some(ClientMessage::Clip)) => {
                        clips.push((member.seat, Arc::clone(&member.feed.outbox)));
                    }
                    Ok(None) => {
                        info!(room = %code, seat, "player left");
                        metrics.left("left");
                        room.leave(member.seat);
                        abandons |= member.host;
                        return false;
                    }
                    Err(TryRecvError::Empty) => return true,
                    Err(TryRecvError::Disconnected) => {
                        info!(room = %code, seat, "player lost");
                        metrics.left("lost");
                        room.disconnect(member.seat);
                        return false;
                    }
                }
            }
        });
        for (seat, outbox) in kicks {
            if self.members.iter().any(|member| member.seat == seat && member.host) {
                outbox.control(ServerMessage::Denied.encode());
            } else {
                self.kick(room, seat);
            }
        }
        for (seat, emote) in emotes {
            self.show(seat, emote, room.game().tick_count());
        }
        for (seat, outbox) in clips {
            self.keep_clip(room, seat, outbox);
        }
        self.spectators.empty_inboxes(room.game().tick_count(), &self.host.metrics);
        self.closed |= closes;
        self.abandoned |= abandons;
    }

    /// Has the last seconds kept for a player, who is answered once that is done.
    fn keep_clip(&mut self, room: &Room, seat: Seat, outbox: Arc<Outbox>) {
        let answer = move |kept| {
            outbox.control(ServerMessage::Clip { kept }.encode());
        };
        let Some(recording) = &self.host.logs.recording else {
            return answer(Err(ClipRefusal::Off));
        };
        let asked_by = self.admission.address(seat);
        let admitted = |address| recording.admit_clip(address, Instant::now());
        // The address first: a refusal does not count for the seat.
        if !asked_by.is_none_or(admitted) || !self.clips.admit(seat, room.game().tick_count()) {
            return answer(Err(ClipRefusal::TooMany));
        }
        match room.clip(recording.unix_s()) {
            Some(records) => recording.keep_clip(records, !self.info.private, asked_by, answer),
            None => answer(Err(ClipRefusal::Off)),
        }
    }

    /// Shows an emote to all clients, unless there were too many.
    fn show(&mut self, seat: Seat, emote: u8, tick: u32) {
        if !self.emotes.admit(seat, tick) {
            return self.host.metrics.ignored("emote");
        }
        let message = Bytes::from(ServerMessage::Emote { seat, emote }.encode());
        for member in &self.members {
            member.feed.outbox.aside(message.clone());
        }
        self.spectators.tell(&message);
    }

    /// Kicks a player, connected or not. Returns whether there was one in this seat.
    fn kick(&mut self, room: &mut Room, seat: Seat) -> bool {
        if room.dismiss_bot(seat) {
            return true;
        }
        let players = room.players();
        room.leave(seat);
        if room.players() == players {
            return false;
        }
        info!(room = %self.info.code, seat = seat.0, "player kicked");
        self.host.metrics.left("kicked");
        let others = self.members.iter().map(|member| member.seat);
        self.admission.kicked(seat, others, room.game().tick_count());
        self.end_sessions(seat, Refusal::Kicked);
        true
    }

    /// Carries out the commands of operators.
    fn run_commands(&mut self, room: &mut Room) {
        while let Ok(command) = self.commands.try_recv() {
            // The receiver may be gone by now.
            match command {
                AdminCommand::Players(answer) => drop(answer.send(room.snapshot().players.clone())),
                AdminCommand::Kick(seat, answer) => drop(answer.send(self.kick(room, seat))),
                AdminCommand::Evict(network) => self.evict(room, network),
                AdminCommand::Close(answer) => {
                    self.closed = true;
                    let _ = answer.send(());
                }
                AdminCommand::Part => self.leaving = Some(RoomEnd::Parted),
                AdminCommand::Leave(url) => {
                    (self.leaving, self.moved_to) = (Some(RoomEnd::Elsewhere), url);
                }
            }
        }
    }

    /// Removes all players of a network, connected or not, and its spectators.
    fn evict(&mut self, room: &mut Room, network: IpNet) {
        self.spectators.evict(network);
        let seats = room.snapshot().players.iter().map(|player| player.seat);
        let of_network = |seat: &Seat| {
            self.admission.address(*seat).is_some_and(|address| network.contains(&address))
        };
        let seats: Vec<Seat> = seats.filter(of_network).collect();
        for seat in seats {
            self.kick(room, seat);
        }
    }

    fn feed(&mut self, room: &mut Room, now: Instant) {
        // First: no pong is to name a tick before one that its client has seen.
        self.info.tick.store(room.game().tick_count(), Ordering::Relaxed);
        let silent_ticks_max =
            (self.host.waits.hearing.as_secs_f64() * f64::from(TICKS_PER_SECOND)) as u32;
        for member in in_turn(&mut self.members, room.game().tick_count()) {
            if member.feed.feed(room, silent_ticks_max, now, &self.host.metrics) {
                member.feed.outbox.send_soon();
            }
        }
        self.spectators.feed(room, silent_ticks_max, now, &self.host.metrics);
        self.host.send_queues.iter().for_each(|queue| queue.request());
        self.tell_neighbours();
    }

    /// Tells the clients where to ask for the room when this node falls silent, if that has changed.
    fn tell_neighbours(&mut self) {
        let revision = self.host.neighbours.revision();
        if std::mem::replace(&mut self.told_neighbours, revision) != revision {
            let message = self.host.neighbours.message();
            for member in &self.members {
                member.feed.outbox.control(message.clone());
            }
            self.spectators.tell(&message);
        }
    }

    /// Updates the room's public state.
    fn publish(&self, room: &Room) {
        self.info.players.store(room.players(), Ordering::Relaxed);
        self.info.connected.store(self.members.len(), Ordering::Relaxed);
        self.info.spectators.store(self.spectators.len(), Ordering::Relaxed);
        self.info.bodies.store(room.snapshot().bodies.len(), Ordering::Relaxed);
    }

    /// Takes the room off the list, unless a session joins at this moment.
    fn retire(&mut self, room: &mut Room, now: Instant) -> bool {
        // Sessions join under this lock, so none can slip in between the check and the removal.
        let mut open = self.host.lock();
        if let Ok(join) = self.joins.try_recv() {
            drop(open);
            self.seat(room, join, &mut None, now);
            return false;
        }
        take_off(&mut open, &self.info);
        true
    }

    /// Waits until the node that goes on with the room is known. Nothing is played any more.
    fn await_leave(&mut self) {
        let until = Instant::now() + limits::FLEET_HAND_OVER;
        while Instant::now() < until {
            match self.commands.recv_timeout(limits::FLEET_HAND_OVER_LOOK) {
                Ok(AdminCommand::Leave(url)) => {
                    self.moved_to = url;
                    return;
                }
                Err(RecvTimeoutError::Disconnected) => return,
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            }
            // Full inboxes would end their sessions.
            self.members.iter_mut().for_each(|member| while member.inbox.try_recv().is_ok() {});
            self.spectators.discard();
        }
    }

    /// Tells all sessions where the room goes on.
    fn move_all_sessions(&mut self) {
        let url = self.moved_to.take();
        let outboxes = self.members.iter().map(|member| &member.feed.outbox);
        for outbox in outboxes.chain(self.spectators.outboxes()) {
            url.iter().for_each(|url| outbox.move_to(Arc::clone(url)));
            outbox.end(Refusal::Moving);
        }
        self.end_all_sessions(Refusal::Moving);
    }

    /// Ends all sessions in the room and those waiting to join.
    fn end_all_sessions(&mut self, refusal: Refusal) {
        take_off(&mut self.host.lock(), &self.info);
        for member in &self.members {
            member.feed.outbox.end(refusal);
        }
        self.spectators.end(refusal);
        while let Ok(join) = self.joins.try_recv() {
            join.outbox.end(refusal);
        }
    }
}

/// An open room and the readers of its log.
struct Opened {
    room: Room,
    log: RoomLog,
}

#[cfg(test)]
mod tests;
