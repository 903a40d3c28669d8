//! The thread of one room: it owns the [`Room`], plays its ticks on schedule and hands snapshots to
//! the sessions' outboxes. It waits for nothing but the time of the next tick. [`member`] is one player
//! with a socket, [`door`] decides who else gets a seat.

mod door;
mod member;

pub use door::{Door, Held};
pub use member::Member;

use crate::limits;
use crate::metrics::{Late, Metrics};
use crate::outbox::Outbox;
use crate::replays::{Recording, Tape};
use crate::rooms::Rooms;
use crate::run_queue::RunQueue;
use crate::schedule::Schedule;
use crate::seal::{Sealer, SeatClaim};
use crate::{Phase, rooms::Facts};
use jostle_protocol::{Appearance, PlayerState, Refusal, ServerMessage};
use jostle_room::{Room, Welcome};
use jostle_sim::{Input, Seat, TICKS_PER_SECOND, Vec2};
use std::net::IpAddr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};
use tokio::sync::{oneshot, watch};
use tracing::{error, info, warn};

/// A session that wants a seat. It learns the answer from its outbox: a welcome or the end.
pub struct Join {
    /// Name and colour.
    pub appearance: Appearance,
    /// What it says of a seat held before, under a seal of ours.
    pub claim: Option<SeatClaim>,
    /// The room whose host it is, under a seal of ours.
    pub hosted: Option<u64>,
    /// Whom it counts for.
    pub address: IpAddr,
    /// What the session sends; a dropped sender is a lost socket.
    pub inbox: Receiver<FromSession>,
    /// What the session is sent.
    pub outbox: Arc<Outbox>,
}

/// What a session passes on.
#[derive(Clone, Copy, Debug)]
pub enum FromSession {
    /// An input.
    Input {
        /// Its number.
        seq: u32,
        /// Low bits of the newest tick heard.
        heard: u16,
        /// What is down.
        input: Input,
    },
    /// How much of the world the page shows.
    View {
        /// Width and height, world units.
        size: Vec2,
    },
    /// The host has a player leave.
    Kick {
        /// Whom.
        seat: Seat,
    },
    /// The host closes the room.
    CloseRoom,
    /// The player closed the socket on purpose: the seat need not be held.
    Leave,
}

/// What an operator asks of a room; it answers with its next tick.
#[derive(Debug)]
pub enum Order {
    /// Who has a seat.
    Players(oneshot::Sender<Vec<PlayerState>>),
    /// A player is to leave; the answer is whether there is one.
    Kick(Seat, oneshot::Sender<bool>),
    /// The room closes.
    Close,
}

/// What the thread works on.
pub struct Ticker {
    /// Shared with whoever lists rooms.
    pub facts: Arc<Facts>,
    /// Where the room is listed.
    pub rooms: Arc<Rooms>,
    /// Sessions that want in.
    pub joins: Receiver<Join>,
    /// What operators ask.
    pub orders: Receiver<Order>,
    /// Whether the server is closing.
    pub phase: watch::Receiver<Phase>,
    /// How long the room stays open with nobody in it.
    pub empty_grace: Duration,
    /// [`limits::HEARING_MAX`].
    pub hearing: Duration,
    /// Seed of the game.
    pub seed: u64,
    /// Players with a socket.
    pub members: Vec<Member>,
    /// Who gets a seat.
    pub door: Door,
    /// Somebody who may closed the room.
    pub closed: bool,
    /// Where the room is recorded, if it is.
    pub recording: Option<Arc<Recording>>,
    /// Where it is counted.
    pub metrics: Arc<Metrics>,
    /// Seals the tokens.
    pub sealer: Arc<Sealer>,
}

/// Why a room's thread ended.
#[derive(Debug, PartialEq, Eq)]
enum End {
    Empty,
    Closed,
    Closing,
}

impl Ticker {
    /// Plays until the room is empty or the server closes. A panic ends this room alone.
    pub fn run(mut self) {
        let code = self.facts.code.clone();
        info!(room = %code, scene = %self.facts.scene.name, seed = self.seed, "room opened");
        // Out here they outlive a panic, and the last ticks before it can still be recorded.
        let mut opened = None;
        let played = catch_unwind(AssertUnwindSafe(|| {
            let (room, tape) = opened.insert(self.open());
            self.play(room, tape.as_mut())
        }));
        let now = Instant::now();
        match (played, opened) {
            (Ok(end), opened) => {
                if let Some((mut room, Some(tape))) = opened {
                    tape.end(&mut room, now);
                }
                if end == End::Closed {
                    self.dismiss(Refusal::RoomClosed);
                }
                info!(room = %code, reason = ?end, "room closed");
            }
            (Err(_), opened) => {
                error!(room = %code, players = self.members.len(), "room failed and was closed");
                self.metrics.rooms_failed.inc();
                self.dismiss(Refusal::RoomFailed);
                if let Some((mut room, Some(tape))) = opened {
                    tape.break_off(&mut room, now);
                }
            }
        }
    }

