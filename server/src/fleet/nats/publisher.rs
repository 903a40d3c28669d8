//! The sink of the rooms' records: a task for each room writes them into the stream, one after another.

use super::records::{Records, Sequence};
use super::room_sink::RoomSink;
use super::room_task::{Outcome, RoomTask, Shared};
use crate::durable::{RecordKeeper, RecordSink};
use crate::fleet::handle::Fleet;
use crate::limits;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::runtime::Handle;
use tokio::sync::mpsc;

/// Keeps the records of rooms for the other nodes.
pub struct Publisher {
    shared: Arc<Shared>,
    handle: Handle,
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
            alive: Mutex::new(Some(alive)),
            all_gone: Mutex::new(all_gone),
        }
    }

    /// A number that no other message has.
    pub fn next_writer(&self) -> u64 {
        self.shared.next_writer()
    }

    /// Starts the task of a room whose last message is `last`, and returns the room's sink; `None` if the server ends.
    pub fn open(
        &self,
        records: &Records,
        code: &str,
        epoch: u64,
        last: Sequence,
    ) -> Option<Arc<dyn RecordSink>> {
        let alive = lock(&self.alive).clone()?;
        let (sender, jobs) = mpsc::channel(limits::FLEET_BATCHES_MAX);
        let task = RoomTask::new(Arc::clone(&self.shared), records.clone(), code, epoch, last);
        self.handle.spawn(async move {
            task.run(jobs).await;
            drop(alive);
        });
        Some(Arc::new(RoomSink::new(sender, self.shared.error_count())))
    }
}

impl RecordKeeper for Publisher {
    fn common_sink(self: Arc<Self>) -> Option<Arc<dyn RecordSink>> {
        None
    }

    fn errors(&self) -> u64 {
        self.shared.errors()
    }

    fn close(&self) {
        lock(&self.alive).take();
        lock(&self.all_gone).blocking_recv();
    }
}

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
