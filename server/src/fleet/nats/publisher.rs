//! The sink of the rooms' records: a task for each room writes them into the stream, one after another.

use super::records::{Message, Published, Records, Sequence, payloads};
use crate::durable::{Job, RecordSink, RoomFile};
use crate::fleet::directory::RETRY;
use crate::fleet::handle::Fleet;
use crate::limits;
use bytes::Bytes;
use jostle_protocol::replay::Record;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::runtime::Handle;
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep};
use tracing::{error, warn};

/// Keeps the records of rooms for the other nodes.
pub struct Publisher {
    fleet: Arc<Fleet>,
    handle: Handle,
    rooms: Mutex<BTreeMap<String, mpsc::Sender<Job>>>,
    /// Numbers of messages; the process begins at a random one.
    next_writer: AtomicU64,
    errors: AtomicU64,
    /// Every task holds a sender; once all are dropped, none is left.
    alive: Mutex<Option<mpsc::Sender<Infallible>>>,
    all_gone: Mutex<mpsc::Receiver<Infallible>>,
}

impl Publisher {
    /// A publisher whose tasks run on this runtime.
    pub fn new(fleet: Arc<Fleet>, handle: Handle) -> Publisher {
        let (alive, all_gone) = mpsc::channel(1);
        Publisher {
            next_writer: AtomicU64::new(fleet.first_incarnation()),
            fleet,
            handle,
            rooms: Mutex::default(),
            errors: AtomicU64::new(0),
            alive: Mutex::new(Some(alive)),
            all_gone: Mutex::new(all_gone),
        }
    }

    /// A number that no other message has.
    pub fn next_writer(&self) -> u64 {
        self.next_writer.fetch_add(1, Ordering::Relaxed)
    }

    /// Starts the task of a room whose last message is `last`.
    pub fn open(self: &Arc<Self>, records: &Records, code: &str, epoch: u64, last: Sequence) {
        let Some(alive) = lock(&self.alive).clone() else { return };
        let (sender, jobs) = mpsc::channel(limits::FLEET_BATCHES_MAX);
        lock(&self.rooms).insert(code.to_owned(), sender);
        let task = RoomTask {
            publisher: Arc::clone(self),
            records: records.clone(),
            code: code.to_owned(),
            epoch,
            last,
            from: 0,
            shut_out: false,
        };
        self.handle.spawn(async move {
            task.run(jobs).await;
            drop(alive);
        });
    }

    fn sender(&self, job: &Job) -> Option<mpsc::Sender<Job>> {
        lock(&self.rooms).get(&job.room_file()?.code).cloned()
    }
}

impl RecordSink for Publisher {
    fn try_send(&self, job: Job) -> bool {
        self.sender(&job).is_some_and(|sender| sender.try_send(job).is_ok())
    }

    fn send(&self, job: Job) {
        if let Some(sender) = self.sender(&job) {
            // A task that is gone has logged why.
            let _ = sender.blocking_send(job);
        }
    }

    fn set_aside(&self, code: &str, reason: &str) {
        error!(room = %code, reason, "a room cannot be restored from its records");
    }

    fn errors(&self) -> u64 {
        self.errors.load(Ordering::Relaxed)
    }

    fn count_error(&self) {
        self.errors.fetch_add(1, Ordering::Relaxed);
    }

    fn close(&self) {
        lock(&self.rooms).clear();
        lock(&self.alive).take();
        lock(&self.all_gone).blocking_recv();
    }
}

/// The task of one room.
struct RoomTask {
    publisher: Arc<Publisher>,
    records: Records,
    code: String,
    epoch: u64,
    /// The last message of the room.
    last: Sequence,
    /// The first message of the newest whole file; 0 before the first.
    from: Sequence,
    /// Whether another node has begun to play the room.
    shut_out: bool,
}