    fn open(&mut self) -> (Room, Option<Tape>) {
        let mut room = Room::new(&self.facts.code, Arc::clone(&self.facts.scene), self.seed);
        let recording = self.recording.take();
        let tape = recording.map(|recording| Tape::start(recording, &mut room, Instant::now()));
        (room, tape)
    }

    fn play(&mut self, room: &mut Room, mut tape: Option<&mut Tape>) -> End {
        let mut schedule = Schedule::new(Instant::now());
        let mut missed = Missed::default();
        let mut empty_since = Instant::now();
        let run_queue = RunQueue::of_this_thread();
        loop {
            let waited_before = run_queue.waited();
            let (awaited, missed_before) = (schedule.next_at(), schedule.missed());
            std::thread::sleep(awaited.saturating_duration_since(Instant::now()));
            let now = Instant::now();
            let queued = run_queue.waited_since(waited_before);
            let due = schedule.due(now);
            missed.report(&self.facts.code, schedule.missed(), now);
            if *self.phase.borrow() == Phase::Closing {
                return End::Closing;
            }
            if due == 0 {
                continue;
            }
            self.admit(room);
            self.obey(room);
            let late = Late { raw: now.saturating_duration_since(awaited), queued };
            let mut watch = Stopwatch::start();
            for _ in 0..due {
                self.pass_on(room);
                watch.lap(0);
                room.tick();
                watch.lap(1);
                self.feed(room);
                watch.lap(2);
            }
            let skipped = schedule.missed() - missed_before;
            self.metrics.ticks.woke(due, skipped, late, watch.laps);
            self.publish(room);
            if let Some(tape) = &mut tape {
                tape.after_ticks(room, now);
            }
            if self.closed {
                return End::Closed;
            }
            if !self.members.is_empty() {
                empty_since = now;
            } else if now - empty_since >= self.empty_grace && self.retire(room) {
                return End::Empty;
            }
        }
    }

    fn admit(&mut self, room: &mut Room) {
        let mut held = None;
        for _ in 0..limits::JOINS_PER_WAKEUP {
            let Ok(join) = self.joins.try_recv() else { return };
            self.seat(room, join, &mut held);
        }
    }

    /// Seats somebody, or says why not. `held`: the held seats, once somebody needed them.
    fn seat(&mut self, room: &mut Room, join: Join, held: &mut Option<Held>) {
        let (name, address) = (join.appearance.name.clone(), join.address);
        let (own, host) = (self.facts.number, join.hosted == Some(self.facts.number));
        match self.place(room, &join, host, held) {
            Ok(Welcome { claim, resumed }) => {
                *held = None;
                self.metrics.joined(resumed);
                let seat = claim.seat;
                // The seat has a new socket; an older one, if there still is one, is forgotten.
                self.end_sessions(seat, Refusal::Replaced);
                self.door.seated(seat, address);
                info!(
                    room = %self.facts.code, seat = seat.0, %name, %address, resumed, host,
                    "player joined"
                );
                let token = self.sealer.seat_token(SeatClaim { room: own, claim });
                join.outbox.control(room.welcome(seat, token, host));
                let tick = room.game().tick_count();
                self.members.push(Member::new(seat, host, join.inbox, join.outbox, tick));
            }
            Err(refusal) => join.outbox.end(refusal),
        }
    }

    /// The claimed seat, a free one, or in a full room one that is held for somebody who has to give way.
    fn place(
        &self,
        room: &mut Room,
        join: &Join,
        host: bool,
        held: &mut Option<Held>,
    ) -> Result<Welcome, Refusal> {
        let seat = |room: &mut Room| {
            let claim = join.claim.map(|sealed| sealed.claim);
            room.join(join.appearance.clone(), claim)
        };
        match join.claim {
            Some(claim) if claim.room != self.facts.number => return Err(Refusal::BadToken),
            Some(_) => return seat(room),
            None => {}
        }
        if !host && self.door.is_shut(join.address, room.game().tick_count()) {
            return Err(Refusal::Kicked);
        }
        match seat(room) {
            Err(Refusal::RoomFull) => {
                let held = held.get_or_insert_with(|| self.door.held(room));
                let displaced = held.displaced(join.address).ok_or(Refusal::RoomFull)?;
                self.metrics.left("displaced");
                room.leave(displaced);
                seat(room)
            }
            joined => joined,
        }
    }

