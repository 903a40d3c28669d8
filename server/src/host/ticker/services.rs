//! What a room's thread does in addition to playing ticks. Each job is a service.

use super::open_room::OpenRoom;
use crate::fleet::lease::RoomLease;
use crate::guests::ProcessorShare;
use crate::host::admission::KickScope;
use crate::host::clock::TickClock;
use crate::host::room_handle::{AdminCommand, Join, take_off};
use crate::limits;
use crate::log::{RoomLog, Seal};
use jostle_protocol::Refusal;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use tracing::{info, warn};

/// Maximum number of joins that a room handles per wakeup; the rest wait for the next tick.
pub const JOINS_PER_WAKEUP: usize = 32;
/// Time within which a new node must take over a room; after that, the room's players are told to look for it.
const FLEET_HAND_OVER: Duration = Duration::from_secs(10);
/// How long a room pauses without a lease before its players are told to look for it.
const FLEET_STILL: Duration = Duration::from_secs(1);

/// The reason why a room's thread ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomEnd {
    Empty,
    Closed,
    /// The guest's scene uses too much of the server's resources.
    TooCostly,
    Closing,
    /// The room was handed over to another node.
    Parted,
    /// Another node plays the room.
    Elsewhere,
    /// The thread did not respond, and the room was closed without it.
    GivenUp,
    /// The room's thread panicked, in a tick or earlier.
    Failed,
}

/// The moment when a room's thread woke.
pub struct Wakeup<'a> {
    pub now: Instant,
    pub clock: &'a dyn TickClock,
}

/// A job that accompanies the ticks. An error ends the room.
pub trait RoomService {
    /// Acts before a wakeup's ticks; returning `false` skips them.
    fn before(&mut self, _wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<bool, RoomEnd> {
        Ok(true)
    }

    /// Acts after each tick.
    fn after_tick(&mut self, _wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<(), RoomEnd> {
        Ok(())
    }

    /// Acts after a wakeup's last tick.
    fn after(&mut self, _wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<(), RoomEnd> {
        Ok(())
    }

    /// Acts after the room has ended.
    fn close(self: Box<Self>, _end: RoomEnd, _open: &mut OpenRoom) {}
}

/// Carries out commands from operators and the fleet.
pub struct Commands<'a> {
    commands: &'a Receiver<AdminCommand>,
    /// The address of the node that now plays the room.
    moved_to: Option<Arc<str>>,
}

impl<'a> Commands<'a> {
    pub fn new(commands: &'a Receiver<AdminCommand>) -> Commands<'a> {
        Commands { commands, moved_to: None }
    }

    /// Waits until the node that continues the room is known. Nothing more is played.
    fn await_leave(&mut self, open: &mut OpenRoom) {
        let until = Instant::now() + FLEET_HAND_OVER;
        while Instant::now() < until {
            match self.commands.recv_timeout(limits::FLEET_HAND_OVER_LOOK) {
                Ok(AdminCommand::Leave(url)) => {
                    self.moved_to = url;
                    return;
                }
                Err(RecvTimeoutError::Disconnected) => return,
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            }
            open.sessions.discard();
        }
    }
}

impl RoomService for Commands<'_> {
    fn before(&mut self, _wakeup: &Wakeup, open: &mut OpenRoom) -> Result<bool, RoomEnd> {
        let mut end = None;
        while let Ok(command) = self.commands.try_recv() {
            // The receiver may already be gone.
            match command {
                AdminCommand::Players(answer) => {
                    drop(answer.send(open.room.snapshot().players.clone()));
                }
                AdminCommand::Kick(seat, answer) => {
                    let _ = answer.send(open.kick(seat, KickScope::Player));
                }
                AdminCommand::Evict(network) => open.evict(network),
                AdminCommand::Close(answer) => {
                    open.closed = true;
                    let _ = answer.send(());
                }
                AdminCommand::Part => end = Some(RoomEnd::Parted),
                AdminCommand::Leave(url) => {
                    (end, self.moved_to) = (Some(RoomEnd::Elsewhere), url);
                }
            }
        }
        end.map_or(Ok(true), Err)
    }

    /// Tells the sessions of a room that is moving where it will be.
    fn close(mut self: Box<Self>, end: RoomEnd, open: &mut OpenRoom) {
        match end {
            RoomEnd::Parted => self.await_leave(open),
            RoomEnd::Elsewhere => {}
            _ => return,
        }
        if let Some(url) = &self.moved_to {
            open.sessions.outboxes().for_each(|outbox| outbox.move_to(Arc::clone(url)));
        }
    }
}

/// Checks before each tick whether this node may play the room, so that no other node can be playing it too.
pub struct LeaseWatch {
    /// `None` outside a fleet.
    lease: Option<RoomLease>,
    /// The time since when the lease has been over and the room has been paused.
    still_since: Option<Instant>,
}

impl LeaseWatch {
    pub fn new(lease: Option<RoomLease>) -> LeaseWatch {
        LeaseWatch { lease, still_since: None }
    }

    fn may_play(&mut self, code: &str, now: Instant) -> bool {
        let allowed = self.lease.as_ref().is_none_or(|lease| lease.allows(now));
        if self.still_since.is_some() == allowed {
            self.still_since = (!allowed).then_some(now);
            match allowed {
                true => info!(room = %code, "the room goes on"),
                false => {
                    warn!(room = %code, "the lease of this node is over; the room stands still")
                }
            }
        }
        allowed
    }
}

impl RoomService for LeaseWatch {
    fn before(&mut self, wakeup: &Wakeup, open: &mut OpenRoom) -> Result<bool, RoomEnd> {
        let now = wakeup.now;
        if self.may_play(&open.info.code, now) {
            return Ok(true);
        }
        open.host.metrics.ticks.stood_still();
        open.empty_inboxes();
        // Either another node or this one will continue the room; after a while the players are told to look for it.
        if self.still_since.is_some_and(|since| now - since >= FLEET_STILL) {
            open.disconnect_all(Refusal::Moving);
        }
        // Players cannot join in the meantime, and get their usual time to come back once the room continues.
        open.empty_since = now;
        Ok(false)
    }
}

/// Lets sessions in, and ends a room when nobody is left in it.
pub struct Entrance<'a> {
    joins: &'a Receiver<Join>,
}

impl<'a> Entrance<'a> {
    pub fn new(joins: &'a Receiver<Join>) -> Entrance<'a> {
        Entrance { joins }
    }
}

impl RoomService for Entrance<'_> {
    /// Admits waiting sessions, up to a limit per wakeup.
    fn before(&mut self, wakeup: &Wakeup, open: &mut OpenRoom) -> Result<bool, RoomEnd> {
        let mut held = None;
        for join in self.joins.try_iter().take(JOINS_PER_WAKEUP) {
            open.seat(join, &mut held, wakeup.now);
        }
        Ok(true)
    }

