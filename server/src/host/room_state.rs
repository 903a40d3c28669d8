//! The file of one room, as its thread sees it. It waits for nothing: if the writer is too far behind, the file is
//! given up, and a new one begins after a while.

use crate::durable::{Job, Notes, RecordSink, RoomFile};
use crate::host::admission::Admission;
use crate::host::room_handle::RoomInfo;
use crate::limits;
use jostle_protocol::replay::Record;
use jostle_room::Room;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tracing::warn;

/// The state of one room in its file.
pub struct RoomState {
    writer: Arc<dyn RecordSink>,
    info: Arc<RoomInfo>,
    phase: Phase,
}

enum Phase {
    On {
        room_file: Arc<RoomFile>,
        /// Ticks played before the file began.
        first_tick: u32,
        /// Revision of the newest notes in the file.
        noted: Revision,
        /// The tick from which on it may have more notes.
        note_at: u32,
    },
    /// The file was given up; a new one begins at this time.
    Off { retry_at: Instant },
}

/// Revisions of what the notes say.
type Revision = (u64, u64);

impl RoomState {
    /// Begins the file of a room.
    pub fn begin(
        writer: Arc<dyn RecordSink>,
        info: Arc<RoomInfo>,
        room: &mut Room,
        admission: &Admission,
        now: Instant,
    ) -> RoomState {
        let phase = Phase::Off { retry_at: now };
        let mut state = RoomState { writer, info, phase };
        state.begin_file(room, admission, now);
        state
    }

    /// Hands new records to the writer. To be called after ticks were played.
    pub fn after_ticks(&mut self, room: &mut Room, admission: &Admission, now: Instant) {
        match &mut self.phase {
            Phase::Off { retry_at } if now < *retry_at => {}
            Phase::Off { .. } => self.begin_file(room, admission, now),
            Phase::On { room_file, .. } if room_file.failed.load(Ordering::Relaxed) => {
                self.phase = Phase::Off { retry_at: now + limits::STATE_RETRY };
            }
            Phase::On { first_tick, .. }
                if room.game().tick_count() - *first_tick >= limits::STATE_FILE_TICKS =>
            {
                self.begin_file(room, admission, now);
            }
            Phase::On { .. } => {
                if let Some(job) = self.append(room, admission) {
                    self.hand_over(job, room, now);
                }
            }
        }
    }

    /// Writes a last file with the whole state, from which the next process restores the room without playing any
    /// tick again, whatever became of the file before.
    pub fn close(mut self, room: &mut Room, admission: &Admission) {
        let (room_file, job) = self.new_file(room, admission);
        self.writer.send(job);
        self.writer.send(Job::Close(room_file));
    }

    /// Removes the file: the room is over.
    pub fn remove(self) {
        self.writer.send(Job::Remove(room_file(&self.info)));
    }

    /// The job that appends what is new, if anything is.
    fn append(&mut self, room: &mut Room, admission: &Admission) -> Option<Job> {
        let Phase::On { room_file, noted, note_at, .. } = &mut self.phase else { return None };
        let (now, tick) = (revision(room, admission), room.game().tick_count());
        let changed = *noted != now && tick >= *note_at;
        // Notes are of the last tick before them.
        let mut records = room.take_restorable(changed);
        if changed {
            (*noted, *note_at) = (now, tick + limits::STATE_NOTES_EVERY_TICKS);
            records.push(notes(&self.info, room, admission));
        }
        (!records.is_empty()).then(|| Job::Append(Arc::clone(room_file), records))
    }

    fn begin_file(&mut self, room: &mut Room, admission: &Admission, now: Instant) {
        let (room_file, job) = self.new_file(room, admission);
        let (first_tick, noted) = (room.game().tick_count(), revision(room, admission));
        let note_at = first_tick + limits::STATE_NOTES_EVERY_TICKS;
        self.phase = Phase::On { room_file, first_tick, noted, note_at };
        self.hand_over(job, room, now);
    }

    /// A new file with the room as it is, and the job that writes it.
    fn new_file(&mut self, room: &mut Room, admission: &Admission) -> (Arc<RoomFile>, Job) {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
        room.record_for_restoring(env!("CARGO_PKG_VERSION"), unix.as_secs());
        let mut records = room.take_restorable(false);
        records.push(notes(&self.info, room, admission));
        let file = room_file(&self.info);
        let job = Job::Begin(Arc::clone(&file), records);
        (file, job)
    }

    fn hand_over(&mut self, job: Job, room: &Room, now: Instant) {
        if !self.writer.try_send(job) {
            warn!(
                room = room.code(),
                retry_s = limits::STATE_RETRY.as_secs(),
                "what keeps the rooms is too slow to keep this one; the game goes on"
            );
            self.phase = Phase::Off { retry_at: now + limits::STATE_RETRY };
        }
    }
}

fn notes(info: &RoomInfo, room: &Room, admission: &Admission) -> Record {
    let RoomInfo { number, private, creator, guest, .. } = *info;
    let (members, admission) = (room.saved_members(), admission.clone());
    let notes = Notes { number, private, creator, guest, members, admission };
    Record::Host(serde_json::to_vec(&notes).expect("notes hold numbers, names and addresses"))
}

/// The file of a room, as jobs name it.
pub fn room_file(info: &RoomInfo) -> Arc<RoomFile> {
    let file = RoomFile::new(info.code.clone(), info.number);
    Arc::new(RoomFile { room_given_up: info.given_up.clone(), ..file })
}

fn revision(room: &Room, admission: &Admission) -> Revision {
    (room.members_revision(), admission.revision())
}

#[cfg(test)]
mod tests;
