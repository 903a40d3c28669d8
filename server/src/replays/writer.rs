//! The thread that writes all replays: it packs records and appends them, one file a room. An error
//! costs one file its end; the first of a row of errors is told loudly, the others are counted.

use super::shelf::Shelf;
use super::{Batch, Job, Reel};
use jostle_protocol::limits::REPLAY_BYTES_MAX;
use jostle_protocol::replay::{Record, Start, header};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Instant, SystemTime};
use tracing::{error, info};

/// What the thread works on.
pub struct Writer {
    shelf: Arc<Shelf>,
    jobs: Receiver<Job>,
    waiting_bytes: Arc<AtomicUsize>,
    open: Vec<Open>,
    /// Whether the last thing tried was an error, which was told.
    is_failing: bool,
    /// Counters as they were last told.
    told: [u64; 4],
    clock: Clock,
}

/// The wall clock as it was when the writer began, carried on by one that never steps: when the
/// wall clock is set on, no replay is suddenly too old. What is stamped after it was set back would be, so
/// that the earlier of the two counts.
pub struct Clock {
    began: Instant,
    wall: SystemTime,
}

impl Clock {
    /// A clock that goes by these two from now on.
    pub fn new(began: Instant, wall: SystemTime) -> Clock {
        Clock { began, wall }
    }

    /// The time of `now`, at which the wall clock says `wall`.
    pub fn time(&self, now: Instant, wall: SystemTime) -> SystemTime {
        wall.min(self.wall + now.saturating_duration_since(self.began))
    }
}

/// A file that is being written.
struct Open {
    reel: Arc<Reel>,
    name: String,
    file: Box<dyn Write + Send>,
    /// Whether it holds ticks; a file without any is of no use.
    has_ticks: bool,
}

impl Writer {
    /// No files yet.
    pub fn new(shelf: Arc<Shelf>, jobs: Receiver<Job>, waiting_bytes: Arc<AtomicUsize>) -> Writer {
        let (open, is_failing, told) = (Vec::new(), false, [0; 4]);
        let clock = Clock::new(Instant::now(), (shelf.settings().wall)());
        Writer { shelf, jobs, waiting_bytes, open, is_failing, told, clock }
    }

