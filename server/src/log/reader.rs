//! What a room's thread has logged, a reader of it, and the single policy for failures when writing.

use jostle_protocol::replay::Record;
use jostle_room::log::RecentBlocks;
use std::fmt::Display;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};
use tokio::sync::Notify;
use tracing::{error, info};

/// The destination for a reader's output. Its functions may block. After an error, no file is open until the next one
/// begins.
pub trait Sink: Send {
    /// Begins a new file with these records, replacing the previous one.
    fn begin(&mut self, records: &[Arc<Record>]) -> io::Result<()>;

    /// Appends records to the file.
    fn append(&mut self, records: &[Arc<Record>]) -> io::Result<()>;

    /// Ensures that the appended records survive a power failure, if required.
    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Returns whether the file is so long that a new one should begin.
    fn is_full(&self) -> bool {
        false
    }

    /// Ends the file because its room has ended.
    fn seal(&mut self, seal: &Seal) -> io::Result<()>;
}

/// The policy for when a disk fails or is full, or NATS stalls. A reader gives up its file, the first of several
/// consecutive errors is logged, every error is counted, and a new file begins after a while. All readers of the same
/// kind share one policy.
#[derive(Debug)]
pub struct Policy {
    /// The message logged for the first error.
    cannot: &'static str,
    /// Time after which a reader that gave up its file begins a new one.
    retry: Duration,
    errors: Arc<AtomicU64>,
    /// Number of files that were given up because writing was too slow.
    dropped: Arc<AtomicU64>,
    is_failing: AtomicBool,
}

impl Policy {
    /// Creates a policy with no errors so far.
    pub fn new(cannot: &'static str, retry: Duration) -> Arc<Policy> {
        let (errors, dropped, is_failing) =
            (Arc::default(), Arc::default(), AtomicBool::new(false));
        Arc::new(Policy { cannot, retry, errors, dropped, is_failing })
    }

    /// The same policy, for one room. The room's first error is logged even if another room's was logged before.
    pub fn of_room(&self) -> Arc<Policy> {
        let (errors, dropped) = (Arc::clone(&self.errors), Arc::clone(&self.dropped));
        Arc::new(Policy { errors, dropped, is_failing: AtomicBool::new(false), ..*self })
    }

    /// Number of errors so far: files that were given up, were set aside, or could not be deleted.
    pub fn errors(&self) -> u64 {
        self.errors.load(Ordering::Relaxed)
    }

    /// Number of errors caused by a disk or network being too slow.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Counts an error that is logged elsewhere.
    pub fn count(&self) {
        self.errors.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts an error, and logs it if it is the first since a successful write.
    pub fn failed(&self, error: &dyn Display) {
        self.count();
        if !self.is_failing.swap(true, Ordering::Relaxed) {
            error!(%error, retry_s = self.retry.as_secs(), "{}", self.cannot);
        }
    }

    /// Called when the log has discarded blocks that a reader has not written yet.
    pub fn too_slow(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
        self.failed(&"what it is written to is too slow");
    }

    fn works(&self) {
        if self.is_failing.swap(false, Ordering::Relaxed) {
            info!("the log of a room is written again");
        }
    }
}

/// A reader's next step.
#[derive(Debug, PartialEq)]
pub enum NextWrite {
    Nothing,
    Begin(Vec<Arc<Record>>),
    Append(Vec<Arc<Record>>),
    Seal(Seal),
}

#[derive(Clone, Copy, Debug)]
pub struct Wants {
    /// Ticks after which the reader begins a new file at the next keyframe.
    pub file_ticks_max: u32,
    /// Whether the output is a replay. A replay's files have an end record, and omit the time when the room is empty.
    pub is_replay: bool,
    /// The clock used to name files.
    pub wall: fn() -> SystemTime,
}

/// A reader of a room's log, with its position.
pub struct LogReader {
    shared: Arc<SharedLog>,
    wants: Wants,
    /// The policy for errors.
    pub policy: Arc<Policy>,
    /// Position of the next block; `None` if no file is open.
    position: Option<u64>,
    /// The keyframe at which the next file begins, if it is not the newest one.
    begin_at: Option<u64>,
    /// Number of ticks played before the current file began.
    first_tick: u32,
    /// Time when the reader may begin a file again after an error.
    retry_at: Option<Instant>,
    /// Whether the room has ended and everything is done.
    pub is_finished: bool,
}

impl LogReader {
    /// Creates a reader for this log, with no open file.
    pub fn new(shared: &Arc<SharedLog>, policy: &Arc<Policy>, wants: Wants) -> LogReader {
        let (shared, policy) = (Arc::clone(shared), Arc::clone(policy));
        let (position, begin_at, retry_at, is_finished) = (None, None, None, false);
        LogReader {
            shared,
            wants,
            policy,
            position,
            begin_at,
            first_tick: 0,
            retry_at,
            is_finished,
        }
    }

