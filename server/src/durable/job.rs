//! Jobs of the rooms for the writer of their files.

use jostle_protocol::replay::Record;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// One room's file, shared by the room and the writer.
#[derive(Debug)]
pub struct RoomFile {
    /// The room's code.
    pub code: String,
    /// Tells the room from another one with this code.
    pub number: u64,
    /// Whether the writer gave it up.
    pub failed: AtomicBool,
}

/// A job of the writer. Those of one room are done in order.
pub enum Job {
    /// Begins a new file with these records, and puts it in the place of the old one.
    Begin(Arc<RoomFile>, Vec<Record>),
    /// Appends records.
    Append(Arc<RoomFile>, Vec<Record>),
    /// Syncs the file with the disk and closes it: the server ends, and the room is to be restored.
    Close(Arc<RoomFile>),
    /// Removes the file: the room is over.
    Remove(Arc<RoomFile>),
    /// Ends the writer.
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
