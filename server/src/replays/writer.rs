//! The thread that writes all replays: it packs records and appends them, one file a room. An error
//! truncates one file; the first of consecutive errors is logged, the others are counted.

use super::queue::{Batch, ClipJob, Job, RecordingFile};
use super::store::ReplayStore;
use jostle_protocol::ClipRefusal;
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::{PlayerCount, Record, Replay, Start, header};
use jostle_room::clip::{CLIP_TICKS, cut};
use std::error::Error;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Instant, SystemTime};
use tracing::{error, info};

/// State of the writer's thread.
pub struct Writer {
    store: Arc<ReplayStore>,
    jobs: Receiver<Job>,
    waiting_bytes: Arc<AtomicUsize>,
    open: Vec<Open>,
    /// Whether the last attempt failed, which was logged.
    is_failing: bool,
    /// Counters as last logged.
    logged: [u64; 4],
    clock: Clock,
}

/// The wall clock at the start of the writer, advanced by a monotonic clock: when the wall clock is set
/// forward, no replay is suddenly too old. Files stamped after it was set back would be, so the earlier of
/// the two times counts.
pub struct Clock {
    began: Instant,
    wall: SystemTime,
}

impl Clock {
    /// A clock that starts with these two times.
    pub fn new(began: Instant, wall: SystemTime) -> Clock {
        Clock { began, wall }
    }

    /// The time at `now`, when the wall clock reads `wall`.
    pub fn time(&self, now: Instant, wall: SystemTime) -> SystemTime {
        wall.min(self.wall + now.saturating_duration_since(self.began))
    }
}

/// A file that is being written.
struct Open {
    recording_file: Arc<RecordingFile>,
    name: String,
    file: Box<dyn Write + Send>,
    /// Whether a player sent an input; a file without any is of no use.
    has_inputs: bool,
    players: PlayerCount,
}

impl Writer {
    /// Creates a writer without open files.
    pub fn new(
        store: Arc<ReplayStore>,
        jobs: Receiver<Job>,
        waiting_bytes: Arc<AtomicUsize>,
    ) -> Writer {
        let (open, is_failing, logged) = (Vec::new(), false, [0; 4]);
        let clock = Clock::new(Instant::now(), (store.settings().wall)());
        Writer { store, jobs, waiting_bytes, open, is_failing, logged, clock }
    }