    /// Writes until it is told to close.
    pub fn run(mut self) {
        info!(dir = %self.shelf.settings().dir.display(), "rooms are recorded");
        let mut look_at = Instant::now();
        loop {
            if Instant::now() >= look_at {
                self.look();
                look_at = Instant::now() + self.shelf.settings().look_every;
            }
            match self.jobs.recv_timeout(look_at.saturating_duration_since(Instant::now())) {
                Ok(Job::Write(batch)) => self.write(batch),
                Err(RecvTimeoutError::Timeout) => {}
                Ok(Job::Close) | Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        for open in std::mem::take(&mut self.open) {
            self.finish(open);
        }
        self.tell("recording ended");
    }

    fn write(&mut self, batch: Batch) {
        self.waiting_bytes.fetch_sub(batch.weight, Ordering::Relaxed);
        for record in &batch.records {
            if let Err((path, error)) = self.append(&batch.reel, record) {
                self.fail(&batch.reel, &path, &error);
                return;
            }
        }
        if batch.is_last
            && let Some(at) = self.place(&batch.reel)
        {
            let open = self.open.swap_remove(at);
            self.finish(open);
        }
    }

    fn place(&self, reel: &Arc<Reel>) -> Option<usize> {
        self.open.iter().position(|open| Arc::ptr_eq(&open.reel, reel))
    }

    /// Appends a record to its file, or names the file and what is wrong with it. Records of a file
    /// that was given up are passed over.
    fn append(&mut self, reel: &Arc<Reel>, record: &Record) -> Result<(), (String, io::Error)> {
        let mut bytes = record.seal();
        if let Record::Start(start) = record {
            self.begin(reel, start)
                .map_err(|error| (self.shelf.settings().dir.display().to_string(), error))?;
            bytes.splice(..0, header());
        }
        let Some(at) = self.place(reel) else { return Ok(()) };
        let open = &mut self.open[at];
        let count = bytes.len() as u64;
        let written = fits(reel, count)
            .and_then(|()| self.shelf.make_room(count))
            .and_then(|()| open.file.write_all(&bytes));
        written.map_err(|error| (self.shelf.path(&open.name).display().to_string(), error))?;
        reel.bytes.fetch_add(count, Ordering::Relaxed);
        self.shelf.grow(&open.name, count);
        self.shelf.counters().bytes.fetch_add(count, Ordering::Relaxed);
        if matches!(record, Record::Ticks(_)) {
            open.has_ticks = true;
            self.succeed();
        }
        Ok(())
    }

    fn begin(&mut self, reel: &Arc<Reel>, start: &Start) -> io::Result<()> {
        let (name, file) = self.shelf.create(start)?;
        self.shelf.counters().files.fetch_add(1, Ordering::Relaxed);
        self.open.push(Open { reel: Arc::clone(reel), name, file, has_ticks: false });
        Ok(())
    }

    fn finish(&mut self, mut open: Open) {
        if let Err(error) = open.file.flush() {
            self.count_error(&self.shelf.path(&open.name).display().to_string(), &error);
        }
        self.shelf.finish(&open.name);
    }

    /// Gives a file up. What was written of it stays, if that is any ticks.
    fn fail(&mut self, reel: &Arc<Reel>, path: &str, error: &io::Error) {
        reel.failed.store(true, Ordering::Relaxed);
        if let Some(at) = self.place(reel) {
            let open = self.open.swap_remove(at);
            drop(open.file);
            match open.has_ticks {
                true => self.shelf.finish(&open.name),
                false => self.shelf.discard(&open.name),
            }
        }
        self.count_error(path, error);
    }

    fn count_error(&mut self, path: &str, error: &io::Error) {
        self.shelf.counters().errors.fetch_add(1, Ordering::Relaxed);
        if !self.is_failing {
            let retry_s = self.shelf.settings().retry.as_secs();
            error!(
                file = path, %error, retry_s,
                "CANNOT RECORD: games go on without, and a fresh file is tried again and again"
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

    /// Once a minute: the directory, files that nobody writes to any more, the counters.
    fn look(&mut self) {
        let now = self.clock.time(Instant::now(), (self.shelf.settings().wall)());
        if let Err(error) = self.shelf.look(now) {
            self.count_error(&self.shelf.settings().dir.display().to_string(), &error);
        }
        let (left, open): (Vec<_>, Vec<_>) = std::mem::take(&mut self.open)
            .into_iter()
            .partition(|open| open.reel.left.load(Ordering::Relaxed));
        self.open = open;
        left.into_iter().for_each(|open| self.finish(open));
        for reel in self.removed() {
            let error = io::Error::new(io::ErrorKind::NotFound, "somebody removed it");
            let dir = self.shelf.settings().dir.display().to_string();
            self.fail(&reel, &dir, &error);
        }
        self.tell("recording");
    }

    /// Files that are written and no longer there.
    fn removed(&self) -> Vec<Arc<Reel>> {
        let is_gone = |path: &Path| {
            path.symlink_metadata().is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
        };
        let removed = self.open.iter().filter(|open| is_gone(&self.shelf.path(&open.name)));
        removed.map(|open| Arc::clone(&open.reel)).collect()
    }

    /// Logs the counters if they changed.
    fn tell(&mut self, what: &str) {
        let counters = self.shelf.counters().read();
        if counters != self.told {
            let [files, bytes, dropped, errors] = counters;
            info!(files, bytes, dropped, errors, "{what}");
            self.told = counters;
        }
    }
}

/// A file that grew past every limit could not be read again.
fn fits(reel: &Reel, bytes: u64) -> io::Result<()> {
    let bytes = reel.bytes.load(Ordering::Relaxed) + bytes;
    match bytes > REPLAY_BYTES_MAX as u64 {
        true => Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("{bytes} bytes"))),
        false => Ok(()),
    }
}
