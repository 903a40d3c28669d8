//! The thread that writes for all readers that have files on a disk.

use super::reader::{LogReader, Sink};
use super::store::ReplayStore;
use crate::limits;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval at which the writer reads the rooms' logs.
const LOG_READ_EVERY: Duration = Duration::from_millis(50);

/// A handle to the writer's thread.
pub struct LogWriter {
    tasks: SyncSender<WriterTask>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

enum WriterTask {
    Read(LogReader, Box<dyn Sink>),
    /// Work that does not belong to any reader, such as a clip.
    Once(Box<dyn FnOnce() + Send>),
    Close,
}

impl LogWriter {
    /// Starts the writer for at most `rooms` rooms. It regularly scans the replay directory, if there is one.
    pub fn start(rooms: usize, replays: Option<Arc<ReplayStore>>) -> io::Result<LogWriter> {
        let (tasks, receiver) = sync_channel(2 * rooms + limits::CLIPS_WAITING_MAX);
        let thread = std::thread::Builder::new().name("log".to_owned());
        let thread = thread.spawn(move || run(&receiver, replays.as_deref()))?;
        Ok(LogWriter { tasks, thread: Mutex::new(Some(thread)) })
    }

    /// Lets the thread write for a reader until the reader's room has ended. If the disk has been blocked while
    /// hundreds of rooms came and went, the reader is refused.
    pub fn read(&self, reader: LogReader, sink: impl Sink + 'static) {
        let policy = Arc::clone(&reader.policy);
        if self.tasks.try_send(WriterTask::Read(reader, Box::new(sink))).is_err() {
            policy.too_slow();
        }
    }

    /// Lets the thread do some work once. Returns false if its queue is full.
    pub fn once(&self, work: impl FnOnce() + Send + 'static) -> bool {
        self.tasks.try_send(WriterTask::Once(Box::new(work))).is_ok()
    }

    /// Waits until everything in the rooms' shared logs has been written, and then ends the thread.
    pub fn close(&self) {
        // If the writer is gone, it has already closed.
        let _ = self.tasks.send(WriterTask::Close);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        // If the thread panicked, that has already been logged.
        let _ = thread.map(JoinHandle::join);
    }
}

fn run(tasks: &Receiver<WriterTask>, replays: Option<&ReplayStore>) {
    let mut readers = Readers::default();
    let look_every = replays.map_or(Duration::MAX, |store| store.settings().look_every);
    let (mut look_at, mut sync_at) = (Some(Instant::now()), Instant::now());
    loop {
        let now = Instant::now();
        if look_at.is_some_and(|at| now >= at) {
            replays.inspect(|store| store.look_now());
            look_at = now.checked_add(look_every);
        }
        readers.step(now);
        if now >= sync_at {
            readers.sync(now);
            sync_at = now + limits::STATE_SYNC_EVERY;
        }
        match tasks.recv_timeout(LOG_READ_EVERY) {
            Ok(WriterTask::Read(reader, sink)) => readers.add(reader, sink),
            Ok(WriterTask::Once(work)) => work(),
            Err(RecvTimeoutError::Timeout) => {}
            Ok(WriterTask::Close) | Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    readers.step(Instant::now());
    readers.sync(Instant::now());
}

/// Readers with their sinks.
#[derive(Default)]
pub struct Readers(Vec<Writing>);

struct Writing {
    reader: LogReader,
    sink: Box<dyn Sink>,
    /// Whether anything has been written since the last sync.
    is_dirty: bool,
}

impl Readers {
    pub fn add(&mut self, reader: LogReader, sink: Box<dyn Sink>) {
        self.0.push(Writing { reader, sink, is_dirty: false });
    }

    /// Writes all available blocks, and drops the readers of rooms that have ended.
    pub fn step(&mut self, now: Instant) {
        self.0.retain_mut(|Writing { reader, sink, is_dirty }| {
            while reader.step(&mut **sink, now) {
                *is_dirty = true;
            }
            !reader.is_finished
        });
    }

    /// Syncs the written files to the disk.
    pub fn sync(&mut self, now: Instant) {
        for Writing { reader, sink, is_dirty } in &mut self.0 {
            if std::mem::take(is_dirty)
                && let Err(error) = sink.sync()
            {
                reader.failed(&error, now);
            }
        }
    }
}
