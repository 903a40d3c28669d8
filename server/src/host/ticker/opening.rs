//! Opens a room, or restores that of the process before.

use super::{Opened, Ticker};
use crate::host::clock::TickClock;
use crate::host::random::random;
use crate::log::{RoomLog, SavedRoom};
use jostle_room::Room;
use std::sync::Arc;
use tracing::info;

impl Ticker {
    /// Opens a new room, or that of the process before; `None` if that takes too much of the server.
    pub(super) fn open(&mut self, clock: &impl TickClock) -> Option<Opened> {
        let is_saved = self.saved.is_some();
        let mut room = match self.saved.take() {
            Some(saved) => self.restore(&saved, clock)?,
            None => self.new_room(),
        };
        if is_saved {
            // Also one that begins again under the same number: old tokens name it.
            room.begin_epoch(random() as u32);
        }
        let (logs, shared) = (&self.host.logs, self.shared.clone());
        let log = RoomLog::begin(logs, shared, self.info.notes(), &mut room, &self.admission);
        Some(Opened { room, log })
    }

    fn new_room(&self) -> Room {
        let (code, seed) = (&self.info.code, self.seed);
        info!(room = %code, scene = %self.info.scene.name, seed, "room opened");
        Room::new(code, Arc::clone(&self.info.scene), seed)
    }

    /// The room of the process before. One that cannot be restored begins again, under the same link; that of a guest
    /// whose scene takes too much is over.
    fn restore(&mut self, saved: &SavedRoom, clock: &impl TickClock) -> Option<Room> {
        let began = clock.worked();
        let most = self.info.guest.then_some(self.host.waits.guest_excess);
        match saved.restore(|| most.is_none_or(|most| clock.worked() - began <= most)) {
            Ok(Some(room)) => {
                (self.seed, self.admission) = (saved.seed(), saved.notes.admission.clone());
                Some(room)
            }
            Ok(None) => None,
            Err(reason) => {
                if !self.info.given_up.is_cancelled() {
                    self.host.logs.set_aside(&self.info.code, &reason);
                }
                Some(self.new_room())
            }
        }
    }
}
