//! A room's thread. It plays the ticks of an [`OpenRoom`] on schedule and lets its [`RoomService`]s do their jobs
//! around them. It waits for nothing except the time of the next tick.

mod open_room;
mod requests;
pub mod schedule;
mod services;

pub use open_room::RoomOrigin;

use crate::fleet::lease::RoomLease;
use crate::guests::ProcessorShare;
use crate::host::Phase;
use crate::host::clock::TickClock;
use crate::host::room_handle::{AdminCommand, Host, Join, RoomInfo, take_off};
use crate::log::{RoomLog, SharedLog};
use crate::ops::metrics::Late;
use jostle_protocol::Refusal;
use open_room::OpenRoom;
use schedule::{Missed, Schedule, Stopwatch};
use services::{Commands, Entrance, GuestShare, LeaseWatch, NeighbourNews, RoomEnd};
use services::{RoomService, Wakeup};
use std::convert::Infallible;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;
use tracing::{error, info};

/// Interval at which a paused room checks for newcomers, and therefore the longest time that a newcomer waits.
const RESTING_LOOK: Duration = Duration::from_millis(50);

/// The room thread's ends of the channels, and the state that it shares.
pub struct Ends {
    /// State shared by all rooms.
    pub host: Arc<Host>,
    /// The room's public state.
    pub info: Arc<RoomInfo>,
    /// Channel from sessions that ask for a seat.
    pub joins: Receiver<Join>,
    pub commands: Receiver<AdminCommand>,
    /// The room's lease, if the server is in a fleet.
    pub lease: Option<RoomLease>,
    /// Where readers find the room's log, if it has one.
    pub shared: Option<Arc<SharedLog>>,
}

/// Plays a room until it is empty or closed, or the server closes. A panic ends only this room.
pub fn run(ends: &Ends, origin: RoomOrigin, clock: &mut impl TickClock) {
    let code = &ends.info.code;
    // This is kept outside the closure so that it survives a panic and the last ticks before it can still be recorded.
    let mut ticker: Option<Ticker> = None;
    let played = catch_unwind(AssertUnwindSafe(|| {
        let opened = Ticker::open(ends, origin, clock).ok_or(RoomEnd::TooCostly)?;
        ticker.insert(opened).play(clock)
    }));
    let end = match played {
        Ok(Err(end)) => {
            info!(room = %code, reason = ?end, "room closed");
            end
        }
        Err(_) => {
            let players = ticker.as_ref().map_or(0, |ticker| ticker.open.sessions.members.len());
            error!(room = %code, players, "room failed and was closed");
            ends.host.metrics.rooms_failed.inc();
            RoomEnd::Failed
        }
    };
    if let (RoomEnd::Closed, Some(ticker)) = (end, &ticker) {
        let members = ticker.open.room.saved_members();
        let claims = members.seats.iter().map(|seat| seat.serial).collect();
        ends.host.successors.note_closed(ends.info.number, claims, clock.now());
    }
    let refusal = match end {
        RoomEnd::Closed => Some(Refusal::RoomClosed),
        RoomEnd::TooCostly => Some(Refusal::TooCostly),
        RoomEnd::GivenUp | RoomEnd::Failed => Some(Refusal::RoomFailed),
        RoomEnd::Empty | RoomEnd::Closing | RoomEnd::Parted | RoomEnd::Elsewhere => None,
    };
    refusal.into_iter().for_each(|refusal| end_all_sessions(ends, ticker.as_mut(), refusal));
    match (&mut ticker, &ends.shared) {
        (Some(ticker), _) => ticker.close(end),
        (None, Some(shared)) if !ends.info.given_up.is_cancelled() => {
            let reason = match end {
                RoomEnd::Failed => "the room failed as it was restored",
                _ => "its scene takes too much of the server",
            };
            shared.seal(ends.host.logs.give_up(code, reason));
        }
        (None, _) => {}
    }
    if matches!(end, RoomEnd::Parted | RoomEnd::Elsewhere) {
        end_all_sessions(ends, ticker.as_mut(), Refusal::Moving);
    }
}

/// Takes the room off the list, and ends all of its sessions and those waiting to join.
fn end_all_sessions(ends: &Ends, ticker: Option<&mut Ticker>, refusal: Refusal) {
    take_off(&mut ends.host.lock(), &ends.info);
    if let Some(ticker) = ticker {
        ticker.open.sessions.end(refusal);
    }
    ends.joins.try_iter().for_each(|join| join.outbox.end(refusal));
}

