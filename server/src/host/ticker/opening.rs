//! Opens a room, or restores that of the process before.

use super::{Opened, Ticker};
use crate::durable::SavedRoom;
use crate::host::clock::Clock;
use crate::host::random::random;
use crate::host::room_state::RoomState;
use crate::replays::RoomRecording;
use jostle_room::Room;
use std::sync::Arc;
use tracing::info;

impl Ticker {
    /// Opens a new room, or that of the process before; `None` if that takes too much of the server.
    pub(super) fn open(&mut self, clock: &impl Clock) -> Option<Opened> {
        let (is_saved, now) = (self.saved.is_some(), clock.now());
        let mut room = match self.saved.take() {
            Some(saved) => self.restore(&saved, clock)?,
            None => self.new_room(),
        };
        if is_saved {
            // Also one that begins again under the same number: old tokens name it.
            room.begin_epoch(random() as u32);
        }
        if self.host.recording.is_some() {
            room.keep_clips(env!("CARGO_PKG_VERSION"));
        }
        let recording = self.host.recording.clone().filter(|_| !self.info.private);
        let recording = recording.map(|recording| RoomRecording::start(recording, &mut room, now));
        let records = self.records.clone().filter(|_| !self.info.given_up.is_cancelled());
        let state = records.map(|records| {
            RoomState::begin(records, Arc::clone(&self.info), &mut room, &self.admission, now)
        });
        Some(Opened { room, recording, state })
    }

    fn new_room(&self) -> Room {
        let (code, seed) = (&self.info.code, self.seed);
        info!(room = %code, scene = %self.info.scene.name, seed, "room opened");
        Room::new(code, Arc::clone(&self.info.scene), seed)
    }

    /// The room of the process before. One that cannot be restored begins again, under the same link; that of a guest
    /// whose scene takes too much is over.
    fn restore(&mut self, saved: &SavedRoom, clock: &impl Clock) -> Option<Room> {
        let began = clock.worked();
        let most = self.info.guest.then_some(self.host.waits.guest_excess);
        match saved.restore(|| most.is_none_or(|most| clock.worked() - began <= most)) {
            Ok(Some(room)) => {
                (self.seed, self.admission) = (saved.seed(), saved.notes.admission.clone());
                Some(room)
            }
            Ok(None) => None,
            Err(reason) => {
                if let Some(records) = &self.records
                    && !self.info.given_up.is_cancelled()
                {
                    records.set_aside(&self.info.code, &reason);
                }
                Some(self.new_room())
            }
        }
    }
}