    /// Writes until it is told to close or the queue is dropped.
    pub fn run(mut self) {
        info!(dir = %self.store.settings().dir.display(), "rooms are recorded");
        let mut look_at = Instant::now();
        loop {
            if Instant::now() >= look_at {
                self.look();
                look_at = Instant::now() + self.store.settings().look_every;
            }
            match self.jobs.recv_timeout(look_at.saturating_duration_since(Instant::now())) {
                Ok(Job::Write(batch)) => self.write(batch),
                Ok(Job::Clip(job)) => self.keep_clip(job),
                Err(RecvTimeoutError::Timeout) => {}
                Ok(Job::Close) | Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        for open in std::mem::take(&mut self.open) {
            self.finish(open);
        }
        self.log_counters("recording ended");
    }

    fn write(&mut self, batch: Batch) {
        self.waiting_bytes.fetch_sub(batch.memory_bytes, Ordering::Relaxed);
        for record in &batch.records {
            if let Err((path, error)) = self.append(&batch.recording_file, record) {
                return self.fail(&batch.recording_file, &path, &error);
            }
        }
        if batch.is_last
            && let Some(at) = self.position(&batch.recording_file)
        {
            let open = self.open.swap_remove(at);
            self.finish(open);
        }
    }

    fn keep_clip(&mut self, job: ClipJob) {
        self.waiting_bytes.fetch_sub(job.memory_bytes, Ordering::Relaxed);
        let kept = clip(&job.records).map_err(io::Error::other).and_then(|(start, bytes)| {
            self.store.keep_clip(&start, job.listed, job.asked_by, &bytes)
        });
        let kept = kept.map_err(|error| {
            self.count_error(&self.store.settings().dir.clone(), &error);
            ClipRefusal::Failed
        });
        (job.answer)(kept);
    }

    fn position(&self, recording_file: &Arc<RecordingFile>) -> Option<usize> {
        self.open.iter().position(|open| Arc::ptr_eq(&open.recording_file, recording_file))
    }

    /// Appends a record to its file, or names the file and what is wrong with it. Records of a file
    /// that was given up are passed over.
    fn append(
        &mut self,
        recording_file: &Arc<RecordingFile>,
        record: &Record,
    ) -> Result<(), (PathBuf, io::Error)> {
        let mut bytes = record.seal();
        if let Record::Start(start) = record {
            self.begin(recording_file, start)
                .map_err(|error| (self.store.settings().dir.clone(), error))?;
            bytes.splice(..0, header());
        }
        let Some(at) = self.position(recording_file) else { return Ok(()) };
        let open = &mut self.open[at];
        let count = bytes.len() as u64;
        let written = fits(recording_file, count)
            .and_then(|()| self.store.make_room(&open.name, count))
            .and_then(|()| open.file.write_all(&bytes));
        written.map_err(|error| (self.store.path(&open.name), error))?;
        recording_file.bytes.fetch_add(count, Ordering::Relaxed);
        let last_tick = match record {
            Record::Ticks(block) => Some(block.first + block.ticks.len() as u32 - 1),
            _ => None,
        };
        open.players.note(record);
        self.store.grow(&open.name, count, last_tick, open.players.most);
        self.store.counters().bytes.fetch_add(count, Ordering::Relaxed);
        if let Record::Ticks(block) = record {
            open.has_inputs |= block.ticks.iter().any(|tick| !tick.inputs.is_empty());
            self.succeed();
        }
        Ok(())
    }

    fn begin(&mut self, recording_file: &Arc<RecordingFile>, start: &Start) -> io::Result<()> {
        let (name, file) = self.store.create(start)?;
        self.store.counters().files.fetch_add(1, Ordering::Relaxed);
        self.open.push(Open {
            recording_file: Arc::clone(recording_file),
            name,
            file,
            has_inputs: false,
            players: PlayerCount::default(),
        });
        Ok(())
    }

    fn finish(&mut self, mut open: Open) {
        if let Err(error) = open.file.flush() {
            self.count_error(&self.store.path(&open.name), &error);
        }
        self.keep(open);
    }

    /// Keeps a file that is no longer written, or deletes it if it has no inputs.
    fn keep(&self, open: Open) {
        let Open { name, file, has_inputs, .. } = open;
        drop(file);
        match has_inputs {
            true => self.store.finish(&name),
            false => self.store.discard(&name),
        }
    }

    /// Gives a file up. The part that was written stays if it has inputs.
    fn fail(&mut self, recording_file: &Arc<RecordingFile>, path: &Path, error: &io::Error) {
        recording_file.failed.store(true, Ordering::Relaxed);
        if let Some(at) = self.position(recording_file) {
            let open = self.open.swap_remove(at);
            self.keep(open);
        }
        self.count_error(path, error);
    }

    fn count_error(&mut self, path: &Path, error: &io::Error) {
        self.store.counters().errors.fetch_add(1, Ordering::Relaxed);
        if !self.is_failing {
            let retry_s = self.store.settings().retry.as_secs();
            error!(
                file = %path.display(), %error, retry_s,
                "CANNOT RECORD: games go on unrecorded, and a new file is tried after each retry time"
            );
        }
        self.is_failing = true;
    }

    fn succeed(&mut self) {
        if self.is_failing {
            info!("recording works again");
        }
        self.is_failing = false;
    }

    /// Scans the directory, finishes files that their rooms gave up, and logs the counters. Runs once a minute.
    fn look(&mut self) {
        let now = self.clock.time(Instant::now(), (self.store.settings().wall)());
        if let Err(error) = self.store.look(now) {
            self.count_error(&self.store.settings().dir.clone(), &error);
        }
        let (left, open): (Vec<_>, Vec<_>) = std::mem::take(&mut self.open)
            .into_iter()
            .partition(|open| open.recording_file.left.load(Ordering::Relaxed));
        self.open = open;
        left.into_iter().for_each(|open| self.finish(open));
        for recording_file in self.removed() {
            let error = io::Error::new(io::ErrorKind::NotFound, "it was removed");
            self.fail(&recording_file, &self.store.settings().dir.clone(), &error);
        }
        self.log_counters("recording");
    }

    /// Open files that were removed from the directory.
    fn removed(&self) -> Vec<Arc<RecordingFile>> {
        let is_gone = |path: &Path| {
            path.symlink_metadata().is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
        };
        let removed = self.open.iter().filter(|open| is_gone(&self.store.path(&open.name)));
        removed.map(|open| Arc::clone(&open.recording_file)).collect()
    }

    /// Logs the counters if they changed.
    fn log_counters(&mut self, message: &str) {
        let counters = self.store.counters().read();
        if counters != self.logged {
            let [files, bytes, dropped, errors] = counters;
            info!(files, bytes, dropped, errors, "{message}");
            self.logged = counters;
        }
    }
}

/// The start of a clip, and its bytes: the last ticks of a replay.
fn clip(records: &[Record]) -> Result<(Start, Vec<u8>), Box<dyn Error + Send + Sync>> {
    let bytes = header().into_iter().chain(records.iter().flat_map(Record::seal)).collect();
    let replay = Replay::read(bytes)?;
    let (start, to) = (replay.start().clone(), replay.last_tick());
    Ok((start, cut(replay, to.saturating_sub(CLIP_TICKS), to)?))
}

/// Fails if a file would grow too large to be read again.
fn fits(recording_file: &RecordingFile, bytes: u64) -> io::Result<()> {
    let bytes = recording_file.bytes.load(Ordering::Relaxed) + bytes;
    match bytes > REPLAY_BYTES_MAX as u64 {
        true => Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("{bytes} bytes"))),
        false => Ok(()),
    }
}
