//! The sink of the rooms' records: a task for each room writes them into the stream, one after another.

use super::records::{Records, Sequence};
use super::room_task::{Outcome, RoomTask, Shared};
use crate::durable::{Job, RecordSink};
use crate::fleet::handle::Fleet;
use crate::limits;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::runtime::Handle;
use tokio::sync::mpsc;
use tracing::error;

/// Keeps the records of rooms for the other nodes.
pub struct Publisher {
    shared: Arc<Shared>,
    handle: Handle,
    rooms: Mutex<BTreeMap<String, mpsc::Sender<Job>>>,
    /// Every task holds a sender; once all are dropped, none is left.
    alive: Mutex<Option<mpsc::Sender<Infallible>>>,
    all_gone: Mutex<mpsc::Receiver<Infallible>>,
}

impl Publisher {
    /// A publisher whose tasks run on this runtime.
    pub fn new(fleet: Arc<Fleet>, handle: Handle) -> Publisher {
        let (alive, all_gone) = mpsc::channel(1);
        Publisher {
            shared: Arc::new(Shared::new(fleet.first_incarnation(), move |code, outcome| {
                fleet.tell(|directory, now| match outcome {
                    Outcome::Parted => directory.parted(code, now),
                    Outcome::Ended => directory.ended(code, now),
                    Outcome::Fenced => directory.fenced(code, now),
                });
            })),
            handle,
            rooms: Mutex::default(),
            alive: Mutex::new(Some(alive)),
            all_gone: Mutex::new(all_gone),
        }
    }

    /// A number that no other message has.
    pub fn next_writer(&self) -> u64 {
        self.shared.next_writer()
    }

    /// Starts the task of a room whose last message is `last`.
    pub fn open(&self, records: &Records, code: &str, epoch: u64, last: Sequence) {
        let Some(alive) = lock(&self.alive).clone() else { return };
        let (sender, jobs) = mpsc::channel(limits::FLEET_BATCHES_MAX);
        lock(&self.rooms).insert(code.to_owned(), sender);
        let task = RoomTask::new(Arc::clone(&self.shared), records.clone(), code, epoch, last);
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
        self.shared.errors()
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

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
