//! Recording on a server: each room has a [`Tape`], which hands its records to the one writer thread
//! over a bounded queue and never waits for it. The [`Shelf`] is the directory as others may see it.
//! Whatever goes wrong here ends in the log and in [`Counters`]; the games go on.

mod name;
mod shelf;
mod tape;
mod writer;

pub use name::{calendar, is_name};
pub use shelf::{Entry, Readable, Refused, Shelf};
pub use tape::Tape;

use crate::limits;
use jostle_protocol::replay::Record;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};
use writer::Writer;

/// Makes a new file, and fails if there is one of that name.
pub type Create = fn(&Path) -> io::Result<Box<dyn Write + Send>>;

/// Where replays go, and how many.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The directory; it is made if it is missing.
    pub dir: PathBuf,
    /// Bytes of all replays in it. The oldest are deleted first.
    pub bytes_max: u64,
    /// How long a replay is kept.
    pub age_max: Duration,
    /// [`limits::REPLAY_FILE_TICKS_MAX`]; tests shorten it.
    pub file_ticks_max: u32,
    /// [`limits::REPLAY_RETRY`]; tests shorten it.
    pub retry: Duration,
    /// [`limits::REPLAY_LOOK_EVERY`]; tests shorten it.
    pub look_every: Duration,
    /// How files are made; tests have some that fail.
    pub create: Create,
    /// The wall clock; tests have one that steps.
    pub wall: fn() -> SystemTime,
}

impl Settings {
    /// The usual limits for a directory.
    pub fn new(dir: PathBuf) -> Settings {
        Settings {
            dir,
            bytes_max: u64::from(limits::REPLAYS_MB) << 20,
            age_max: days(limits::REPLAYS_DAYS),
            file_ticks_max: limits::REPLAY_FILE_TICKS_MAX,
            retry: limits::REPLAY_RETRY,
            look_every: limits::REPLAY_LOOK_EVERY,
            create: create_file,
            wall: SystemTime::now,
        }
    }
}

/// A span of whole days.
pub fn days(count: u32) -> Duration {
    Duration::from_secs(u64::from(count) * 24 * 60 * 60)
}

/// Unbuffered, so that what was written is there even if the process is killed.
fn create_file(path: &Path) -> io::Result<Box<dyn Write + Send>> {
    Ok(Box::new(File::options().write(true).create_new(true).open(path)?))
}

/// What happened so far.
#[derive(Debug, Default)]
pub struct Counters {
    /// Files begun.
    pub files: AtomicU64,
    /// Bytes written.
    pub bytes: AtomicU64,
    /// Records that the writer had no room for.
    pub dropped: AtomicU64,
    /// Files that could not be made, written or deleted.
    pub errors: AtomicU64,
}

impl Counters {
    /// Files, bytes, dropped and errors.
    pub fn read(&self) -> [u64; 4] {
        [&self.files, &self.bytes, &self.dropped, &self.errors]
            .map(|counter| counter.load(Ordering::Relaxed))
    }
}

/// One file, as the room and the writer both know it.
#[derive(Debug, Default)]
struct Reel {
    /// Bytes written.
    bytes: AtomicU64,
    /// The writer gave it up.
    failed: AtomicBool,
    /// The room gave it up; no records come any more.
    left: AtomicBool,
}

/// Records of one file for the writer, in order. The first one of a file is its start record.
struct Batch {
    reel: Arc<Reel>,
    records: Vec<Record>,
    /// Whether the file ends with them.
    is_last: bool,
    /// Bytes that they take in memory.
    weight: usize,
}

/// What the writer is asked for.
enum Job {
    Write(Batch),
    Close,
}

/// The way to the writer. Tapes share it.
pub struct Recording {
    shelf: Arc<Shelf>,
    queue: SyncSender<Job>,
    /// Bytes of records on the way.
    waiting_bytes: Arc<AtomicUsize>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Recording {
    /// Starts the writer.
    pub fn start(settings: Settings) -> io::Result<Arc<Recording>> {
        let shelf = Arc::new(Shelf::new(settings));
        let (queue, jobs) = sync_channel(limits::REPLAY_QUEUE_MAX);
        let waiting_bytes = Arc::new(AtomicUsize::new(0));
        let writer = Writer::new(Arc::clone(&shelf), jobs, Arc::clone(&waiting_bytes));
        let thread = std::thread::Builder::new().name("replays".to_owned());
        let thread = Mutex::new(Some(thread.spawn(move || writer.run())?));
        Ok(Arc::new(Recording { shelf, queue, waiting_bytes, thread }))
    }

    /// The replays.
    pub fn shelf(&self) -> &Arc<Shelf> {
        &self.shelf
    }

    /// Waits until everything that was handed over is written, and ends the writer.
    pub fn close(&self) {
        // A writer that is gone has closed already.
        let _ = self.queue.send(Job::Close);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            // One that panicked has told so.
            let _ = thread.join();
        }
    }

    /// Hands records over, or counts them as dropped and returns why.
    fn send(
        &self,
        reel: &Arc<Reel>,
        records: Vec<Record>,
        is_last: bool,
    ) -> Result<(), &'static str> {
        let count = records.len() as u64;
        let weight = records.iter().map(weight).sum();
        let waiting = self.waiting_bytes.fetch_add(weight, Ordering::Relaxed);
        let batch = Batch { reel: Arc::clone(reel), records, is_last, weight };
        let sent = match waiting + weight > limits::REPLAY_QUEUE_BYTES_MAX {
            true => Err("too many bytes wait for the disk"),
            false => self.queue.try_send(Job::Write(batch)).map_err(|_| "the writer is behind"),
        };
        if sent.is_err() {
            self.waiting_bytes.fetch_sub(weight, Ordering::Relaxed);
            self.shelf.counters().dropped.fetch_add(count, Ordering::Relaxed);
        }
        sent
    }
}

/// About what a record takes in memory, bytes.
fn weight(record: &Record) -> usize {
    match record {
        Record::Start(start) => start.scene.len(),
        Record::Keyframe(keyframe) => keyframe.state.len(),
        Record::Ticks(block) => {
            block.ticks.iter().map(|tick| size_of_val(tick) + size_of_val(&tick.inputs[..])).sum()
        }
        Record::End { .. } => 0,
    }
}

#[cfg(test)]
mod tests;