impl RoomTask {
    async fn run(mut self, mut jobs: mpsc::Receiver<Job>) {
        let mut current: Option<Arc<RoomFile>> = None;
        while let Some(job) = jobs.recv().await {
            let is_current =
                |file: &Arc<RoomFile>| current.as_ref().is_some_and(|c| Arc::ptr_eq(c, file));
            match job {
                Job::Begin(file, records) => {
                    let begun = self.begin(&records).await;
                    current = self.note(file, begun);
                }
                Job::Append(file, records) if is_current(&file) => {
                    let appended = self.append(bytes(&records).into(), None).await;
                    current = self.note(file, appended.is_some());
                }
                Job::Close(file) if is_current(&file) => {
                    let code = &self.code;
                    self.publisher.fleet.tell(|directory, now| directory.parted(code, now));
                }
                Job::Remove(_) => self.remove().await,
                Job::Append(..) | Job::Close(_) | Job::End => {}
            }
        }
    }

    /// Writes the beginning of a new file, and removes the one before once it is whole.
    async fn begin(&mut self, records: &[Record]) -> bool {
        let payloads = payloads(bytes(records));
        let count = payloads.len();
        let mut first = 0;
        for (part, payload) in (1..).zip(payloads) {
            // The last part makes it whole.
            let from = if part == count { Some(first) } else { None };
            let Some(sequence) = self.append(payload, Some((part, count, from))).await else {
                return false;
            };
            if part == 1 {
                first = sequence;
            }
        }
        self.from = first;
        let (records, code) = (self.records.clone(), self.code.clone());
        tokio::spawn(async move {
            // What is left is removed after the next file.
            let _ = records.purge(&code, Some(first)).await;
        });
        true
    }

    /// Writes a message, and tries again until it is known to be written or the room is another node's.
    async fn append(
        &mut self,
        payload: Bytes,
        part: Option<(usize, usize, Option<Sequence>)>,
    ) -> Option<Sequence> {
        let message = Message {
            epoch: self.epoch,
            writer: self.publisher.next_writer(),
            from: part.and_then(|(_, _, from)| from).unwrap_or(self.from),
            part: part.map(|(number, count, _)| (number, count)),
            payload,
        };
        let give_up_at = Instant::now() + limits::FLEET_PUBLISH;
        while !self.shut_out && Instant::now() < give_up_at {
            match self.records.publish(&self.code, &message, self.last).await {
                Published::Done(sequence) => {
                    self.last = sequence;
                    return Some(sequence);
                }
                Published::Unknown => sleep(RETRY).await,
                Published::Refused => match self.records.own_last(&self.code, message.writer).await
                {
                    // An attempt before had been written after all.
                    Ok(Some(sequence)) => {
                        self.last = sequence;
                        return Some(sequence);
                    }
                    Ok(None) => self.is_shut_out(),
                    Err(_) => sleep(RETRY).await,
                },
            }
        }
        None
    }

    fn is_shut_out(&mut self) {
        self.shut_out = true;
        warn!(room = %self.code, epoch = self.epoch, "records were refused: another node plays the room");
        let code = &self.code;
        self.publisher.fleet.tell(|directory, now| directory.fenced(code, now));
    }

    async fn remove(&mut self) {
        if self.shut_out {
            return;
        }
        for _ in 0..3 {
            match self.records.purge(&self.code, None).await {
                Ok(()) => break,
                Err(_) => sleep(RETRY).await,
            }
        }
        let code = &self.code;
        self.publisher.fleet.tell(|directory, now| directory.ended(code, now));
    }

    /// Gives a file up after an error: its room begins a new one after a while.
    fn note(&self, file: Arc<RoomFile>, is_kept: bool) -> Option<Arc<RoomFile>> {
        if is_kept {
            return Some(file);
        }
        self.publisher.errors.fetch_add(1, Ordering::Relaxed);
        if !file.failed.swap(true, Ordering::Relaxed) && !self.shut_out {
            error!(
                room = %self.code, retry_s = limits::STATE_RETRY.as_secs(),
                "CANNOT KEEP A ROOM: the game goes on, but another node would not know what is played from here on"
            );
        }
        None
    }
}

fn bytes(records: &[Record]) -> Vec<u8> {
    records.iter().flat_map(Record::seal).collect()
}

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
