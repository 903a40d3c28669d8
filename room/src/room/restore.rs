//! What outlives a room's process: the game in a recording, and beside it who has which seat. From both
//! the room is restored, and its players get their seats back with the claims that they have.

use super::{Change, Room};
use crate::members::Member;
use crate::playback::Moment;
use crate::recorder::Recorder;
use crate::saved::{SavedMembers, SavedSeat};
use jostle_game::{Input, Seat};
use jostle_protocol::replay::Record;

impl Room {
    /// Starts the recording from which the room can be restored. See [`Recorder::for_restoring`].
    pub fn record_for_restoring(&mut self, program: &str, unix_s: u64) {
        let (start, members) = self.recording_start(program, unix_s);
        self.restorable = Some(Recorder::for_restoring(start, &self.game, members));
    }

    /// Takes the records of that recording that are ready; with `flush` all ticks up to now.
    pub fn take_restorable(&mut self, flush: bool) -> Vec<Record> {
        let Some(restorable) = &mut self.restorable else { return Vec::new() };
        if flush {
            restorable.flush();
        }
        restorable.take()
    }

    /// Grows with every change of what [`Room::saved_members`] returns.
    pub fn members_revision(&self) -> u64 {
        self.members_revision
    }

    /// Who has which seat now.
    pub fn saved_members(&self) -> SavedMembers {
        let seats = self.members.seats.iter().map(|(&seat, member)| SavedSeat {
            seat: seat.0,
            serial: member.serial,
            serial_before: member.serial_before,
            lost_tick: member.lost_tick,
            is_bot: self.is_bot(seat),
        });
        SavedMembers {
            bots: self.bots.as_ref().map_or(0, |bots| bots.fill()),
            seats: seats.collect(),
        }
    }

    /// Restores a room from the newest moment of its recording, and from who had which seat then. All
    /// sockets are gone: each seat is held from now on. Players of whom `saved` knows nothing leave with the next
    /// tick.
    ///
    /// `epoch` is a random number: serials of claims go on from it, so that none is given again to another
    /// player which the process before gave in a moment that was lost.
    pub fn restore(
        code: &str,
        seed: u64,
        moment: Moment,
        saved: &SavedMembers,
        epoch: u32,
    ) -> Room {
        let Moment { game, members } = moment;
        let tick = game.tick_count();
        let mut room = Room::of(code, game, seed);
        room.serial = u64::from(epoch) << 32;
        if let Some(bots) = &mut room.bots {
            bots.set_fill(saved.bots);
        }
        for (seat, appearance) in members {
            let known = saved.seats.iter().find(|saved| saved.seat == seat);
            let seat = Seat(seat);
            let bots = room.bots.as_mut().filter(|_| known.is_some_and(|saved| saved.is_bot));
            let is_bot = bots.map(|bots| bots.add(seat)).is_some();
            let Some(saved) = known.filter(|saved| is_bot || !saved.is_bot) else {
                room.changes.push(Change::Leave(seat));
                continue;
            };
            let member = Member {
                serial_before: saved.serial_before,
                lost_tick: (!is_bot).then(|| saved.lost_tick.unwrap_or(tick).min(tick)),
                played: true,
                intent: (Input::default(), tick),
                ..Member::new(appearance, saved.serial)
            };
            room.members.seats.insert(seat, member);
        }
        room.capture();
        room
    }
}
