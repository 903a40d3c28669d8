//! What a room's thread does beside playing its ticks: a service each.

use super::open_room::OpenRoom;
use crate::fleet::lease::RoomLease;
use crate::guests::ProcessorShare;
use crate::host::clock::TickClock;
use crate::host::room_handle::{AdminCommand, Join, take_off};
use crate::limits;
use crate::log::{RoomLog, Seal};
use jostle_protocol::Refusal;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use tracing::{info, warn};

/// Joins that a room handles per wakeup; the rest wait for the next tick.
pub const JOINS_PER_WAKEUP: usize = 32;
/// Time within which a new node must take up a room that is handed over; after that its players are sent to look for
/// it.
const FLEET_HAND_OVER: Duration = Duration::from_secs(10);
/// Time that a room pauses without a lease before its players are sent to look for it.
const FLEET_STILL: Duration = Duration::from_secs(1);

/// The reason why a room's thread ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomEnd {
    Empty,
    Closed,
    /// The guest's scene takes too much of the server.
    TooCostly,
    Closing,
    /// The room was handed over to another node.
    Parted,
    /// Another node plays the room.
    Elsewhere,
    /// The thread did not answer, and the room was closed without it.
    GivenUp,
    /// Its thread panicked, in a tick or before.
    Failed,
}

/// The moment at which a room's thread woke.
pub struct Wakeup<'a> {
    pub now: Instant,
    pub clock: &'a dyn TickClock,
}

/// A job beside the ticks. An error ends the room.
pub trait RoomService {
    /// Acts before the ticks of a wakeup; `false` leaves these out.
    fn before(&mut self, _wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<bool, RoomEnd> {
        Ok(true)
    }

    /// Acts after each tick.
    fn after_tick(&mut self, _wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<(), RoomEnd> {
        Ok(())
    }

    /// Acts after the last tick of a wakeup.
    fn after(&mut self, _wakeup: &Wakeup, _open: &mut OpenRoom) -> Result<(), RoomEnd> {
        Ok(())
    }

    /// Acts after the end of the room.
    fn close(self: Box<Self>, _end: RoomEnd, _open: &mut OpenRoom) {}
}

/// Carries out the commands of operators and of the fleet.
pub struct Commands<'a> {
    commands: &'a Receiver<AdminCommand>,
    /// Where another node plays the room.
    moved_to: Option<Arc<str>>,
}

impl<'a> Commands<'a> {
    pub fn new(commands: &'a Receiver<AdminCommand>) -> Commands<'a> {
        Commands { commands, moved_to: None }
    }

    /// Waits until the node that continues the room is known. Nothing is played any more.
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
            // The receiver may be gone already.
            match command {
                AdminCommand::Players(answer) => {
                    drop(answer.send(open.room.snapshot().players.clone()));
                }
                AdminCommand::Kick(seat, answer) => drop(answer.send(open.kick(seat))),
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

    /// Tells the sessions of a room that moves where it is.
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

/// Asks before each tick whether this node may play the room, so that no other can play it too.
pub struct LeaseWatch {
    /// `None` outside a fleet.
    lease: Option<RoomLease>,
    /// Time since which the lease has been over and the room paused.
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
        // Another node will go on with the room, or this one: after a while the players are to look for it.
        if self.still_since.is_some_and(|since| now - since >= FLEET_STILL) {
            open.disconnect_all(Refusal::Moving);
        }
        // They are kept away meanwhile, and have their time to come back once it goes on.
        open.empty_since = now;
        Ok(false)
    }
}

/// Lets sessions in, and ends a room in which nobody is left.
pub struct Entrance<'a> {
    joins: &'a Receiver<Join>,
}

impl<'a> Entrance<'a> {
    pub fn new(joins: &'a Receiver<Join>) -> Entrance<'a> {
        Entrance { joins }
    }
}

impl RoomService for Entrance<'_> {
    /// Admits waiting sessions, a limited number at a time.
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
        // Sessions join under this lock, so none can arrive between the check and the removal.
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

/// Ends the room of a guest whose scene takes more than its share of a processor.
pub struct GuestShare {
    /// `None` for a scene of the server's own: asking for the processor time is a call of the system.
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

/// Tells the clients which nodes to ask for the room if this node falls silent, if those have changed.
#[derive(Default)]
pub struct NeighbourNews {
    /// The revision that they were told.
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

    /// The records of a room that was given up are removed, and those under its name may be another room's.
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