    fn end_sessions(&mut self, seat: Seat, refusal: Refusal) {
        self.members.retain(|member| {
            if member.seat == seat {
                member.outbox.end(refusal);
            }
            member.seat != seat
        });
    }

    /// Moves what the sessions sent into the room; the inboxes are bounded, so this ends.
    fn pass_on(&mut self, room: &mut Room) {
        let (code, metrics) = (&self.facts.code, &self.metrics);
        let (mut kicks, mut closes) = (Vec::new(), false);
        self.members.retain_mut(|member| {
            let seat = member.seat.0;
            loop {
                match member.inbox.try_recv() {
                    Ok(FromSession::Input { seq, heard, input }) => {
                        member.lag.heard(heard, room.game().tick_count());
                        if !room.input(member.seat, seq, input) {
                            metrics.inputs_ignored.inc();
                        }
                    }
                    Ok(FromSession::View { size }) => room.view(member.seat, size),
                    Ok(FromSession::Kick { seat }) if member.host => {
                        kicks.push((seat, Arc::clone(&member.outbox)));
                    }
                    Ok(FromSession::CloseRoom) if member.host => closes = true,
                    Ok(FromSession::Kick { .. } | FromSession::CloseRoom) => {
                        member.outbox.control(ServerMessage::Denied.encode());
                    }
                    Ok(FromSession::Leave) => {
                        info!(room = %code, seat, "player left");
                        metrics.left("left");
                        room.leave(member.seat);
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
        self.closed |= closes;
    }

    /// Has a player leave, with or without a socket; whether there was one.
    fn kick(&mut self, room: &mut Room, seat: Seat) -> bool {
        let players = room.players();
        room.leave(seat);
        if room.players() == players {
            return false;
        }
        info!(room = %self.facts.code, seat = seat.0, "player kicked");
        self.metrics.left("kicked");
        self.door.kicked(seat, room.game().tick_count());
        self.end_sessions(seat, Refusal::Kicked);
        true
    }

    /// Does what operators ask.
    fn obey(&mut self, room: &mut Room) {
        while let Ok(order) = self.orders.try_recv() {
            // Whoever asked may be gone by now.
            match order {
                Order::Players(answer) => drop(answer.send(room.snapshot().players.clone())),
                Order::Kick(seat, answer) => drop(answer.send(self.kick(room, seat))),
                Order::Close => self.closed = true,
            }
        }
    }

    fn feed(&mut self, room: &mut Room) {
        let silent_ticks_max = (self.hearing.as_secs_f64() * f64::from(TICKS_PER_SECOND)) as u32;
        for member in &mut self.members {
            member.feed(room, silent_ticks_max, &self.metrics);
        }
    }

    /// What others may know of the room.
    fn publish(&self, room: &Room) {
        self.facts.tick.store(room.game().tick_count(), Ordering::Relaxed);
        self.facts.players.store(room.players(), Ordering::Relaxed);
        self.facts.bodies.store(room.snapshot().bodies.len(), Ordering::Relaxed);
    }

    /// Takes the room off the list, unless somebody joins at this moment.
    fn retire(&mut self, room: &mut Room) -> bool {
        match self.rooms.retire(&self.facts, &self.joins) {
            None => true,
            Some(join) => {
                self.seat(room, join, &mut None);
                false
            }
        }
    }

    /// Tells everybody who is in or on the way in.
    fn dismiss(&mut self, refusal: Refusal) {
        self.rooms.remove(&self.facts);
        for member in &self.members {
            member.outbox.end(refusal);
        }
        while let Ok(join) = self.joins.try_recv() {
            join.outbox.end(refusal);
        }
    }
}

/// Time by phase of a wakeup.
struct Stopwatch {
    since: Instant,
    laps: [Duration; 3],
}

impl Stopwatch {
    fn start() -> Stopwatch {
        Stopwatch { since: Instant::now(), laps: [Duration::ZERO; 3] }
    }

    fn lap(&mut self, phase: usize) {
        let now = Instant::now();
        self.laps[phase] += now - self.since;
        self.since = now;
    }
}

/// Missed ticks, told at most once in [`limits::MISSED_LOG_EVERY`].
#[derive(Default)]
struct Missed {
    told: u64,
    told_at: Option<Instant>,
}

impl Missed {
    fn report(&mut self, room: &str, missed: u64, now: Instant) {
        let quiet = self.told_at.is_some_and(|at| now - at < limits::MISSED_LOG_EVERY);
        if missed > self.told && !quiet {
            warn!(%room, ticks = missed - self.told, in_all = missed, "missed ticks");
            *self = Missed { told: missed, told_at: Some(now) };
        }
    }
}

#[cfg(test)]
mod tests;