    fn after(&mut self, wakeup: &Wakeup, open: &mut OpenRoom) -> Result<(), RoomEnd> {
        if open.closed {
            return Err(RoomEnd::Closed);
        }
        if !open.is_over(wakeup.now) {
            return Ok(());
        }
        let host = Arc::clone(&open.host);
        // Sessions join under this lock, so none can join between the check and the removal.
        let mut rooms = host.lock();
        if let Ok(join) = self.joins.try_recv() {
            drop(rooms);
            open.seat(join, &mut None, wakeup.now);
            return Ok(());
        }
        take_off(&mut rooms, &open.info);
        Err(RoomEnd::Empty)
    }
}

/// Ends a guest's room if the scene uses more than its share of a processor.
pub struct GuestShare {
    /// `None` for the server's own scenes, since reading the processor time takes a system call.
    share: Option<ProcessorShare>,
}

impl GuestShare {
    pub fn new(share: Option<ProcessorShare>) -> GuestShare {
        GuestShare { share }
    }

    fn spend(&mut self, wakeup: &Wakeup) -> Result<(), RoomEnd> {
        let spend = |share: &mut ProcessorShare| share.spend(wakeup.now, wakeup.clock.worked());
        if self.share.as_mut().is_none_or(spend) { Ok(()) } else { Err(RoomEnd::TooCostly) }
    }
}

impl RoomService for GuestShare {
    fn before(&mut self, wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<bool, RoomEnd> {
        self.spend(wakeup).map(|()| true)
    }

    fn after_tick(&mut self, wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<(), RoomEnd> {
        self.spend(wakeup)
    }
}

/// Whenever the other nodes change, tells clients which of them to ask about the room if this node falls silent.
#[derive(Default)]
pub struct NeighbourNews {
    /// The revision that the clients were last told.
    told: u64,
}

impl RoomService for NeighbourNews {
    fn after_tick(&mut self, _wakeup: &Wakeup, open: &mut OpenRoom) -> Result<(), RoomEnd> {
        let neighbours = &open.host.neighbours;
        let revision = neighbours.revision();
        if std::mem::replace(&mut self.told, revision) != revision {
            let message = neighbours.message();
            for member in &open.sessions.members {
                member.feed.outbox.control(message.clone());
            }
            open.sessions.spectators.tell(&message);
        }
        Ok(())
    }
}

impl RoomService for RoomLog {
    fn after(&mut self, wakeup: &Wakeup, open: &mut OpenRoom) -> Result<(), RoomEnd> {
        let unwatched = wakeup.now - open.empty_since >= open.host.waits.record_empty;
        self.after_ticks(&mut open.room, &open.admission, unwatched);
        Ok(())
    }

    /// The records of a room that was given up have been removed, and any records under its name may be another room's.
    fn close(self: Box<Self>, end: RoomEnd, open: &mut OpenRoom) {
        let seal = match end {
            RoomEnd::Closing | RoomEnd::Parted => Seal::Keep,
            RoomEnd::Elsewhere | RoomEnd::GivenUp => Seal::Leave,
            RoomEnd::Empty | RoomEnd::Closed | RoomEnd::TooCostly | RoomEnd::Failed => Seal::Remove,
        };
        let whole = !matches!(end, RoomEnd::TooCostly | RoomEnd::Failed);
        self.end(&mut open.room, &open.admission, whole, seal);
    }
}
