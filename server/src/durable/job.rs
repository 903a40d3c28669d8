//! Jobs of the rooms for the writer of their files.

use jostle_protocol::replay::Record;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tokio_util::sync::CancellationToken;

/// One room's file, shared by the room and the writer.
#[derive(Debug)]
pub struct RoomFile {
    pub code: String,
    /// Tells the room from another one with this code.
    pub number: u64,
    /// Whether the writer gave it up.
    pub failed: AtomicBool,
    /// Cancelled once the room is given up: its code may be another room's, whose file it must not replace.
    pub room_given_up: CancellationToken,
}

impl RoomFile {
    /// The file of a room that is never given up.
    pub fn new(code: String, number: u64) -> RoomFile {
        let (failed, room_given_up) = (AtomicBool::new(false), CancellationToken::new());
        RoomFile { code, number, failed, room_given_up }
    }
}

/// A job of the writer. Those of one room are done in order.
pub enum Job {
    /// Begins a new file with these records, and puts it in the place of the old one.
    Begin(Arc<RoomFile>, Vec<Record>),
    Append(Arc<RoomFile>, Vec<Record>),
    /// Syncs the file with the disk and closes it: the server ends, and the room is to be restored.
    Close(Arc<RoomFile>),
    /// Removes the file: the room is over.
    Remove(Arc<RoomFile>),
    End,
}

impl Job {
    /// The file that it is for.
    pub fn room_file(&self) -> Option<&Arc<RoomFile>> {
        match self {
            Job::Begin(file, _) | Job::Append(file, _) | Job::Close(file) | Job::Remove(file) => {
                Some(file)
            }
            Job::End => None,
        }
    }
}
