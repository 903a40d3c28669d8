//! A room's end of the recording. It runs on the room's thread and waits for nothing: what the
//! writer cannot take at once is dropped, and the recording with it.

use super::{Recording, Reel};
use crate::limits;
use jostle_protocol::replay::Record;
use jostle_room::Room;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, UNIX_EPOCH};
use tracing::warn;

/// What records one room.
pub struct Tape {
    recording: Arc<Recording>,
    state: State,
}

enum State {
    On {
        reel: Arc<Reel>,
        /// Ticks played before the file began.
        first_tick: u32,
    },
    /// Something went wrong; a fresh file is begun at this time.
    Off { retry_at: Instant },
}

impl Tape {
    /// Records a room from now on.
    pub fn start(recording: Arc<Recording>, room: &mut Room, now: Instant) -> Tape {
        let mut tape = Tape { recording, state: State::Off { retry_at: now } };
        tape.begin(room, now);
        tape
    }

    /// Hands over what the room recorded. To be called after ticks were played.
    pub fn after_ticks(&mut self, room: &mut Room, now: Instant) {
        match &self.state {
            State::Off { retry_at } if now < *retry_at => {}
            State::Off { .. } => self.begin(room, now),
            State::On { reel, .. } if reel.failed.load(Ordering::Relaxed) => {
                self.switch_off(room, now);
            }
            State::On { reel, first_tick } if self.is_long(reel, room, *first_tick) => {
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

    /// Ends the recording with the game.
    pub fn end(mut self, room: &mut Room, now: Instant) {
        if matches!(self.state, State::On { .. }) {
            let last = room.stop_recording();
            self.hand_over(room, last, true, now);
            self.state = State::Off { retry_at: now };
        }
    }

    /// Ends the recording of a room that failed inside a tick. Only whole ticks are on it.
    pub fn break_off(mut self, room: &mut Room, now: Instant) {
        if matches!(self.state, State::On { .. }) {
            let last = room.break_off_recording();
            self.hand_over(room, last, true, now);
            self.state = State::Off { retry_at: now };
        }
    }

    /// Whether it is time for a new file.
    fn is_long(&self, reel: &Reel, room: &Room, first_tick: u32) -> bool {
        let ticks_max = self.recording.shelf().settings().file_ticks_max;
        room.game().tick_count() - first_tick >= ticks_max
            || reel.bytes.load(Ordering::Relaxed) >= limits::REPLAY_FILE_BYTES_MAX
    }

    fn begin(&mut self, room: &mut Room, now: Instant) {
        let wall = (self.recording.shelf().settings().wall)();
        let unix = wall.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        room.record(env!("CARGO_PKG_VERSION"), unix.as_secs());
        let first_tick = room.game().tick_count();
        self.state = State::On { reel: Arc::default(), first_tick };
        let records = room.take_records();
        self.hand_over(room, records, false, now);
    }

    /// Whether the writer has the records now; if not, the recording has ended.
    fn hand_over(
        &mut self,
        room: &mut Room,
        records: Vec<Record>,
        is_last: bool,
        now: Instant,
    ) -> bool {
        let State::On { reel, .. } = &self.state else { return false };
        let sent = self.recording.send(reel, records, is_last);
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
        // What it holds can no longer follow what was written.
        drop(room.stop_recording());
        self.leave();
        let retry = self.recording.shelf().settings().retry;
        self.state = State::Off { retry_at: now + retry };
    }

    fn leave(&self) {
        if let State::On { reel, .. } = &self.state {
            reel.left.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for Tape {
    /// A room that failed leaves its file as it is.
    fn drop(&mut self) {
        self.leave();
    }
}
