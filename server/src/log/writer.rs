//! The thread that writes for all readers whose files are on a disk.

use super::reader::{LogReader, Sink};
use super::store::ReplayStore;
use crate::limits;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time after which the writer of the rooms' logs looks for something new.
const LOG_READ_EVERY: Duration = Duration::from_millis(50);

/// The writer's thread as others see it.
pub struct LogWriter {
    tasks: SyncSender<WriterTask>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

enum WriterTask {
    Read(LogReader, Box<dyn Sink>),
    /// Work that is no reader's: a clip.
    Once(Box<dyn FnOnce() + Send>),
    Close,
}

impl LogWriter {
    /// Starts the writer of at most `rooms`. It looks at the replays, if there are any, once in a while.
    pub fn start(rooms: usize, replays: Option<Arc<ReplayStore>>) -> io::Result<LogWriter> {
        let (tasks, receiver) = sync_channel(2 * rooms + limits::CLIPS_WAITING_MAX);
        let thread = std::thread::Builder::new().name("log".to_owned());
        let thread = thread.spawn(move || run(&receiver, replays.as_deref()))?;
        Ok(LogWriter { tasks, thread: Mutex::new(Some(thread)) })
    }

    /// Has the thread write for a reader, until its room has ended. If the disk has stood still while hundreds of rooms came
    /// and went, there is no place for one more.
    pub fn read(&self, reader: LogReader, sink: impl Sink + 'static) {
        let policy = Arc::clone(&reader.policy);
        if self.tasks.try_send(WriterTask::Read(reader, Box::new(sink))).is_err() {
            policy.too_slow();
        }
    }

    /// Has the thread do something once. Returns false if it has no place for that.
    pub fn once(&self, work: impl FnOnce() + Send + 'static) -> bool {
        self.tasks.try_send(WriterTask::Once(Box::new(work))).is_ok()
    }

    /// Waits until everything that is in the shares of rooms is written, and ends the thread.
    pub fn close(&self) {
        // A writer that is gone has closed already.
        let _ = self.tasks.send(WriterTask::Close);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        // One that panicked has logged it.
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
    /// Whether something was written that is not synced.
    is_dirty: bool,
}

impl Readers {
    pub fn add(&mut self, reader: LogReader, sink: Box<dyn Sink>) {
        self.0.push(Writing { reader, sink, is_dirty: false });
    }

    /// Writes all that is there, and forgets the readers of rooms that have ended.
    pub fn step(&mut self, now: Instant) {
        self.0.retain_mut(|Writing { reader, sink, is_dirty }| {
            while reader.step(&mut **sink, now) {
                *is_dirty = true;
            }
            !reader.is_finished
        });
    }

    /// Syncs with the disk what was written.
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