    /// Waits until there may be new blocks to read.
    pub async fn changed(&self) {
        self.shared.changed().await;
    }

    /// Lets a sink perform the next step. Returns false if nothing can be done at the moment.
    pub fn step(&mut self, sink: &mut dyn Sink, now: Instant) -> bool {
        let next = self.next(now, sink.is_full());
        let done = match &next {
            NextWrite::Nothing => return false,
            NextWrite::Begin(records) => sink.begin(records),
            NextWrite::Append(records) => sink.append(records),
            NextWrite::Seal(seal) => sink.seal(seal),
        };
        match done {
            Ok(()) => self.done(&next),
            Err(error) => self.failed(&error, now),
        }
        true
    }

    /// The step to perform now. Its outcome must be reported through [`LogReader::done`] or [`LogReader::give_up`].
    pub fn next(&mut self, now: Instant, is_full: bool) -> NextWrite {
        let (shared, is_replay) = (Arc::clone(&self.shared), self.wants.is_replay);
        let held = shared.lock();
        let is_kept = !is_replay && held.seal == Some(Seal::Keep);
        let is_over = !is_replay && matches!(held.seal, Some(Seal::Remove | Seal::Leave));
        let position = match self.position {
            _ if self.is_finished => return NextWrite::Nothing,
            _ if is_over => return self.end(&held),
            // The last file is begun even if the previous one was given up.
            Some(position) if !is_kept || held.blocks.newest_keyframe() < Some(position) => {
                position
            }
            _ => return self.next_file(&held, is_kept, now),
        };
        let Some(mut blocks) = held.blocks.since(position) else {
            drop(held);
            self.policy.too_slow();
            self.give_up(now);
            return NextWrite::Nothing;
        };
        if blocks.is_empty() {
            return self.end(&held);
        }
        self.position = Some(held.blocks.end());
        let is_end = |block: &Arc<Record>| matches!(**block, Record::End { .. });
        if let Some(index) = blocks.iter().position(is_end).filter(|_| is_replay) {
            blocks.truncate(index + 1);
            self.position = None;
        }
        let (first_tick, ticks_max) = (self.first_tick, self.wants.file_ticks_max);
        let is_next = |block: &Arc<Record>| {
            keyframe(block).is_some_and(|(tick, _)| is_full || tick - first_tick >= ticks_max)
        };
        if let Some(index) = blocks.iter().position(is_next) {
            let end = keyframe(&blocks[index]).filter(|_| is_replay);
            blocks.truncate(index);
            blocks.extend(end.map(|(tick, hash)| Arc::new(Record::End { tick, hash })));
            (self.position, self.begin_at) = (None, Some(position + index as u64));
        }
        if !is_replay {
            blocks.retain(|block| matches!(**block, Record::Ticks(_) | Record::Host(_)));
        }
        NextWrite::Append(blocks)
    }

