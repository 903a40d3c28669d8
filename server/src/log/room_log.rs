//! A room's log on the room's thread. After the room's ticks, new blocks go to readers on other threads.

use super::logs::Logs;
use super::reader::{Seal, SharedLog};
use super::restore::HostNotes;
use crate::host::admission::Admission;
use crate::limits;
use jostle_protocol::replay::Record;
use jostle_room::Room;
use std::sync::Arc;

/// Feeds the readers of a room's log, without waiting.
pub struct RoomLog {
    /// The facts about the room, for its notes.
    about: HostNotes,
    /// `None` if no log is kept for the room.
    shared: Option<Arc<SharedLog>>,
    /// Whether the log has any notes about the players and their seats.
    has_notes: bool,
    /// The newest keyframe that is followed by notes, and the revision of the notes' contents.
    noted: (Option<u64>, Revision),
    /// The tick from which further notes are allowed.
    note_at: u32,
    is_recorded: bool,
    /// The position up to which blocks have been given to the readers.
    held: u64,
}

/// Revisions of the notes' contents.
type Revision = (u64, u64);

impl RoomLog {
    /// Begins a room's log in `shared`, where its readers find it.
    pub fn begin(
        logs: &Logs,
        shared: Option<Arc<SharedLog>>,
        about: HostNotes,
        room: &mut Room,
        admission: &Admission,
    ) -> RoomLog {
        if shared.is_some() {
            room.keep_clips(env!("CARGO_PKG_VERSION"));
        }
        let (has_notes, noted) = (logs.keeps_rooms(), (None, (0, 0)));
        let (note_at, is_recorded, held) = (0, true, 0);
        let mut log = RoomLog { about, shared, has_notes, noted, note_at, is_recorded, held };
        log.after_ticks(room, admission, false);
        log
    }

    /// Feeds new blocks to the readers. If the room is `empty`, its replay ends, and the next player begins a new one.
    pub fn after_ticks(&mut self, room: &mut Room, admission: &Admission, empty: bool) {
        let Some(shared) = &self.shared else { return };
        if std::mem::replace(&mut self.is_recorded, !empty) == empty {
            match empty {
                true => room.end_log(),
                false => room.log_keyframe(),
            }
        }
        if self.has_notes {
            let keyframe = room.log().and_then(|log| log.blocks().newest_keyframe());
            let (revision, tick) = (revision(room, admission), room.game().tick_count());
            let is_due = self.noted.1 != revision && tick >= self.note_at;
            if is_due || self.noted.0 != keyframe {
                room.log_notes(notes(&self.about, room, admission));
                self.noted = (keyframe, revision);
                self.note_at = tick + limits::STATE_NOTES_EVERY_TICKS;
            }
        }
        let Some(blocks) = room.log().map(|log| log.blocks()) else { return };
        if std::mem::replace(&mut self.held, blocks.end()) != blocks.end() {
            shared.publish(blocks.clone(), self.is_recorded);
        }
    }

    /// Ends a room's log, and seals its state with `seal`. If the game is not `whole`, the replay has no end record; a
    /// tick that failed halfway is omitted. If the state is kept, it ends with a keyframe, from which the room is
    /// restored without replaying any ticks.
    pub fn end(mut self, room: &mut Room, admission: &Admission, whole: bool, seal: Seal) {
        if whole {
            room.end_log();
        } else {
            room.flush_log();
        }
        if seal == Seal::Keep {
            room.log_keyframe();
        }
        let is_recorded = self.is_recorded;
        self.has_notes &= seal == Seal::Keep;
        self.after_ticks(room, admission, !is_recorded);
        self.shared.inspect(|shared| shared.seal(seal));
    }
}

fn notes(about: &HostNotes, room: &Room, admission: &Admission) -> Record {
    let (members, admission) = (room.saved_members(), admission.clone());
    let notes = HostNotes { members, admission, ..about.clone() };
    Record::Host(serde_json::to_vec(&notes).expect("notes hold numbers, names and addresses"))
}

fn revision(room: &Room, admission: &Admission) -> Revision {
    (room.members_revision(), admission.revision())
}
