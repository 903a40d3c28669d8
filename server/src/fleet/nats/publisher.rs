//! Publishes rooms' records. For each room, a task writes them to the stream, one after another.

use super::records::{Records, Sequence};
use super::room_task::{RoomOutcome, RoomTask, RoomTaskContext};
use crate::fleet::directory::RoomEvent;
use crate::fleet::handle::Fleet;
use crate::limits;
use crate::log::{LogReader, Policy, STATE, SharedLog};
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::runtime::Handle;
use tokio::sync::mpsc;

/// Stores rooms' records for other nodes.
pub struct Publisher {
    shared: Arc<RoomTaskContext>,
    policy: Arc<Policy>,
    handle: Handle,
    /// Every task holds a clone of the sender. Once all of them are dropped, no tasks are left.
    alive: Mutex<Option<mpsc::Sender<Infallible>>>,
    all_gone: Mutex<mpsc::Receiver<Infallible>>,
}

impl Publisher {
    /// Creates a publisher whose tasks run on this runtime.
    pub fn new(fleet: Arc<Fleet>, handle: Handle) -> Publisher {
        let (alive, all_gone) = mpsc::channel(1);
        let cannot = "CANNOT KEEP A ROOM: another node would not know what is played from here on";
        Publisher {
            shared: Arc::new(RoomTaskContext::new(
                fleet.first_incarnation(),
                move |code, outcome| {
                    fleet.tell(|directory, now| match outcome {
                        RoomOutcome::Parted => directory.room(code, RoomEvent::Parted, now),
                        RoomOutcome::Ended => directory.room(code, RoomEvent::Ended, now),
                        RoomOutcome::Fenced => directory.room(code, RoomEvent::Fenced, now),
                    });
                },
            )),
            policy: Policy::new(cannot, limits::STATE_RETRY),
            handle,
            alive: Mutex::new(Some(alive)),
            all_gone: Mutex::new(all_gone),
        }
    }

    /// A unique message number.
    pub fn next_writer(&self) -> u64 {
        self.shared.next_writer()
    }

    /// The policy for records that cannot be written.
    pub fn policy(&self) -> &Arc<Policy> {
        &self.policy
    }

    /// Starts the task for a room whose last message is `last`. Returns the log, which the task reads until the log is
    /// sealed, or `None` if the server is shutting down.
    pub fn open(
        &self,
        records: &Records,
        code: &str,
        epoch: u64,
        last: Sequence,
    ) -> Option<Arc<SharedLog>> {
        let alive = lock(&self.alive).clone()?;
        let shared = Arc::default();
        let reader = LogReader::new(&shared, &self.policy.of_room(), STATE);
        let task = RoomTask::new(Arc::clone(&self.shared), records.clone(), code, epoch, last);
        self.handle.spawn(async move {
            task.run(reader).await;
            drop(alive);
        });
        Some(shared)
    }

    /// Waits until all records have been written, and then ends.
    pub fn close(&self) {
        lock(&self.alive).take();
        lock(&self.all_gone).blocking_recv();
    }
}

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