    /// Begins a file at a keyframe, if that is allowed now.
    fn next_file(&mut self, held: &Contents, is_kept: bool, now: Instant) -> NextWrite {
        let may = is_kept || self.retry_at.is_none_or(|at| now >= at);
        let is_wanted = !self.wants.is_replay
            || self.begin_at.is_some()
            || held.is_recorded && held.seal.is_none();
        let begin_at = self.begin_at.filter(|_| !is_kept).or_else(|| held.blocks.newest_keyframe());
        let Some(begin_at) = begin_at.filter(|_| may && is_wanted) else { return self.end(held) };
        self.begin_at = None;
        let Some(mut records) = held.blocks.since(begin_at) else { return NextWrite::Nothing };
        if self.wants.is_replay {
            records.truncate(1);
        }
        self.position = Some(begin_at + records.len() as u64);
        self.first_tick = keyframe(&records[0]).map_or(0, |(tick, _)| tick);
        let unix = (self.wants.wall)().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let start = held.blocks.start(unix.as_secs(), self.first_tick);
        // The initial state follows from the scene and the seed.
        let states = usize::from(self.first_tick == 0);
        let rest = records.split_off(1).into_iter();
        let rest = rest.filter(|block| matches!(**block, Record::Ticks(_) | Record::Host(_)));
        records.splice(..states, [Arc::new(start)]);
        records.extend(rest);
        NextWrite::Begin(records)
    }

    /// The remaining steps, if the room has ended.
    fn end(&mut self, held: &Contents) -> NextWrite {
        self.is_finished = held.seal.is_some();
        match &held.seal {
            None => NextWrite::Nothing,
            Some(_) if self.wants.is_replay => NextWrite::Seal(Seal::Keep),
            Some(Seal::Leave) => NextWrite::Nothing,
            Some(seal) => NextWrite::Seal(seal.clone()),
        }
    }

    /// Called after the next step has succeeded.
    pub fn done(&self, next: &NextWrite) {
        // Only appending proves that the disk works; there may be enough space for the start of a file but not for its
        // ticks.
        if let NextWrite::Append(_) = next {
            self.policy.works();
        }
    }

    /// Gives up the file because of an error.
    pub fn failed(&mut self, error: &dyn Display, now: Instant) {
        self.policy.failed(error);
        self.give_up(now);
    }

    /// Gives up the file after an error that has already been counted. A new file begins after a while, unless the room
    /// has ended.
    pub fn give_up(&mut self, now: Instant) {
        (self.position, self.begin_at) = (None, None);
        self.retry_at = Some(now + self.policy.retry);
        self.is_finished |= self.shared.lock().seal.is_some();
    }
}

/// A keyframe's tick and hash.
fn keyframe(block: &Record) -> Option<(u32, u64)> {
    match block {
        Record::Keyframe(keyframe) => Some((keyframe.tick, keyframe.hash)),
        _ => None,
    }
}

/// The fate of a room's state once the room has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Seal {
    /// The state is kept, from its newest keyframe on, because the room resumes later or elsewhere.
    Keep,
    /// The state is removed.
    Remove,
    /// The state is left untouched, because another node plays the room.
    Leave,
}

/// A room's log, shared with its readers. The room's thread puts blocks into it after its ticks.
#[derive(Default)]
pub struct SharedLog {
    held: Mutex<Contents>,
    /// Wakes a reader that runs as a task.
    changed: Notify,
}

/// The contents visible to readers.
#[derive(Default)]
pub struct Contents {
    pub blocks: RecentBlocks,
    /// Whether replays should include the current ticks. An empty room is not recorded.
    pub is_recorded: bool,
    /// What happens to the room's state once everything has been read, if the room has ended.
    pub seal: Option<Seal>,
}

impl SharedLog {
    /// Shares the newest blocks of a room, unless its log is sealed.
    pub fn publish(&self, blocks: RecentBlocks, is_recorded: bool) {
        let mut held = self.lock();
        if held.seal.is_none() {
            (held.blocks, held.is_recorded) = (blocks, is_recorded);
        }
        drop(held);
        self.changed.notify_one();
    }

    /// Ends the log. The first seal counts, since a room that was given up may wake up later.
    pub fn seal(&self, seal: Seal) {
        self.lock().seal.get_or_insert(seal);
        self.changed.notify_one();
    }

    /// Waits until there is something new since the previous call.
    pub async fn changed(&self) {
        self.changed.notified().await;
    }

    /// Locks the log briefly to list blocks, but never while writing.
    pub fn lock(&self) -> MutexGuard<'_, Contents> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
