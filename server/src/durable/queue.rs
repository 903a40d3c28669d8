//! The queue from the rooms to the writer of their files.

use super::dir::{StateDir, StateSettings};
use super::job::Job;
use super::restore::SavedRoom;
use super::sink::{RecordKeeper, RecordSink};
use super::writer::Writer;
use crate::limits;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// The thread that writes the files of all rooms, as the rooms see it.
pub struct StateWriter {
    dir: Arc<StateDir>,
    queue: SyncSender<Job>,
    thread: Mutex<Option<JoinHandle<()>>>,
    /// Files that were given up, or set aside.
    errors: Arc<AtomicU64>,
}

impl StateWriter {
    /// Opens the directory and starts the writer for at most `rooms`. See [`StateDir::open`] for the errors.
    pub fn start(settings: &StateSettings, rooms: usize) -> io::Result<Arc<StateWriter>> {
        let dir = Arc::new(StateDir::open(&settings.dir)?);
        let (queue, jobs) = sync_channel(rooms * limits::STATE_JOBS_PER_ROOM);
        let errors = Arc::new(AtomicU64::new(0));
        let writer = Writer::new(Arc::clone(&dir), settings.sync, Arc::clone(&errors));
        let thread = std::thread::Builder::new().name("state".to_owned());
        let thread = Mutex::new(Some(thread.spawn(move || writer.run(&jobs))?));
        Ok(Arc::new(StateWriter { dir, queue, thread, errors }))
    }

    pub fn dir(&self) -> &StateDir {
        &self.dir
    }

    /// The rooms that were open when the last process ended. Files that cannot be read are set aside, and logged.
    pub fn saved_rooms(&self) -> io::Result<Vec<SavedRoom>> {
        let files = self.dir.rooms()?;
        Ok(files.into_iter().filter_map(|(code, path)| self.read(code, &path)).collect())
    }

    fn read(&self, code: String, path: &std::path::Path) -> Option<SavedRoom> {
        match SavedRoom::read(code.clone(), path) {
            Ok(saved) => Some(saved),
            Err(error) => {
                self.set_aside(&code, &error);
                None
            }
        }
    }
}

impl RecordSink for StateWriter {
    fn try_send(&self, job: Job) -> bool {
        match self.queue.try_send(job) {
            Ok(()) => true,
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.errors.fetch_add(1, Ordering::Relaxed);
                false
            }
        }
    }

    fn send(&self, job: Job) {
        // A writer that is gone has logged why.
        let _ = self.queue.send(job);
    }

    fn set_aside(&self, code: &str, reason: &str) {
        self.errors.fetch_add(1, Ordering::Relaxed);
        let to = match self.dir.set_aside(code) {
            Ok(path) => path.display().to_string(),
            Err(error) => format!("nowhere ({error})"),
        };
        tracing::error!(room = %code, reason, file = %to, "a room cannot be restored; its file was set aside");
    }

    fn give_up(&self, code: &str, reason: &str) {
        self.set_aside(code, reason);
    }
}

impl RecordKeeper for StateWriter {
    fn common_sink(self: Arc<Self>) -> Option<Arc<dyn RecordSink>> {
        Some(self)
    }

    fn errors(&self) -> u64 {
        self.errors.load(Ordering::Relaxed)
    }

    /// Waits until everything is written and synced.
    fn close(&self) {
        self.send(Job::End);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            // One that panicked has logged it.
            let _ = thread.join();
        }
    }
}