/// The state of a room's thread.
struct Ticker<'a> {
    open: OpenRoom,
    /// Services that come first in this list act first before ticks and last after them.
    services: Vec<Box<dyn RoomService + 'a>>,
}

impl<'a> Ticker<'a> {
    /// Opens the room; `None` if that uses too much of the server's resources.
    fn open(ends: &'a Ends, origin: RoomOrigin, clock: &impl TickClock) -> Option<Ticker<'a>> {
        let Ends { host, info, joins, commands, lease, shared } = ends;
        let mut open = OpenRoom::new(host, info, origin, clock)?;
        let (room, admission) = (&mut open.room, &open.admission);
        let log = RoomLog::begin(&host.logs, shared.clone(), info.notes(), room, admission);
        let (excess, most) = (host.waits.guest_excess, host.waits.guest_tick);
        let services: Vec<Box<dyn RoomService>> = vec![
            Box::new(Commands::new(commands)),
            Box::new(LeaseWatch::new(lease.clone())),
            Box::new(Entrance::new(joins)),
            Box::new(GuestShare::new(info.guest.then(|| ProcessorShare::new(excess, most)))),
            Box::new(NeighbourNews::default()),
            Box::new(log),
        ];
        Some(Ticker { open, services })
    }

    /// Plays until something ends the room.
    fn play(&mut self, clock: &mut impl TickClock) -> Result<Infallible, RoomEnd> {
        let (mut schedule, mut missed) = (Schedule::new(clock.now()), Missed::default());
        loop {
            let rests = self.open.rests(clock.now());
            let awaited = if rests { clock.now() + RESTING_LOOK } else { schedule.next_at() };
            let missed_before = schedule.missed();
            let queued = clock.sleep_until(awaited);
            let now = clock.now();
            self.check_given_up()?;
            let due = if rests { schedule.pass(now) } else { schedule.due(now) };
            missed.report(&self.open.info.code, schedule.missed(), now);
            if self.is_closing() {
                return Err(RoomEnd::Closing);
            }
            if due == 0 && !rests {
                continue;
            }
            self.open.info.last_tick.woke(now);
            let wakeup = Wakeup { now, clock: &*clock };
            if !self.before(&wakeup)? {
                continue;
            }
            let late = Late { raw: now.saturating_duration_since(awaited), queued };
            let laps = self.play_ticks(due, &wakeup)?;
            let skipped = schedule.missed() - missed_before;
            self.open.host.metrics.ticks.woke(due, skipped, late, laps);
            // The thread may have been blocked within a tick.
            self.check_given_up()?;
            self.open.publish(now);
            let Ticker { open, services } = self;
            services.iter_mut().rev().try_for_each(|service| service.after(&wakeup, open))?;
        }
    }

    /// Whether the ticks may be played; `false` if a service skips them.
    fn before(&mut self, wakeup: &Wakeup) -> Result<bool, RoomEnd> {
        for service in &mut self.services {
            if !service.before(wakeup, &mut self.open)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Plays the ticks that are due. Returns the time spent on inputs, on playing and on sending.
    fn play_ticks(&mut self, due: u32, wakeup: &Wakeup) -> Result<[Duration; 3], RoomEnd> {
        let Ticker { open, services } = self;
        let mut watch = Stopwatch::start(wakeup.clock.now());
        for _ in 0..due {
            open.empty_inboxes();
            watch.lap(0, wakeup.clock.now());
            open.room.tick();
            watch.lap(1, wakeup.clock.now());
            // A tick that exceeds its budget is not sent.
            if open.room.game().is_over_budget() {
                return Err(RoomEnd::TooCostly);
            }
            open.feed(wakeup.clock.now());
            services.iter_mut().rev().try_for_each(|service| service.after_tick(wakeup, open))?;
            watch.lap(2, wakeup.clock.now());
        }
        Ok(watch.laps)
    }

    /// The records of a room that was given up have been removed, and another room may have its name.
    fn check_given_up(&self) -> Result<(), RoomEnd> {
        if self.open.info.given_up.is_cancelled() { Err(RoomEnd::GivenUp) } else { Ok(()) }
    }

    /// A server that was dropped rather than shut down also counts as closing; its phase is gone.
    fn is_closing(&self) -> bool {
        let phase = &self.open.host.phase;
        *phase.borrow() == Phase::Closing || phase.has_changed().is_err()
    }

    fn close(&mut self, end: RoomEnd) {
        for service in self.services.drain(..).rev() {
            service.close(end, &mut self.open);
        }
    }
}

#[cfg(test)]
mod tests;
