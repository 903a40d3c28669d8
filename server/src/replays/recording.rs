//! The writer's thread as the rooms see it.

use super::queue::{Batch, ClipJob, Job, RecordingFile, memory_bytes};
use super::settings::Settings;
use super::store::ReplayStore;
use super::writer::Writer;
use crate::host::random::random;
use crate::limits;
use crate::limits::address_rate_limiter::AddressRateLimiter;
use crate::limits::networks::widest;
use jostle_protocol::ClipRefusal;
use jostle_protocol::replay::Record;
use std::io;
use std::net::IpAddr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, UNIX_EPOCH};

/// The queue to the writer, shared by all [`super::RoomRecording`]s.
pub struct Recording {
    pub(super) store: Arc<ReplayStore>,
    pub(super) queue: SyncSender<Job>,
    /// Bytes of records in the queue.
    pub(super) waiting_bytes: Arc<AtomicUsize>,
    /// Clips that wait, or are being cut.
    pub(super) waiting_clips: Arc<AtomicUsize>,
    /// Limits on how many clips each address asks for.
    pub(super) clip_rates: Mutex<AddressRateLimiter>,
    pub(super) thread: Mutex<Option<JoinHandle<()>>>,
}

/// The clips of each address, for all rooms of a server.
pub(super) fn clip_rates() -> AddressRateLimiter {
    let per_second = f64::from(limits::ADDRESS_CLIPS_PER_MINUTE_MAX) / 60.0;
    AddressRateLimiter::new(per_second, limits::ADDRESS_CLIPS_PER_MINUTE_MAX as usize)
}

impl Recording {
    /// Starts the writer of the recordings of at most `rooms`.
    pub fn start(settings: Settings, rooms: usize) -> io::Result<Arc<Recording>> {
        let store = Arc::new(ReplayStore::new(settings));
        let (queue, jobs) = sync_channel(rooms * limits::REPLAY_BATCHES_PER_ROOM);
        let waiting_bytes = Arc::new(AtomicUsize::new(0));
        let writer = Writer::new(Arc::clone(&store), jobs, Arc::clone(&waiting_bytes));
        let thread = std::thread::Builder::new().name("replays".to_owned());
        let thread = Mutex::new(Some(thread.spawn(move || writer.run())?));
        let waiting_clips = Arc::default();
        let clip_rates = Mutex::new(clip_rates());
        Ok(Arc::new(Recording { store, queue, waiting_bytes, waiting_clips, clip_rates, thread }))
    }

    pub fn store(&self) -> &ReplayStore {
        &self.store
    }

    /// Seconds since 1970.
    pub fn unix_s(&self) -> u64 {
        let wall = (self.store.settings().wall)();
        wall.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs()
    }

    /// Waits until everything that was handed over is written, and ends the writer.
    pub fn close(&self) {
        // A writer that is gone has closed already.
        let _ = self.queue.send(Job::Close);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            // One that panicked has logged it.
            let _ = thread.join();
        }
    }

    /// Queues records, or counts them as dropped and returns the reason.
    pub(super) fn send(
        &self,
        recording_file: &Arc<RecordingFile>,
        records: Vec<Record>,
        is_last: bool,
    ) -> Result<(), &'static str> {
        let count = records.len() as u64;
        let bytes = records.iter().map(memory_bytes).sum();
        let batch = Batch {
            recording_file: Arc::clone(recording_file),
            records,
            is_last,
            memory_bytes: bytes,
        };
        let sent = self.queue(Job::Write(batch), bytes);
        if sent.is_err() {
            self.store.counters().dropped.fetch_add(count, Ordering::Relaxed);
        }
        sent
    }

    /// Counts a clip that a client of this address asks for; `false` if there were too many in all rooms.
    pub fn admit_clip(&self, address: IpAddr, now: Instant) -> bool {
        self.clip_rates.lock().unwrap_or_else(PoisonError::into_inner).admit(address, now)
    }

    /// Has a clip cut out of these records and kept. The answer comes from the writer's thread, or at once if it has too
    /// much to do. A clip that is not listed is a private room's: its name and its file do not tell the room's code, which
    /// lets in whom it is shown.
    pub fn keep_clip(
        &self,
        mut records: Vec<Record>,
        listed: bool,
        asked_by: Option<IpAddr>,
        answer: impl Fn(Result<String, ClipRefusal>) + Clone + Send + 'static,
    ) {
        let waiting = Arc::clone(&self.waiting_clips);
        if waiting.fetch_add(1, Ordering::Relaxed) >= limits::CLIPS_WAITING_MAX {
            waiting.fetch_sub(1, Ordering::Relaxed);
            return answer(Err(ClipRefusal::TooMany));
        }
        let answer = move |kept| {
            waiting.fetch_sub(1, Ordering::Relaxed);
            answer(kept);
        };
        if let Some(Record::Start(start)) = records.first_mut().filter(|_| !listed) {
            start.room = format!("{:016x}", random());
        }
        let memory_bytes = records.iter().map(memory_bytes).sum();
        let asked_by = asked_by.map(widest);
        let answered = Box::new(answer.clone());
        let job = ClipJob { records, listed, asked_by, memory_bytes, answer: answered };
        if self.queue(Job::Clip(job), memory_bytes).is_err() {
            answer(Err(ClipRefusal::Failed));
        }
    }

    fn queue(&self, job: Job, bytes: usize) -> Result<(), &'static str> {
        let waiting = self.waiting_bytes.fetch_add(bytes, Ordering::Relaxed);
        let sent = match waiting + bytes > limits::REPLAY_QUEUE_BYTES_MAX {
            true => Err("too many bytes wait for the disk"),
            false => self.queue.try_send(job).map_err(|_| "the writer is behind"),
        };
        if sent.is_err() {
            self.waiting_bytes.fetch_sub(bytes, Ordering::Relaxed);
        }
        sent
    }
}
