//! The queue from the rooms to the writer.

use jostle_protocol::ClipRefusal;
use jostle_protocol::replay::Record;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// State of one file, shared by its room and the writer.
#[derive(Debug, Default)]
pub struct RecordingFile {
    pub bytes: AtomicU64,
    /// Whether the writer gave it up.
    pub failed: AtomicBool,
    /// Whether the room gave it up and sends no more records.
    pub left: AtomicBool,
}

/// Records of one file for the writer, in order. The first one of a file is its start record.
pub struct Batch {
    pub recording_file: Arc<RecordingFile>,
    pub records: Vec<Record>,
    /// Whether the file ends with them.
    pub is_last: bool,
    /// Bytes that they take in memory.
    pub memory_bytes: usize,
}

/// A clip to keep.
pub struct ClipJob {
    /// A replay that ends with the clip.
    pub records: Vec<Record>,
    /// Whether lists show it.
    pub listed: bool,
    /// The network that asked for it, if it is known.
    pub asked_by: Option<IpAddr>,
    /// Bytes that the records take in memory.
    pub memory_bytes: usize,
    /// Is told the name of the clip, or why there is none.
    pub answer: Box<dyn FnOnce(Result<String, ClipRefusal>) + Send>,
}

/// A job of the writer.
pub enum Job {
    Write(Batch),
    /// A clip to cut and keep.
    Clip(ClipJob),
    /// Finish all files, and end the thread.
    Close,
}

/// Approximate size of a record in memory.
pub fn memory_bytes(record: &Record) -> usize {
    match record {
        Record::Start(start) => start.scene.len(),
        Record::Keyframe(keyframe) => keyframe.state.len(),
        Record::Ticks(block) => {
            block.ticks.iter().map(|tick| size_of_val(tick) + size_of_val(&tick.inputs[..])).sum()
        }
        Record::End { .. } => 0,
        Record::Host(notes) => notes.len(),
    }
}
