//! Restores a room after its process has ended, from the game in a recording and the seats of its players
//! beside it. Players get their seats back with the claims that they have.

use super::{PendingChange, Room};
use crate::members::Member;
use crate::playback::Moment;
use crate::saved::{SavedMembers, SavedSeat};
use jostle_game::{Input, Seat};

impl Room {
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
            joined_tick: member.joined_tick,
            lost_tick: member.lost_tick,
            is_bot: self.is_bot(seat),
        });
        SavedMembers {
            bots: self.bots.as_ref().map_or(0, |bots| bots.fill()),
            seats: seats.collect(),
        }
    }

    /// Has the serials of claims go on from a random number, so that none equals one that a process before gave.
    pub fn begin_epoch(&mut self, epoch: u32) {
        self.serial = u64::from(epoch) << 32;
    }

    /// Restores a room from the newest moment of its recording, and from who had which seat then. All
    /// sockets are gone: each seat is held from now on. Players of whom `saved` knows nothing leave with the next
    /// tick. Claims that were given in a moment that was lost must not be given again: see [`Room::begin_epoch`].
    pub fn restore(code: &str, seed: u64, moment: Moment, saved: &SavedMembers) -> Room {
        let Moment { game, mut members } = moment;
        let tick = game.tick_count();
        let seats: Vec<Seat> = game.players().map(|player| player.seat).collect();
        let mut room = Room::of(code, game, seed);
        if let Some(bots) = &mut room.bots {
            bots.set_fill(saved.bots);
        }
        for seat in seats {
            let known = saved.seats.iter().find(|saved| saved.seat == seat.0);
            let bots = room.bots.as_mut().filter(|_| known.is_some_and(|saved| saved.is_bot));
            let is_bot = bots.map(|bots| bots.add(seat)).is_some();
            let known = known.filter(|saved| is_bot || !saved.is_bot);
            let Some((saved, appearance)) = known.zip(members.remove(&seat.0)) else {
                room.changes.push(PendingChange::Leave(seat));
                room.members_revision += 1;
                continue;
            };
            let member = Member {
                serial_before: saved.serial_before,
                joined_tick: saved.joined_tick,
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
