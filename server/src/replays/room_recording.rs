//! The recording of one room. It runs on the room's thread and waits for nothing: records that the
//! writer cannot take at once are dropped, and the recording ends.

use super::queue::RecordingFile;
use super::recording::Recording;
use crate::limits;
use jostle_protocol::replay::Record;
use jostle_room::Room;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;
use tracing::warn;

/// The recording of one room.
pub struct RoomRecording {
    recording: Arc<Recording>,
    state: State,
}

enum State {
    On {
        recording_file: Arc<RecordingFile>,
        /// Ticks played before the file began.
        first_tick: u32,
    },
    /// Recording failed; a new file is begun at this time.
    Off { retry_at: Instant },
    /// The room is empty; the next player starts a new file.
    Paused,
}

impl RoomRecording {
    /// Starts to record a room.
    pub fn start(recording: Arc<Recording>, room: &mut Room, now: Instant) -> RoomRecording {
        let mut room_recording = RoomRecording { recording, state: State::Off { retry_at: now } };
        room_recording.begin(room, now);
        room_recording
    }

    /// Ends the file of a room that has become empty. [`after_ticks`](RoomRecording::after_ticks) starts a
    /// new one.
    pub fn pause(&mut self, room: &mut Room, now: Instant) {
        if let State::On { .. } = self.state {
            let last = room.stop_recording();
            self.hand_over(room, last, true, now);
        }
        self.state = State::Paused;
    }

    /// Hands new records to the writer. To be called after ticks were played.
    pub fn after_ticks(&mut self, room: &mut Room, now: Instant) {
        match &self.state {
            State::Off { retry_at } if now < *retry_at => {}
            State::Off { .. } | State::Paused => self.begin(room, now),
            State::On { recording_file, .. } if recording_file.failed.load(Ordering::Relaxed) => {
                self.switch_off(room, now);
            }
            State::On { recording_file, first_tick }
                if self.is_long(recording_file, room, *first_tick) =>
            {
                let last = room.stop_recording();
                if self.hand_over(room, last, true, now) {
                    self.begin(room, now);
                }
            }
            State::On { .. } => {
                let records = room.take_records();
                if !records.is_empty() {
                    self.hand_over(room, records, false, now);
                }
            }
        }
    }

    /// Ends the recording with the last records of its room.
    pub fn end(mut self, room: &mut Room, last: Vec<Record>, now: Instant) {
        self.hand_over(room, last, true, now);
        self.state = State::Off { retry_at: now };
    }

    /// Returns whether it is time for a new file.
    fn is_long(&self, recording_file: &RecordingFile, room: &Room, first_tick: u32) -> bool {
        let ticks_max = self.recording.store().settings().file_ticks_max;
        room.game().tick_count() - first_tick >= ticks_max
            || recording_file.bytes.load(Ordering::Relaxed) >= limits::REPLAY_FILE_BYTES_MAX
    }

    fn begin(&mut self, room: &mut Room, now: Instant) {
        room.record(env!("CARGO_PKG_VERSION"), self.recording.unix_s());
        let first_tick = room.game().tick_count();
        self.state = State::On { recording_file: Arc::default(), first_tick };
        let records = room.take_records();
        self.hand_over(room, records, false, now);
    }

    /// Queues records for the writer. Returns false if that failed and the recording ended.
    fn hand_over(
        &mut self,
        room: &mut Room,
        records: Vec<Record>,
        is_last: bool,
        now: Instant,
    ) -> bool {
        let State::On { recording_file, .. } = &self.state else { return false };
        let sent = self.recording.send(recording_file, records, is_last);
        if let Err(reason) = sent {
            warn!(
                room = room.code(),
                tick = room.game().tick_count(),
                reason,
                "the recording of this room stops; the game goes on"
            );
            self.switch_off(room, now);
        }
        sent.is_ok()
    }

    fn switch_off(&mut self, room: &mut Room, now: Instant) {
        // The room's records no longer follow those that were written.
        drop(room.stop_recording());
        self.leave();
        let retry = self.recording.store().settings().retry;
        self.state = State::Off { retry_at: now + retry };
    }

    fn leave(&self) {
        if let State::On { recording_file, .. } = &self.state {
            recording_file.left.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for RoomRecording {
    /// A room that failed leaves its file as it is.
    fn drop(&mut self) {
        self.leave();
    }
}
